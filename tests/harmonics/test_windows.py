"""Windows, fixed and found."""

import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
import oracles
import pytest

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


@pytest.mark.parametrize("kind", ["none", "hann", "lanczos", "zonal-sinc"])
def test_windows_keep_the_mean_and_their_shape(kind):
    assert harmonics.window(kind, 0).tolist() == [1.0]
    window = harmonics.window(kind, 7)
    assert (window.shape, window.dtype, window[0]) == ((64,), jnp.float64, 1.0)
    assert ((window > 0) & (window <= 1)).all()


def test_an_unknown_window_is_named(unchecked):
    message = "kind of window must be one of none, hann, lanczos, zonal-sinc, got 'hamming'"
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


@functools.cache
def fine_basis(degree):
    """Half a degree apart near the equator: the minimum on it is the minimum to 1e-4."""
    theta, phi = (np.arange(180) + 0.5) / 180 * np.pi, np.arange(360) / 180 * np.pi
    l, m = harmonics.degrees(degree), harmonics.orders(degree)
    meridian = oracles.scipy_basis(
        np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=-1), degree
    )
    turned = meridian[:, l * (l + 1) + np.abs(m)]
    around = np.where(m < 0, np.sin(np.outer(phi, -m)), np.cos(np.outer(phi, m)))
    return (turned[:, None] * around).reshape(-1, len(m))


def darkest(c):
    """Lowest values of (..., K) functions, in units of their means."""
    c = np.asarray(c, np.float64)
    lowest = (c @ fine_basis(harmonics.degree_of(c.shape[-1])).T).min(axis=-1)
    return lowest / (c[..., 0] / np.sqrt(4 * np.pi))


def slow_strength(c):
    """Bisection on a fine grid."""
    degree = harmonics.degree_of(len(c))
    l = harmonics.degrees(degree)
    if darkest(c) >= 0:
        return 0.0
    low, high = 0.0, 1e9
    for _ in range(60):
        middle = math.sqrt(max(low, 1e-12) * high)
        low, high = (
            (middle, high)
            if darkest(c / (1 + middle * l**2 * (l + 1.0) ** 2)) < 0
            else (low, middle)
        )
    return high


dering_of_light = functools.partial(harmonics.dering, of="light")
compiled = functools.partial(jax.jit, static_argnames="of")(harmonics.dering)


def dering(c, of="light"):
    """To NumPy, so that nothing but one program per shape is compiled."""
    return tuple(np.asarray(a) for a in compiled(c, of=of))


def lights(rng, degree, count=8):
    """Impulses, pairs of them, and noise over a mean: three times `count`."""

    def impulse():
        return oracles.scipy_basis(oracles.unit_vectors(rng, count), degree)

    noise = rng.normal(size=(count, (degree + 1) ** 2))
    noise[:, 0] = np.abs(noise[:, 0]) + 0.5
    return np.concatenate([impulse(), impulse() + 10 * impulse(), noise])


@pytest.mark.parametrize(
    ("degree", "dtype"),
    [
        (3, "float64"),
        (6, "float32"),
        pytest.param(10, "float64", marks=pytest.mark.slow),
    ],
)
def test_dering_leaves_nothing_negative(degree, dtype, rng):
    """Between the directions that it looks at, at most a thousandth of the mean."""
    c = lights(rng, degree).astype(dtype)
    clean, strength = dering(c)
    assert clean.dtype == strength.dtype == dtype
    assert (strength.shape, clean.shape) == ((24,), c.shape)
    np.testing.assert_array_equal(clean[:, 0], c[:, 0])
    assert darkest(clean).min() >= -1e-3
    l = harmonics.degrees(degree)
    window = 1 / (1 + np.asarray(strength, np.float64)[:, None] * l**2 * (l + 1.0) ** 2)
    np.testing.assert_allclose(clean, c * window, 1e-5 if dtype == "float32" else 1e-14)


def test_dering_finds_the_darker_of_two_directions():
    """All in the top band, so that the window does not change which is the darker."""
    degree = 6
    top = harmonics.degrees(degree) == degree
    c = np.stack([np.random.default_rng(seed).normal(size=49) * top for seed in range(40, 64)])
    c[:, 0] = 1
    clean, _ = dering(c.astype(np.float32))
    assert darkest(clean).min() >= -1e-3  # -1.07e-2 at seed 50, -4.5e-3 at another


def test_dering_finds_the_least_strength(rng):
    c = lights(rng, 3)
    _, strength = dering(c)
    expected = [slow_strength(one) for one in c[::4]]
    np.testing.assert_allclose(strength[::4], expected, 2e-2)
    smaller = c * np.asarray(harmonics.damping(0.97 * strength, 3))
    assert (darkest(smaller)[strength > 0] < 0).all()


def test_dering_of_a_zonal_function_by_hand():
    """1 + b cos θ is positive once 4 strength = b - 1 or more; the grid need not hold the pole."""
    c = np.zeros(4)
    c[0], c[2] = np.sqrt(4 * np.pi), 3.0 * np.sqrt(4 * np.pi / 3)
    clean, strength = dering_of_light(c)
    assert strength == pytest.approx(0.5, rel=1e-2)
    assert clean[2] == pytest.approx(np.sqrt(4 * np.pi / 3), rel=1e-2)


def irradiance_of(c):
    return np.asarray(
        harmonics.convolve(c, harmonics.clamped_cosine(harmonics.degree_of(c.shape[-1])))
    )


@pytest.mark.parametrize("dtype", ["float64", pytest.param("float32", marks=pytest.mark.slow)])
def test_dering_of_irradiance_is_enough_for_a_surface(dtype, rng):
    """And no more than enough; the light itself may stay negative."""
    c = lights(rng, 3).astype(dtype)
    c[8:16] -= 0.5 * np.eye(16)[0].astype(dtype)  # darker, so that irradiance is negative too
    clean, strength = dering(c, "irradiance")
    assert clean.dtype == strength.dtype == dtype
    assert darkest(irradiance_of(clean)).min() >= -1e-3
    assert (darkest(clean)[strength < np.inf] < -0.01).any()
    some = np.flatnonzero((strength > 0) & (strength < np.inf))
    assert len(some) >= 8
    less = c[some] * np.asarray(harmonics.damping(0.97 * strength[some], 3))
    assert (darkest(irradiance_of(less)) < 0).all()
    error = 2e-2 if dtype == "float64" else 3e-2
    for i in some[::4]:
        assert strength[i] == pytest.approx(slow_strength(irradiance_of(c[i])), rel=error)
    np.testing.assert_allclose(clean, c * np.asarray(harmonics.damping(strength, 3)), 1e-5)


def test_dering_of_irradiance_by_hand():
    """The default. 1 + b cos θ gives π (1 + 2b/3 cos θ): 4 strength = 2b/3 - 1. Odd bands above 1
    give none."""
    c = np.zeros((24, 16))
    c[:, 0] = np.sqrt(4 * np.pi)
    c[0, 2] = 3.0 * np.sqrt(4 * np.pi / 3)
    c[1, 9:] = 5.0
    clean, strength = jax.jit(harmonics.dering)(c)
    np.testing.assert_allclose(strength[:2], [0.25, 0], 1e-2)
    assert clean[0, 2] == pytest.approx(1.5 * np.sqrt(4 * np.pi / 3), rel=1e-2)
    np.testing.assert_array_equal(clean[1], c[1])


def test_dering_of_irradiance_derivatives(rng):
    """Through the convolution, forward and reverse."""
    (source,) = oracles.unit_vectors(rng, 1)
    c = np.asarray(harmonics.evaluate(source, 3)) + 0.05 * rng.normal(size=16)
    c[0] /= 3
    tangents = rng.normal(size=(24, 16))
    around = {t: dering(c + t * tangents, "irradiance")[1] for t in (-2e-5, -1e-5, 1e-5, 2e-5)}
    expected = oracles.slope(around.__getitem__, 1e-5)
    gradient = jax.jit(jax.grad(lambda c: harmonics.dering(c)[1]))(c)
    assert np.abs(expected).max() > 0.01
    np.testing.assert_allclose(tangents @ np.asarray(gradient), expected, 1e-4, 1e-8)


def test_dering_of_what_is_one_of_two(unchecked):
    with pytest.raises(ValueError, match="of must be one of irradiance, light, got 'shadow'"):
        harmonics.dering(np.ones(4), of="shadow")


def test_dering_leaves_the_rest_alone(rng):
    positive = harmonics.convolve(
        harmonics.evaluate(np.array([0.6, 0.0, 0.8]), 3), harmonics.phong(2.0, 3)
    )
    c = lights(rng, 3)
    c[0], c[1], c[2] = positive, 2.0 * np.eye(16)[0], 0.0
    c[0, 0] *= 3
    clean, strength = dering(c)
    assert strength[:3].tolist() == [0, 0, 0]
    np.testing.assert_array_equal(clean[:3], c[:3])
    assert (strength[3:] > 0).any()
    constant, strength = dering_of_light(np.array([[2.0], [0.0], [-1.0]]))
    assert constant.tolist() == [[2.0], [0.0], [-1.0]]
    assert strength.tolist() == [0, 0, np.inf]


@jax.jit
def slopes(c, tangent, pull, pull_strength):
    """Forward, and reverse, as `jax.vjp` has it: one search for both."""
    _, forward = jax.linearize(dering_of_light, c)
    (reverse,) = jax.linear_transpose(forward, c)((pull, pull_strength))
    return forward(tangent), reverse


@pytest.mark.parametrize("mean", [-1.0, 0.0])
def test_dering_cannot_help_a_mean_that_is_not_positive(mean, rng):
    c, pull = rng.normal(size=(2, 24, 16))
    c[:, 0] = mean
    clean, strength = dering(c)
    assert (strength == np.inf).all()
    np.testing.assert_array_equal(clean, c * (np.arange(16) == 0))
    (slope, slope_strength), reverse = slopes(c[0], pull[0], pull[0], 0.0)
    np.testing.assert_array_equal(reverse, pull[0] * (np.arange(16) == 0))
    np.testing.assert_array_equal(slope, pull[0] * (np.arange(16) == 0))
    assert np.isfinite(slope_strength)


@pytest.mark.parametrize("scale", [1e-20, 1e20])
def test_dering_does_not_depend_on_the_unit(scale, rng):
    c = lights(rng, 6).astype(np.float32)
    _, strength = dering(c)
    np.testing.assert_allclose(dering(c * np.float32(scale))[1], strength, 1e-4)


def test_dering_commutes_with_rotation(rng):
    """But for the grid: the strength moves by less than a hundredth."""
    c, r = lights(rng, 3), oracles.rotations(rng, 24)
    clean, strength = dering(c)
    turned, strength_turned = dering(harmonics.rotate(c, r))
    np.testing.assert_allclose(strength_turned, strength, 1e-2)
    scale = np.linalg.norm(c, axis=-1, keepdims=True)
    difference = (turned - np.asarray(harmonics.rotate(clean, r))) / scale
    np.testing.assert_allclose(difference, 0, 0, 4e-3)


def test_dering_derivatives(rng):
    """Away from its kinks, forward and reverse, by the implicit function theorem."""
    (source,) = oracles.unit_vectors(rng, 1)
    c = np.asarray(harmonics.evaluate(source, 3)) + 0.05 * rng.normal(size=16)
    pull = rng.normal(size=16)
    tangents = np.stack([c, *rng.normal(size=(23, 16))])
    around = {t: dering(c + t * tangents) for t in (-2e-5, -1e-5, 1e-5, 2e-5)}
    slopes_clean, slopes_strength = (
        oracles.slope(lambda t, i=i: around[t][i], 1e-5) for i in range(2)
    )
    _, of_strength = slopes(c, c, 0 * pull, 1.0)
    assert np.abs(of_strength).max() > 0.1
    for tangent, slope_clean, slope in zip(
        tangents[:4], slopes_clean[:4], slopes_strength[:4], strict=True
    ):
        (d_clean, d_strength), of_clean = slopes(c, tangent, pull, 0.0)
        np.testing.assert_allclose(d_strength, slope, 1e-4, 1e-9)  # 4e-6
        np.testing.assert_allclose(of_strength @ tangent, d_strength, 1e-10, 1e-12)
        np.testing.assert_allclose(d_clean, slope_clean, 0, 1e-4)  # 2e-5
        np.testing.assert_allclose(of_clean @ tangent, pull @ d_clean, 1e-10, 1e-12)


@pytest.mark.parametrize(
    ("inner", "outer"),
    [
        (jax.jacfwd, jax.jacrev),
        (jax.jacrev, jax.jacfwd),
        pytest.param(jax.jacfwd, jax.jacfwd, marks=pytest.mark.slow),
        pytest.param(jax.jacrev, jax.jacrev, marks=pytest.mark.slow),
    ],
)
def test_dering_refuses_second_derivatives(inner, outer):
    """Rather than a wrong one: the darkest direction moves, which a first derivative ignores."""
    c = np.asarray(harmonics.evaluate(np.array([0.0, 0.6, 0.8]), 1))
    with pytest.raises(NotImplementedError, match="first derivatives only"):
        jax.eval_shape(outer(inner(lambda c: dering_of_light(c)[1])), c)


def test_dering_batches_jit_and_vmap(rng):
    c = lights(rng, 1).reshape(8, 3, 4)
    clean, strength = map(np.asarray, dering_of_light(c))
    assert darkest(clean).min() >= -1e-3
    assert (clean.shape, strength.shape) == ((8, 3, 4), (8, 3))
    again, strength_again = jax.jit(jax.vmap(dering_of_light))(c)
    np.testing.assert_allclose(again, clean, 0, 1e-13)
    np.testing.assert_allclose(strength_again, strength, 1e-12)
    one, strength_one = dering_of_light(c[2, 1])
    np.testing.assert_allclose(one, clean[2, 1], 0, 1e-13)
    np.testing.assert_allclose(strength_one, strength[2, 1], 1e-12)
    assert dering_of_light(np.zeros((0, 9)))[0].shape == (0, 9)


def test_dering_refuses_what_is_no_function(unchecked):
    for bad, shape in ((np.ones(8), r"\(8,\)"), (1.0, r"\(\)")):
        with pytest.raises(ValueError, match=rf"1, 4, 9, 16.*got shape {shape}"):
            dering_of_light(bad)


def test_dering_of_nan_is_nan():
    assert np.isnan(dering(np.full((24, 16), np.nan))[1]).all()


def test_damping_refuses_a_negative_strength():
    with pytest.raises(ValueError, match=r"at least 0, got -0\.25"):
        harmonics.damping(-0.25, 1)
