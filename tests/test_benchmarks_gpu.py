"""`python -m benchmarks.gpu` runs on a CPU too, with tiny sizes."""

import json
import re
import subprocess
import sys

import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks import _gpu_frames, _gpu_limits, gpu
from benchmarks._gpu_case import Case
from jaxsh import adaptive, sphere, transfer


def test_a_case_is_set_beside_its_limit():
    # An amount per second of 1 for each limit: the share is the rate.
    limits = {name: {"value": 1.0, "unit": probe.unit} for name, probe in _gpu_limits.probes(8, 4)}
    square = jnp.ones((4, 4), jnp.float32)
    case = Case(
        *("square", jnp.matmul, (square, square), 16, "numbers", 192.0),
        limit="tf32",
        operations=128.0,
        precision="tf32",
    )
    full = {}
    row = gpu.measure(case, limits, rounds=1, full=full)
    assert row["finite"]
    assert row["limit"] == "tf32"
    assert full == {}
    assert row["share"] == row["share_of_product"] == 128 / row["seconds"]
    assert row["share_of_copy"] == 192 / row["seconds"]
    assert row["rate"] == 16 / row["seconds"]
    broken = gpu.measure(case._replace(arguments=(square,)), limits, rounds=1)
    assert broken["error"].startswith("TypeError")


def test_colors_in_tf32_are_set_beside_full_ones():
    limits = {name: {"value": 1.0, "unit": "B/s"} for name in ("copy", "read", "float32", "tf32")}
    full, row = {}, {}
    for scale, precision in ((1.0, "float32"), (1.5, "tf32")):
        case = Case(
            "colors", lambda x: x, (jnp.full(3, scale),), 3, "vertices", 1.0, precision=precision
        )
        row = gpu.measure(case, limits, rounds=1, full=full)
    assert row["rms_off_full"] == 0.5
    assert full == {}


def test_the_data_sheet_is_found_by_the_device():
    assert _gpu_limits.vendor("NVIDIA H200") == _gpu_limits.VENDOR["H200"]
    assert _gpu_limits.vendor("cpu") is None


def test_a_wrong_expression_is_refused_before_the_work(tmp_path):
    with pytest.raises(re.error):
        gpu.run(gpu.Options(only="(", out=tmp_path / "gpu.json"))


@pytest.mark.slow
def test_tiles_are_repeated():
    [case] = _gpu_frames.tiles(301, 80)  # 3 × 100
    tiles, light, eye, material = case.arguments
    glossy = transfer.Material(0.0, material.specular, material.exponent)
    parts = case.function(tiles, light, eye, glossy).reshape(3, 100, 3)
    assert (parts[1:] == parts[:1]).all()
    assert jnp.ptp(parts) > 0
    # The first third of the points by themselves.
    points = sphere.fibonacci(301).directions[:100].astype(np.float32)
    made = transfer.unshadowed(points, points, 10)
    alone = adaptive.make_tiles(made, eye)(light, eye, glossy).color
    np.testing.assert_allclose(parts[0], alone, rtol=0, atol=1e-6)


@pytest.mark.slow
def test_it_ends_in_time_with_what_there_is(tmp_path):
    out = tmp_path / "gpu.json"
    options = ["--sizes", "tiny", "--test-seconds", "0", "--out", str(out), "--at-most", "1e-3"]
    command = [sys.executable, "-m", "benchmarks.gpu", *options]
    said = subprocess.run(command, cwd=gpu.ROOT, stdout=subprocess.PIPE, text=True, check=False)
    assert said.returncode == 1
    report = json.loads(said.stdout)
    assert report == json.loads(out.read_text("utf-8"))
    assert report["cases"] == []
    assert report["left_out"] == ["all after the last case: the time was over"]


@pytest.mark.slow
def test_every_case_runs(tmp_path):
    # In a process of its own, as at a user's: the session's strictness is not for it.
    out = tmp_path / "results" / "gpu.json"  # no clone has that folder
    options = ["--sizes", "tiny", "--rounds", "1", "--out", str(out)]
    tests = ["--test-seconds", "60", "--tests", "harmonics/test_indexing.py"]
    command = [sys.executable, "-m", "benchmarks.gpu", *options, *tests]
    said = subprocess.run(command, cwd=gpu.ROOT, stdout=subprocess.PIPE, text=True, check=True)
    report = json.loads(said.stdout)
    assert report == json.loads(out.read_text("utf-8"))
    assert report["left_out"] == []
    assert report["tests"]["passed"] > 0
    names = [(row["case"], row["precision"]) for row in report["cases"]]
    assert len(set(names)) == len(names) == 23
    assert all(row["finite"] and row["seconds"] > 0 for row in report["cases"])
