"""`import jaxsh` costs little beyond `import jax`."""

import json
import os
import pathlib
import subprocess
import sys

import faces
import pytest

ROOT = pathlib.Path(__file__).parents[1]
HEAVY = {"OpenImageIO", "embreex", "equinox", "jaxopt", "matplotlib", "optimistix", "scipy"}
HEAVY |= {"lineax", "trimesh"}


def measure(statement: str) -> dict:
    """Seconds and top-level modules that a statement adds to `import jax` in a fresh process."""
    code = (
        "import json, sys, time, jax\n"
        "before, start = set(sys.modules), time.perf_counter()\n"
        f"{statement}\n"
        "seconds = time.perf_counter() - start\n"
        "added = sorted(set(sys.modules) - before)\n"
        "print(json.dumps({'seconds': seconds, 'added': added}))"
    )
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return json.loads(run.stdout)


def top_level(added):
    return {name.split(".")[0] for name in added}


def test_import_is_light():
    runs = [measure("import jaxsh") for _ in range(3)]
    assert min(run["seconds"] for run in runs) < 0.3
    assert not top_level(runs[0]["added"]) & HEAVY
    assert [name for name in runs[0]["added"] if name.startswith("jaxsh")] == ["jaxsh"]


def test_each_module_loads_only_what_it_needs():
    # In one process, lowest first: what one has loaded the next finds loaded.
    code = (
        "import importlib\n"
        "loaded = {}\n"
        "names = 'harmonics', 'sphere', 'geometry', 'imaging', 'transfer', 'sky', 'adaptive'\n"
        "for name in names:\n"
        "    importlib.import_module('jaxsh.' + name)\n"
        "    loaded[name] = {m.split('.')[0] for m in sys.modules}\n"
        "assert not loaded['harmonics'] & HEAVY, loaded['harmonics'] & HEAVY\n"
        "for name, added in loaded.items():\n"
        "    assert added & HEAVY <= {'equinox'}, (name, added & HEAVY)"
    )
    added = measure(f"HEAVY = {HEAVY}\n{code}")["added"]
    assert {"jaxsh.harmonics", "jaxsh.adaptive"} <= set(added)
    assert not {"jaxsh.midrange", "jaxsh.inverse", "jaxsh.plot"} & set(added)


def test_plots_choose_no_backend_and_load_no_window():
    added = measure("import jaxsh.plot, matplotlib")["added"]
    assert {"jaxsh.imaging", "jaxsh.sphere"} <= set(added)
    assert "matplotlib.pyplot" not in added


def test_modules_are_listed_and_others_refused():
    import jaxsh

    assert set(jaxsh.__all__) < set(dir(jaxsh))
    for module in faces.MODULES:
        assert getattr(jaxsh, module).__name__ == f"jaxsh.{module}"
    assert [callable(getattr(jaxsh, name)) for name in faces.TOP] == [True] * len(faces.TOP)
    with pytest.raises(AttributeError, match=r"no attribute 'kitchen'; it has .*'harmonics'"):
        _ = jaxsh.kitchen


# As on a machine without a wheel, or where someone left out what they do not use.
OPTIONAL = ("OpenImageIO", "embreex", "jaxopt", "lineax", "matplotlib", "optimistix")
OPTIONAL += ("PIL", "mapbox_earcut", "trimesh")
BLOCK = """
import sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {optional}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Absent())
"""
BASIS = """
import jax.numpy as jnp
from jaxsh import geometry, harmonics, imaging, sky, sphere, transfer

assert harmonics.evaluate(jnp.eye(3), 2).shape == (3, 9)
light = sphere.project_lat_long(imaging.studio(), degree=2)
mesh = geometry.knot(300)
baked = transfer.bake(mesh, degree=2, directions=32, progress=False)
assert transfer.shade_diffuse(light, baked, 0.5).shape == (len(mesh.vertices), 3)
assert sky.preetham_harmonics(jnp.array([0.0, 0.6, 0.8]), 3.0).shape[0] == 3
"""


@pytest.mark.slow  # also: make test-minimal
def test_the_basis_and_a_bake_run_without_optional_packages():
    code = BLOCK.format(optional=set(OPTIONAL)) + BASIS
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("package", "statement"),
    [
        ("OpenImageIO", "imaging.read_environment('grace.exr')"),
        ("matplotlib", "plot.bands([1.0])"),
        ("mapbox_earcut", "geometry.read_mesh('plus.off')"),
    ],
)
def test_what_needs_a_package_says_so_without_it(package, statement, tmp_path):
    (tmp_path / "grace.exr").write_bytes(b"")
    plus = "10 20 21 31 32 22 23 13 12 02 01 11"
    corners = [f"{x} {y} 0" for x, y in plus.split(" ")]
    lines = ["OFF 12 1 0", *corners, " ".join(map(str, (12, *range(12))))]
    (tmp_path / "plus.off").write_text("\n".join(lines))
    code = BLOCK.format(optional={package}) + (
        f"from jaxsh import geometry, imaging, plot\n{statement}"
    )
    run = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 1
    assert package in run.stderr.splitlines()[-1]
