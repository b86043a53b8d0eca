"""The experiments `habel2008.*` and `inverse.sky` end to end on the embedded data, small."""

import functools

import jax.numpy as jnp
import numpy as np
import pytest
import runs
from pictures import assert_picture

from experiments.habel2008.figure1_5 import sun_at_hour
from experiments.habel2008.figure4 import measures
from experiments.habel2008.spheres import sun_at
from experiments.shared.lights import windowed
from jaxsh import sky


@pytest.fixture
def run(tmp_path):
    return functools.partial(runs.run, tmp_path)


@pytest.mark.slow
def test_day(run):
    options = ["--frames", "3", "--sheet", "3", "--height", "32", "--samples", "1"]
    folder, rows = run(
        "habel2008.figure1_5", *options, "--directions", "16", "--bands", "3", small=True
    )
    morning, noon, evening = rows
    assert morning["elevation"] == pytest.approx(evening["elevation"])
    assert morning["sun"] < 0.05 * noon["sun"]
    assert 20 < noon["sunlit"] < 100
    assert (folder / "day.gif").read_bytes().startswith(b"GIF89a")
    assert_picture(folder / "day.png")


@pytest.mark.slow
def test_worst_case(run):
    options = ["--suns", "4", "--turbidities", "2", "--bands", "2", "7", "--samples", "16", "10"]
    folder, rows = run("habel2008.figure2", *options)
    at = {(row["model"][:11], row["bands"]): row for row in rows}
    assert at["the shipped", 7]["error"] < 0.006 < 0.1 < at["the paper's", 7]["error"] < 1
    assert at["the shipped", 7]["pixel"] < at["the shipped", 7]["truncation"] / 100
    assert_picture(folder / "figure2.png")


@pytest.mark.slow
def test_ringing(run):
    folder, rows = run("habel2008.figure4", "--zeniths", "60", "--shown", "0")
    at = {row["window"]: row for row in rows}
    # Weaker and weaker ringing, dearer and dearer.
    assert at["none"]["rms"] > at["zonal sinc (eq. 5)"]["rms"] > at["sinc"]["rms"]
    assert at["none"]["negative"] < at["zonal sinc (eq. 5)"]["negative"] < at["sinc"]["negative"]
    assert at["dering"]["negative"] > -1e-3
    assert abs(at["none"]["cost"]) < 0.1 < 0.5 < abs(at["sinc"]["cost"])
    assert at["none"]["nonzonal"] == pytest.approx(14.2, abs=1)  # against "only zonal terms ring"
    assert_picture(folder / "figure4.png")


def test_eq_5_leaves_the_other_orders_alone():
    light = sky.project_preetham(jnp.asarray(sun_at(60)), 3.0)
    zonal = [l * (l + 1) for l in range(7)]
    changed = np.flatnonzero(np.any(windowed(light, "zonal sinc (eq. 5)") != light, axis=0))
    assert set(changed) == set(zonal[1:])
    assert measures(light, light)["blur"] == 0


def test_suns_of_the_day():
    np.testing.assert_allclose(
        sun_at_hour(0, 50, 0), [0, -np.sin(np.radians(50)), np.cos(np.radians(50))]
    )
    np.testing.assert_allclose(
        sun_at_hour(-6, 50, 0), [1, 0, 0], rtol=0, atol=1e-15
    )  # rises in the east


@pytest.mark.slow
def test_inverse_sky(run):
    options = ["--noise", "0", "0.01", "--settings", "2", "--degree", "4", "--directions", "16"]
    folder, rows = run("inverse.sky", *options, "--height", "32")
    for row in rows:
        assert row["converged"]
        assert row["sun_error"] < 0.1
        assert row["turbidity_error"] < 0.02
    assert rows[0]["sun_deviation"] < rows[2]["sun_deviation"]
    for picture in ("errors.png", "recovered.png"):
        assert_picture(folder / picture)
