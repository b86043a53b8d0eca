"""The experiment `ringing` end to end, small, and the peers that it compares with."""

import numpy as np
import pytest
from pictures import assert_picture
from runs import run

from experiments.ramamoorthi2001 import peers
from experiments.ramamoorthi2001.ringing_lights import Need, sunny
from jaxsh import harmonics, sphere


@pytest.mark.slow
def test_ringing(tmp_path):
    options = "--environments studio --degrees 4 --exponents 8 --directions 64 --vertices 40"
    folder, rows = run(tmp_path, "ringing", *options.split(), "--size", "48", small=True)
    at = {(row["need"], row["split"], row["window"]): row for row in rows if "shadows" not in row}
    ringing, clean = at["lobe 8", False, "none"], at["lobe 8", False, "dering"]
    assert clean["negative"] < 0.01 < 1 < ringing["negative"]
    assert clean["error"] < at["lobe 8", False, "Sloan 2008"]["error"]
    assert at["lobe 8", True, "none"]["error"] < 0.25 * ringing["error"]
    on_mesh = {
        (row["need"], row["split"], row["window"]): row
        for row in rows
        if row.get("shadows") == "yes"
    }
    light, split = on_mesh["irradiance", "no", "dering light"], on_mesh["irradiance", "yes", "none"]
    assert light["negative"] == 0
    assert split["error"] < on_mesh["irradiance", "no", "none"]["error"]
    for picture in ("mesh.png", "light.png"):
        assert_picture(folder / picture)


def lowest(functions, degree):
    directions = sphere.gauss_legendre(40).directions
    return (functions @ np.asarray(harmonics.evaluate(directions, degree)).T).min(axis=-1)


def test_the_bound_of_sloan_2017_is_conservative(rng):
    """Below the minimum, and the minimum itself of a zonal function about any axis."""
    functions = rng.normal(size=(12, 9))
    none = np.ones(9)
    bounds = np.array([peers.Bound(f, 2).least(none) for f in functions])
    apart = lowest(functions, 2) - bounds
    assert apart.min() > -1e-12
    assert apart.max() > 0.1
    zonal = harmonics.convolve(
        harmonics.evaluate(np.array([0.48, -0.6, 0.64]), 2), np.array([1.0, -0.7, 0.9])
    )
    zonal = np.asarray(zonal)
    assert peers.Bound(zonal, 2).least(none) == pytest.approx(lowest(zonal, 2), abs=5e-5)


def test_the_bound_of_sloan_2017_by_its_polynomial(rng):
    """At degree 2 and band 1 along z: a z² + b z + c - d |z| √(1 - z²), which the paper minimizes.

    Orders 1 and 2 are at least minus their amplitudes, d |z| √(1 - z²) and e (1 - z²).
    """
    f = rng.normal(size=9)
    f[[1, 3]] = 0
    y1, y2, y20 = np.sqrt([3 / (4 * np.pi), 15 / (4 * np.pi), 5 / (16 * np.pi)])
    d, e = y2 * np.hypot(f[5], f[7]), y2 / 2 * np.hypot(f[8], f[4])
    z = np.linspace(-1, 1, 200_001)
    zonal = f[0] / np.sqrt(4 * np.pi) + y1 * f[2] * z + y20 * f[6] * (3 * z**2 - 1)
    expected = (zonal - e * (1 - z**2) - d * np.abs(z) * np.sqrt(1 - z**2)).min()
    assert peers.Bound(f, 2).least(np.ones(9)) == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("find", [peers.sloan2008, peers.sloan2017])
def test_found_windows_are_enough_and_no_more(find):
    light = np.asarray(harmonics.evaluate(np.array([[0.0, 0.6, 0.8]] * 3), 2))
    light = light * np.array([[1.0], [0.5], [0.2]])
    left = lowest(light * find(light), 2) / light[:, 0]
    assert (left > -1e-3).all()
    assert (left < 1e-3).all()
    positive = np.eye(9)[:1] + 0.01 * np.eye(9)[3:4]
    np.testing.assert_array_equal(find(positive), 1)


def test_the_window_of_sloan_2017_by_its_formula():
    x = np.pi * np.array([1, 2, 3]) / 3.5
    expected = np.sin(x) ** 4 / x**4
    np.testing.assert_allclose(peers.sinc4(1 / 3.5, 3)[[1, 4, 9]], expected, 1e-12)
    assert peers.sinc4(0.5, 3)[[0, 4, 9]].tolist() == [1, 0, 0]


@pytest.mark.slow
def test_needs_and_a_sunny_picture():
    """The ground receives what it does on a clear day, in kilolux."""
    light = sphere.project_lat_long(sunny(64), 2)
    zenith = harmonics.evaluate(np.array([0, 0, 1], np.float32), 2)
    assert 30 < float((Need("irradiance", None).of(light) @ zenith).mean()) < 120
    lobe = Need("lobe 8", 8.0).of(light)
    np.testing.assert_allclose(lobe[:, 0], light[:, 0], 1e-6)
