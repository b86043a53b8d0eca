"""Meshes, rays, bakes and pictures where Embree and OpenImageIO are not installed."""

import subprocess
import sys
import warnings

import numpy as np
import pytest

from jaxsh import geometry, imaging, transfer
from jaxsh.geometry import _embree

BLOCKED = """
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("embreex", "OpenImageIO", "mapbox_earcut", "PIL", "trimesh"):
            raise ImportError(f"{name} is blocked")

sys.meta_path.insert(0, Blocker())
"""


def _run(code: str) -> str:
    done = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning", "-c", BLOCKED + code],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def test_what_needs_none_of_them_works_without(tmp_path):
    said = _run(f"""
import numpy as np, jaxsh
from jaxsh import geometry, imaging, transfer
mesh = geometry.knot(300)
baked = transfer.bake(mesh, 1, directions=64, progress=False)
camera = imaging.Camera.facing(mesh, width=8, height=8)
raster = imaging.rasterize(mesh, camera)
assert raster.mask.any() and np.isfinite(baked.coefficients).all()
np.save({str(tmp_path / "probe.npy")!r}, np.ones((2, 4, 3), np.float32))
open({str(tmp_path / "a.off")!r}, "w").write("OFF\\n3 1 0\\n0 0 0\\n1 0 0\\n0 1 0\\n3 0 1 2\\n")
assert geometry.read_mesh({str(tmp_path / "a.off")!r}).faces.shape == (1, 3)
assert imaging.read_environment({str(tmp_path / "probe.npy")!r}).shape == (2, 4, 3)
for attempt in (
    lambda: imaging.write_image({str(tmp_path / "a.png")!r}, imaging.studio(2, 4)),
    lambda: geometry.EmbreeRayScene(mesh),
):
    try:
        attempt()
    except ImportError as error:
        print("IMPORT", error)
""")
    # Said once, though the bake and the picture each build a scene.
    assert said.count("embreex cannot be imported here, so rays are cast by JAX") == 1
    sentences = [line for line in said.splitlines() if line.startswith("IMPORT")]
    assert len(sentences) == 2
    for sentence, package in zip(sentences, ("OpenImageIO", "embreex"), strict=True):
        assert f"needs the package {package}" in sentence or f"needs {package}" in sentence


def test_the_bake_and_the_picture_are_those_of_embree(monkeypatch):
    mesh = geometry.knot(300)
    camera = imaging.Camera.facing(mesh, width=12, height=12)
    # Nearer to the surface one of these rays grazes a face, and Embree alone lets it hit.
    options = {"directions": 64, "bounces": 1, "ray_bias": 1e-4, "progress": False}
    known = transfer.bake(mesh, 2, **options).coefficients, imaging.rasterize(mesh, camera).face
    monkeypatch.setitem(sys.modules, "embreex.mesh_construction", None)
    _embree._warn_once.cache_clear()
    with pytest.warns(UserWarning, match="cast by JAX"):
        scene = geometry.ray_scene(mesh)
    assert isinstance(scene, geometry.JaxRayScene)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        baked = transfer.bake(mesh, 2, **options).coefficients
        face = imaging.rasterize(mesh, camera).face
    # Rays along edges alone may differ.
    np.testing.assert_allclose(baked, known[0], rtol=0, atol=2e-6)
    np.testing.assert_array_equal(face, known[1])


def test_exr_pictures_name_the_package_they_need(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "OpenImageIO", None)
    (tmp_path / "probe.exr").write_bytes(b"v/1\x01\x02\0\0\0")
    with pytest.raises(ImportError, match=r"probe\.exr: reading \.exr needs the package OpenImag"):
        imaging.read_environment(tmp_path / "probe.exr")


def test_scenes_of_embree_where_it_is_installed():
    pytest.importorskip("embreex")
    mesh = geometry.knot(300)
    assert isinstance(geometry.ray_scene([mesh, mesh]), geometry.EmbreeRayScene)
    for scene in (geometry.ray_scene(mesh), geometry.JaxRayScene(mesh)):
        assert isinstance(scene, geometry.RayScene)
