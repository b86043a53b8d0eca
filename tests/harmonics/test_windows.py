"""Windows, fixed and found."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import oracles
import pytest
import scipy.optimize

from jaxsh import harmonics


def test_windows_by_their_formulas():
    degree, bands = 5, 6
    for l in range(degree + 1):
        x = math.pi * l / bands
        sinc = math.sin(x) / x if l else 1.0
        for m in range(-l, l + 1):
            i = harmonics.index(l, m)
            expected = {
                "none": 1.0,
                "hann": (1 + math.cos(x)) / 2,
                "lanczos": sinc,
                "zonal-sinc": sinc if m == 0 else 1.0,
            }
            for kind, value in expected.items():
                assert harmonics.window(kind, degree)[i] == pytest.approx(value, abs=1e-15)


@pytest.mark.parametrize("kind", ["none", "hann", "lanczos", "zonal-sinc", "positive"])
def test_windows_keep_the_mean_and_their_shape(kind):
    assert harmonics.window(kind, 0).tolist() == [1.0]
    window = harmonics.window(kind, 7)
    assert (window.shape, window.dtype, window[0]) == ((64,), jnp.float64, 1.0)
    assert ((window > 0) & (window <= 1)).all()


@pytest.mark.parametrize("degree", [1, 2, 5, 10, 40])
def test_the_kernel_of_the_positive_window_is_nowhere_negative(degree):
    window = positive(degree)
    z = np.cos(np.linspace(0, np.pi, 20011))
    bands = 2 * np.arange(degree + 1) + 1
    kernel = np.polynomial.legendre.legval(z, bands * window)
    assert -5e-5 < kernel.min() < 2e-2  # of its mean; -3.3e-5 at degree 40
    assert (np.diff(window) < 0).all()


@pytest.mark.parametrize("degree", [2, 3, 10])
def test_the_positive_window_is_the_nearest_to_none(degree, rng):
    """A point of a convex set is its nearest where no way into the set leads any nearer."""
    window, bands = positive(degree), 2 * np.arange(degree + 1) + 1
    z, weights = np.polynomial.legendre.leggauss(degree + 1)
    values = np.polynomial.legendre.legvander(z, degree)
    half = degree // 2
    roots = values[:, : half + 1] @ rng.normal(size=(half + 1, 500))
    squares = roots**2 * ((1 + z) ** (degree % 2))[:, None]  # kernels that are not negative
    others = (values * weights[:, None]).T @ squares
    others /= others[0]
    power = bands / np.maximum(np.arange(degree + 1), 1) ** 2
    gain = (power * (1 - window)) @ (others - window[:, None])
    assert gain.max() < 1e-3 * (power * (1 - window) ** 2).sum()


def test_the_positive_window_by_hand():
    """Degree 1: 1 + 3 w z. Degree 2: a parabola that touches zero, found by its two equations."""
    np.testing.assert_allclose(positive(1), [1, 1 / 3], 0, 1e-12)
    w2 = scipy.optimize.minimize_scalar(
        lambda w2: 3 * (1 - touching(w2)) ** 2 + 5 / 4 * (1 - w2) ** 2, bounds=(0.2, 0.39)
    ).x
    np.testing.assert_allclose(positive(2), [1, touching(w2), w2], 0, 1.5e-3)


def touching(w2):
    """w_1 with which 1 + 3 w_1 z + 5 w_2 (3z² - 1)/2 has a double root."""
    return np.sqrt(4 * 7.5 * w2 * (1 - 2.5 * w2)) / 3


def positive(degree):
    return np.asarray(harmonics.window("positive", degree))[np.arange(degree + 1) ** 2]


def test_softening_goes_from_none_to_positive_to_the_mean():
    first = np.arange(5) ** 2
    strengths = np.array([[0.0, 0.5, 1.0], [1.5, 2.0, 1.0]], np.float32)
    windows = harmonics.softening(strengths, 4)
    assert (windows.shape, windows.dtype) == ((2, 3, 25), jnp.float32)
    w = positive(4)
    mean = np.eye(5)[0]
    expected = [[1 + 0 * w, (1 + w) / 2, w], [(w + mean) / 2, mean, w]]
    np.testing.assert_allclose(np.asarray(windows)[..., first], expected, 0, 1e-7)
    assert harmonics.softening(1.5, 0).tolist() == [1.0]


@pytest.mark.parametrize("mode", [jax.jacfwd, pytest.param(jax.jacrev, marks=pytest.mark.slow)])
def test_softening_slope(mode):
    def f(s):
        return harmonics.softening(s, 2)

    for at in (0.3, 1.4):
        expected = oracles.slope(lambda t, at=at: f(at + t), 1e-4)
        np.testing.assert_allclose(mode(f)(at), expected, 0, 1e-10)


def test_softening_refuses_a_strength_outside():
    for bad in (-0.25, 2.5, np.inf):
        with pytest.raises(ValueError, match=rf"from 0 to 2, got {bad:g}"):
            harmonics.softening(bad, 1)


def test_an_unknown_window_is_named(unchecked):
    message = (
        "kind of window must be one of none, hann, lanczos, zonal-sinc, positive, got 'hamming'"
    )
    with pytest.raises(ValueError, match=message):
        harmonics.window("hamming", 3)


def test_damping_formula_and_limits():
    l = harmonics.degrees(4)
    for strength in (0.0, 1e-3, 2.0):
        expected = 1 / (1 + strength * l**2 * (l + 1.0) ** 2)
        np.testing.assert_allclose(harmonics.damping(strength, 4), expected, 1e-15)
    assert harmonics.damping(np.inf, 4).tolist() == [1.0] + 24 * [0.0]
    batch = harmonics.damping(np.array([[0.0, 1.0, np.inf]], np.float32), 4)
    assert (batch.shape, batch.dtype) == ((1, 3, 25), jnp.float32)
    np.testing.assert_allclose(batch[0, 1], harmonics.damping(1.0, 4), 1e-6)


@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_damping_slope(mode):
    def f(s):
        return harmonics.damping(s, 3)

    expected = oracles.slope(lambda t: f(0.1 + t), 1e-4)
    np.testing.assert_allclose(mode(f)(0.1), expected, 0, 1e-8)
    squared = (harmonics.degrees(3) * (harmonics.degrees(3) + 1.0)) ** 2
    np.testing.assert_allclose(mode(f)(0.0), -squared, 1e-15)
    assert not mode(f)(np.inf).any()


def test_damping_refuses_a_negative_strength():
    with pytest.raises(ValueError, match=r"at least 0, got -0\.25"):
        harmonics.damping(-0.25, 1)
