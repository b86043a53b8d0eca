"""`import jaxsh` costs little beyond `import jax`."""

import json
import pathlib
import subprocess
import sys

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


def test_the_lower_modules_load_without_readers_and_solvers():
    added = measure("import jaxsh; jaxsh.sphere.lat_long; jaxsh.harmonics.evaluate")["added"]
    assert {"jaxsh.harmonics", "jaxsh.sphere"} <= set(added)
    assert not {"jaxsh.geometry", "jaxsh.imaging"} & set(added)
    assert not top_level(added) & (HEAVY - {"equinox"})


def test_the_stored_sky_needs_no_solver():
    statement = "from jaxsh import sky; sky.preetham_harmonics([0.0, 0.0, 1.0], 3.0, 1)"
    assert not top_level(measure(statement)["added"]) & (HEAVY - {"equinox"})


def test_plots_choose_no_backend_and_load_no_window():
    added = measure("import jaxsh.plot, matplotlib")["added"]
    assert {"jaxsh.imaging", "jaxsh.sphere"} <= set(added)
    assert "matplotlib.pyplot" not in added


def test_modules_are_listed_and_others_refused():
    import jaxsh

    assert set(jaxsh.__all__) < set(dir(jaxsh))
    for module in jaxsh.__all__:
        assert getattr(jaxsh, module).__name__ == f"jaxsh.{module}"
    with pytest.raises(AttributeError, match=r"no attribute 'kitchen'; it has .*'harmonics'"):
        _ = jaxsh.kitchen
