"""A textured GLB shaded by harmonics: beside Mitsuba, and beside rays and sums in NumPy."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from runs import run

from experiments.surfaces.textured_mesh import write_glb
from jaxsh import geometry, harmonics, imaging, sphere, transfer

WHY = "renders with Mitsuba, which is not installed (pip install mitsuba)"


@pytest.mark.slow
def test_a_textured_glb_is_as_mitsuba_renders_it(tmp_path):
    pytest.importorskip("mitsuba", reason=WHY)
    options = "--environments studio --degrees 10 --vertices 6000 --directions 1024 --size 72"
    small = [*options.split(), "--texture", "128", "--paths", "256"]
    folder, rows = run(tmp_path, "surfaces.textured", *small)
    found = {(row["light"], row["color"]): row for row in rows}
    assert len(found) == 4
    soft = found["soft", "texture"]
    assert soft["psnr"] > 35
    assert soft["psnr_without_noise"] > 38
    assert soft["psnr"] > found["soft", "vertices"]["psnr"] + 6
    assert (folder / "textured.png").exists()


@pytest.mark.slow
def test_levels_are_nearest_to_many_samples(tmp_path):
    options = "--vertices 2000 --texture 128 --sizes 40 --samples 1 2 --reference 8"
    _, rows = run(tmp_path, "surfaces.levels", *options.split())
    for row in rows:
        assert row["ours"] > row["none"] + 3
        assert row["ours"] > row["OpenGL"] + 3


def test_a_textured_glb_is_what_rays_and_sums_see(tmp_path, rng):
    """The render of the test above where there is no Mitsuba: coarse, under a light of degree 4."""
    mesh = geometry.read_mesh(write_glb(tmp_path / "knot.glb", 1500, 8))
    # Smooth, so that a few samples a pixel are enough for both.
    v, u = 2 * np.pi * (np.mgrid[:32, :32] + 0.5) / 32
    waves = [0.5 + 0.3 * np.sin(u), 0.6 + 0.3 * np.cos(v), 0.4 + 0.2 * np.sin(u + v), 1 + 0 * u]
    codes = np.round(255 * np.stack(waves, axis=-1)).astype(np.uint8)
    material = dataclasses.replace(mesh.materials[0], texture=codes)
    mesh = dataclasses.replace(mesh, materials=(material,))
    light = np.zeros((3, 25), np.float32)
    light[:, 0] = 3.0
    light[:, 1:] = rng.normal(size=(3, 24)) * 0.2  # of both signs, and no less linear
    camera = imaging.Camera.facing(mesh, width=16, height=16)

    raster = imaging.rasterize(mesh, camera, samples=2)
    baked = transfer.bake(mesh, 4, directions=512, progress=False)
    shaded = transfer.shade_diffuse(jnp.asarray(light), baked, 1.0)
    color = imaging.base_color(mesh, raster)
    ours = np.asarray(imaging.interpolate(raster, shaded, color=color))

    scene, face = geometry.ray_scene(mesh), np.asarray(raster.face).ravel()
    seen = face >= 0
    corners = np.asarray(mesh.faces)[face[seen]]
    weights = np.asarray(raster.barycentric).reshape(-1, 3)[seen]

    def at(values):
        return np.einsum("nk,nkc->nc", weights, np.asarray(values)[corners])

    place, normal = at(mesh.vertices), at(mesh.normals)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    directions = np.asarray(sphere.fibonacci(600).directions, np.float32)
    radiance = np.asarray(harmonics.evaluate(directions, 4)) @ light.T
    cosine = np.maximum(normal @ directions.T, 0)
    point, direction = np.nonzero(cosine)
    origin = place[point] + 1e-3 * normal[point]
    cosine[point, direction] *= ~scene.occluded(origin.astype("f4"), directions[direction])
    irradiance = cosine @ radiance * (4 * np.pi / 600)
    uv = at(mesh.uv)
    column, row = uv[:, 0] % 1 * 32 - 0.5, (1 - uv[:, 1]) % 1 * 32 - 0.5
    j, i = np.floor(column).astype(int), np.floor(row).astype(int)
    s, t = (column - j)[:, None], (row - i)[:, None]
    linear = ((codes[..., :3] / 255 + 0.055) / 1.055) ** 2.4  # none is in the straight part

    def texel(a, b):
        return linear[a % 32, b % 32]

    top = texel(i, j) * (1 - s) + texel(i, j + 1) * s
    bottom = texel(i + 1, j) * (1 - s) + texel(i + 1, j + 1) * s
    albedo = (top * (1 - t) + bottom * t) * 0.9
    samples = np.zeros((32 * 32, 3))
    samples[seen] = albedo / np.pi * irradiance
    theirs = samples.reshape(16, 2, 16, 2, 3).mean(axis=(1, 3))

    exposure = 1 / np.percentile(theirs[np.asarray(raster.mask)].max(axis=-1), 99)
    error = np.mean((exposure * (ours - theirs)) ** 2)
    assert -10 * np.log10(error) > 35  # 39.7 measured
