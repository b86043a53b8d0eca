"""The least window that leaves nothing negative of what is needed."""

import functools

import jax
import numpy as np
import oracles
import pytest

from jaxsh import harmonics


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
    """In each direction of a fine grid the value goes straight from that of c, at 0, over that
    under the positive window, at 1, to the mean, at 2: the first strength that all have above 0."""
    c = np.asarray(c, np.float64)
    grid, degree = fine_basis(harmonics.degree_of(len(c))), harmonics.degree_of(len(c))
    zero, one = grid @ c, grid @ (c * np.asarray(harmonics.window("positive", degree)))
    mean = c[0] / np.sqrt(4 * np.pi)
    if zero.min() >= 0:
        return 0.0
    if mean <= 0:
        return 2.0
    slope = np.where(one == zero, 1, one - zero)
    low = np.where(zero < 0, -zero / slope, 0).max()
    high = np.where((zero >= 0) & (one < 0), -zero / slope, 1).min()
    if one[zero < 0].min() >= 0 and low <= high:
        return low
    return 1 + np.where(one < 0, -one / (mean - one), 0).max()


dering_of_light = functools.partial(harmonics.dering, of="light")
compiled = functools.partial(jax.jit, static_argnames=("of", "shared"))(harmonics.dering)


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
    window = np.asarray(harmonics.softening(np.asarray(strength, np.float64), degree))
    np.testing.assert_allclose(clean, c * window, 1e-5 if dtype == "float32" else 1e-12)


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
    smaller = c * np.asarray(harmonics.softening(0.97 * strength, 3))
    assert (darkest(smaller)[strength > 0] < 0).all()


def test_dering_of_a_zonal_function_by_hand():
    """1 + b cos θ is positive once the window is 1/b; the grid need not hold the pole."""
    w = float(harmonics.window("positive", 3)[1])
    c = np.zeros((24, 16))
    c[:, 0] = np.sqrt(4 * np.pi)
    c[:2, 2] = np.array([1.3, 4.5]) * np.sqrt(4 * np.pi / 3)
    clean, strength = dering(c)
    np.testing.assert_allclose(strength[:2], [(1 - 1 / 1.3) / (1 - w), 2 - 1 / (4.5 * w)], 1e-2)
    np.testing.assert_allclose(clean[:2, 2], np.sqrt(4 * np.pi / 3), 1e-2)


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
    assert (darkest(clean)[strength < 2] < -0.01).any()
    some = np.flatnonzero((strength > 0) & (strength < 2))
    assert len(some) >= 8
    less = c[some] * np.asarray(harmonics.softening(0.97 * strength[some], 3))
    assert (darkest(irradiance_of(less)) < 0).all()
    error = 2e-2 if dtype == "float64" else 3e-2
    for i in some[::4]:
        assert strength[i] == pytest.approx(slow_strength(irradiance_of(c[i])), rel=error)
    np.testing.assert_allclose(clean, c * np.asarray(harmonics.softening(strength, 3)), 1e-5)


def test_dering_of_irradiance_by_hand():
    """The default. 1 + b cos θ gives π (1 + 2b/3 cos θ). Odd bands above 1 give none."""
    c = np.zeros((24, 16))
    c[:, 0] = np.sqrt(4 * np.pi)
    c[0, 2] = 1.95 * np.sqrt(4 * np.pi / 3)
    c[1, 9:] = 5.0
    clean, strength = dering(c, "irradiance")
    blur = 1 - float(harmonics.window("positive", 3)[1])
    np.testing.assert_allclose(strength[:2], [(1 - 1 / 1.3) / blur, 0], 1e-2)
    assert clean[0, 2] == pytest.approx(1.5 * np.sqrt(4 * np.pi / 3), rel=1e-2)
    np.testing.assert_array_equal(clean[1], c[1])


@pytest.mark.slow
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
    np.testing.assert_allclose(tangents @ np.asarray(gradient), expected, 3e-4, 1e-8)


def glossy_of(c, exponent):
    degree = harmonics.degree_of(c.shape[-1])
    return np.asarray(harmonics.convolve(c, harmonics.phong(exponent, degree, normalized=True)))


@jax.jit
def dering_of_glossy(c, exponent):
    return harmonics.dering(c, of="glossy", exponent=exponent)


@pytest.mark.slow
def test_dering_of_glossy_light_by_exponent(rng):
    """Enough for the lobe and no more; the sharper the lobe, the more; the light itself most."""
    c = lights(rng, 3)[:16]
    clean, strength = map(np.asarray, dering_of_glossy(c, np.array([[2.0], [12.0], [100.0]])))
    assert (clean.shape, strength.shape) == ((3, 16, 16), (3, 16))
    np.testing.assert_allclose(clean, c * np.asarray(harmonics.softening(strength, 3)), 0, 1e-13)
    assert (np.diff(strength, axis=0) >= 0).all()
    assert (np.array([slow_strength(one) for one in c]) >= strength[-1] - 1e-3).all()
    for k, found in zip((2.0, 12.0, 100.0), strength, strict=True):
        expected = [slow_strength(glossy_of(one, k)) for one in c]
        np.testing.assert_allclose(found, expected, 0, 2e-3)


@pytest.mark.slow
def test_dering_of_glossy_light_derivatives():
    """In the exponent as in the light."""
    c = np.asarray(harmonics.evaluate(np.array([0.0, 0.6, 0.8]), 2))

    def strength(k, c=c):
        return dering_of_glossy(c, k)[1]

    expected = oracles.slope(lambda t: strength(np.asarray(12.0 + t)), 1e-3)
    assert expected > 1e-3
    by_exponent, by_light = jax.grad(strength, (0, 1))(12.0, c)
    assert by_exponent == pytest.approx(expected, rel=1e-3)
    # A brighter light needs no more of a window.
    assert by_light @ c == pytest.approx(0, abs=1e-10)


def test_dering_refuses_an_exponent_out_of_place(unchecked):
    with pytest.raises(ValueError, match='belongs to of="glossy", got none with of="glossy"'):
        harmonics.dering(np.ones(4), of="glossy")
    with pytest.raises(ValueError, match='belongs to of="glossy", got one with of="light"'):
        harmonics.dering(np.ones(4), of="light", exponent=3.0)
    with pytest.raises(ValueError, match=r"above -1, got -2"):
        harmonics.dering(np.ones(4), of="glossy", exponent=-2.0)
    with pytest.raises(ValueError, match=r"several functions \(..., C, K\), got shape \(4,\)"):
        harmonics.dering(np.ones(4), shared=True)


def test_dering_of_what_is_one_of_three(unchecked):
    with pytest.raises(ValueError, match="one of irradiance, light, glossy, got 'shadow'"):
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
    assert strength.tolist() == [0, 0, 2]


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
    assert (strength == 2).all()
    np.testing.assert_array_equal(clean, c * (np.arange(16) == 0))
    (slope, slope_strength), reverse = slopes(c[0], pull[0], pull[0], 0.0)
    np.testing.assert_array_equal(reverse, pull[0] * (np.arange(16) == 0))
    np.testing.assert_array_equal(slope, pull[0] * (np.arange(16) == 0))
    assert np.isfinite(slope_strength)


@pytest.mark.parametrize("scale", [1e-20, 1e20])
@pytest.mark.slow
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


def test_dering_batches_jit_vmap_and_one_window_for_all_channels(rng):
    c = lights(rng, 1).reshape(8, 3, 4)
    clean, strength = map(np.asarray, dering_of_light(c))
    assert darkest(clean).min() >= -1e-3
    assert (clean.shape, strength.shape) == ((8, 3, 4), (8, 3))
    again, strength_again = jax.jit(jax.vmap(dering_of_light))(c)
    np.testing.assert_allclose(again, clean, 0, 1e-13)
    np.testing.assert_allclose(strength_again, strength, 1e-12)
    clean, shared = compiled(c, of="light", shared=True)
    np.testing.assert_allclose(shared, strength.max(axis=1), 1e-12)
    window = np.asarray(harmonics.softening(shared, 1))[:, None]
    np.testing.assert_allclose(clean, c * window, 0, 1e-13)
    assert dering_of_light(np.zeros((0, 9)))[0].shape == (0, 9)


def test_dering_refuses_what_is_no_function(unchecked):
    for bad, shape in ((np.ones(8), r"\(8,\)"), (1.0, r"\(\)")):
        with pytest.raises(ValueError, match=rf"1, 4, 9, 16.*got shape {shape}"):
            dering_of_light(bad)


def test_dering_of_nan_is_nan():
    assert np.isnan(dering(np.full((24, 16), np.nan))[1]).all()
