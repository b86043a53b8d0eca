"""Light recovered from shading, beside dense linear algebra on matrices made by quadrature."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.optimize
import scipy.stats

from jaxsh import harmonics, inverse, sphere, transfer
from jaxsh.inverse import _light_solve

# Variances of bands 1 to 3, and the level of noise, of most of the tests: one program for them.
PRIOR, NOISE = np.array([0.3, 0.15, 0.1]), 0.01
COUNT = 48


def cap(rng, count=COUNT):
    """Normals that face one side, as from one view."""
    normals = rng.normal(size=(count, 3))
    normals[:, 0] = np.abs(normals[:, 0])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def matrix(normals, degree):
    """∫ max(0, n·ω) y_i(ω) dω / π by a quadrature fine enough for the edge at the horizon."""
    quadrature = sphere.gauss_legendre(400)
    basis = np.asarray(harmonics.evaluate(quadrature.directions, degree))
    cosine = np.maximum(normals @ np.asarray(quadrature.directions).T, 0)
    return (cosine * np.asarray(quadrature.weights)) @ basis / np.pi


def some_light(rng, degree):
    light = rng.normal(size=(3, (degree + 1) ** 2)) * 0.4
    return light / (1 + np.asarray(harmonics.degrees(degree))) + 3 * np.eye(light.shape[1])[0]


@pytest.fixture
def seen(rng):
    """Normals, albedo of three channels and weights of a few pixels, light and what was observed.

    One pixel has weight 0 and no number.
    """
    normals = cap(rng)
    albedo = rng.uniform(0.2, 0.9, (COUNT, 3))
    weights = rng.uniform(0.5, 2.0, COUNT)
    weights[5] = 0
    light = some_light(rng, 3)
    observed = albedo * (matrix(normals, 3) @ light.T)
    observed += NOISE / np.where(weights > 0, weights, 1)[:, None] * rng.normal(size=(COUNT, 3))
    observed[5] = np.nan
    return normals, albedo, weights, light, observed


@functools.cache
def fits(noise):
    """The fit of most tests, compiled once for each way of knowing the noise."""

    def fit(observed, normals, albedo, weights):
        return inverse.fit_light(
            observed, normals, albedo, 2, weights=weights, prior=PRIOR, noise=noise, throw=False
        )

    return jax.jit(fit)


def dense(normals, albedo, weights, observed, noise):
    """Posterior of all bands by normal equations; the mean that the prior is relative to found by
    repetition."""
    variances = np.concatenate([[np.inf], PRIOR])[np.asarray(harmonics.degrees(3))]
    seen = weights > 0
    light, spread = np.zeros((3, 16)), np.zeros((3, 16, 16))
    for c in range(3):
        a = (weights * albedo[:, c])[seen, None] * matrix(normals, 3)[seen] / noise
        b = (weights[seen] * observed[seen, c]) / noise
        mean = 1.0
        for _ in range(60):
            spread[c] = np.linalg.inv(a.T @ a + np.diag(1 / (variances * mean**2)))
            light[c] = spread[c] @ a.T @ b
            mean = light[c, 0]
    return light, spread


def test_posterior(seen):
    normals, albedo, weights, light, observed = seen
    found = fits(None)(observed, normals, albedo, weights)
    noise = float(found.noise)
    expected, spread = dense(normals, albedo, weights, observed, noise)
    np.testing.assert_allclose(found.value, expected[:, :9], rtol=0, atol=2e-4)
    deviation = np.sqrt(np.diagonal(spread, axis1=1, axis2=2))[:, :9]
    np.testing.assert_allclose(found.confidence.deviation, deviation, rtol=2e-3)
    block = found.confidence.covariance[9:18, 9:18]
    np.testing.assert_allclose(block, spread[1, :9, :9], rtol=0, atol=1e-5)
    assert not np.any(found.confidence.covariance[9:18, :9])
    variances = PRIOR[np.asarray(harmonics.degrees(2))[1:] - 1] * expected[:, :1] ** 2
    np.testing.assert_allclose(
        found.determined[:, 1:], 1 - deviation[:, 1:] ** 2 / variances, rtol=1e-3
    )
    assert np.all(found.determined[:, 0] == 1)
    error = np.abs(found.value - light[:, :9]) / deviation
    assert np.sqrt(np.mean(np.square(error))) == pytest.approx(1, abs=0.4)


@pytest.mark.parametrize("pixels", [slice(0, COUNT), slice(8, 16)])
def test_noise_is_the_most_probable(pixels, seen):
    """The level of noise is the peak of SciPy's density, the mean's prior wide instead of flat.

    Eight pixels are fewer than the nine unknowns.
    """
    normals, albedo, weights, _, observed = seen
    weights[np.delete(np.arange(COUNT), pixels)] = 0
    found = fits(None)(observed, normals, albedo, weights)
    rows = weights > 0
    operator = matrix(normals, 3)[rows]
    light, _ = dense(normals, albedo, weights, observed, float(found.noise))
    variances = np.concatenate([[1e3], PRIOR])[np.asarray(harmonics.degrees(3))]

    def improbability(log):
        total = 0.0
        for c in range(3):
            a = (weights * albedo[:, c])[rows, None] * operator
            covariance = a * (variances * light[c, 0] ** 2) @ a.T
            covariance += np.exp(2 * log) * np.eye(len(a))
            b = weights[rows] * observed[rows, c]
            total -= scipy.stats.multivariate_normal.logpdf(b, cov=covariance)
        return total

    best = scipy.optimize.minimize_scalar(improbability, bounds=(-7, -2), method="bounded")
    assert np.log(float(found.noise)) == pytest.approx(best.x, abs=0.02)
    assert float(found.noise) == pytest.approx(
        NOISE, rel=0.25 if len(weights[pixels]) == COUNT else 1
    )
    assert 0 < found.statistics.residual < 0.02


@pytest.mark.slow
def test_derivatives_in_the_data(seen):
    """By finite differences, the mean light that the prior follows included."""
    normals, albedo, weights, _, observed = seen
    observed[5] = 0
    fit = fits(NOISE)
    towards = [np.random.default_rng(i).normal(size=x.shape) for i, x in enumerate(seen[:3])]
    towards = [np.random.default_rng(9).normal(size=observed.shape), *towards]
    data = [jnp.asarray(x) for x in (observed, normals, albedo, weights)]
    towards[3][5] = 0
    _, slope = jax.jvp(lambda *d: fit(*d).value, data, [jnp.asarray(t) for t in towards])
    step = 1e-5
    ahead, back = (
        fit(*(x + s * t for x, t in zip(data, towards, strict=True))).value for s in (step, -step)
    )
    np.testing.assert_allclose(slope, (ahead - back) / (2 * step), rtol=1e-5, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("degree", [2, 3])
def test_plain_least_squares_tells_what_is_unseen(degree, rng):
    """NumPy's least squares; of degree 3 normals see nothing."""
    normals = cap(rng)
    observed = rng.uniform(0.1, 1, (COUNT, 3))
    found = inverse.fit_light(observed, normals, 0.5, degree, prior=None, window="hann")
    a = 0.5 * matrix(normals, 2)
    expected, squared, *_ = np.linalg.lstsq(a, observed)
    window = np.asarray(harmonics.window("hann", degree))
    np.testing.assert_allclose(found.value[:, :9], expected.T * window[:9], rtol=0, atol=2e-3)
    variance = squared.sum() / (3 * (COUNT - 9))
    deviation = np.sqrt(variance * np.diagonal(np.linalg.inv(a.T @ a))) * window[:9]
    np.testing.assert_allclose(found.confidence.deviation[0, :9], deviation, rtol=2e-3)
    assert np.all(found.determined[:, :9] == 1)
    assert np.all(found.value[:, 9:] == 0)
    assert np.all(found.confidence.deviation[:, 9:] == np.inf)
    assert np.all(found.determined[:, 9:] == 0)


@pytest.mark.slow
def test_as_many_unknowns_as_pixels_do_not_tell_the_noise(rng):
    """Rank is what counts: of a transfer without shadows bands 3 are zero."""
    normals = cap(rng, 12)
    observed = 0.5 * matrix(normals, 3) @ some_light(rng, 3).T + 0.01 * rng.normal(size=(12, 3))
    made = transfer.unshadowed(normals, normals, 3)
    weights = np.ones(12)
    fit = jax.jit(lambda w: inverse.fit_light(observed, made, 0.5, 2, weights=w, prior=None))
    _, squared, *_ = np.linalg.lstsq(0.5 * matrix(normals, 2), observed)
    assert float(fit(weights).noise) == pytest.approx(np.sqrt(squared.sum() / 9), rel=1e-2)
    weights[9:] = 0
    found = fit(weights)
    assert found.noise == np.inf
    assert np.all(found.confidence.deviation == np.inf)
    assert not np.any(np.isnan(found.confidence.covariance))


@pytest.mark.slow
def test_channel_that_reflects_nothing(seen):
    """Nothing is known of its light, nor of bands that normals do not tell."""
    normals, albedo, weights, _, observed = seen
    albedo[:, 1] = 0
    albedo[5] = np.nan  # has no weight
    found = inverse.fit_light(observed, normals, albedo, 3, weights=weights, prior=PRIOR)
    assert np.all(found.value[1] == 0)
    assert np.all(found.determined[1] == 0)
    assert np.all(found.confidence.deviation[1] == np.inf)
    assert np.all(found.confidence.deviation[::2, 9:] > 0.5)


@pytest.mark.slow
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_picture_is_as_good_as_vertices(dtype, rng):
    """A picture with a mask, and vertices by the transfer of the same normals, made in blocks."""
    normals = cap(rng, 60)
    made = transfer.unshadowed(jnp.zeros((60, 3), dtype), jnp.asarray(normals, dtype), 4)
    light = jnp.asarray(some_light(rng, 4), dtype)
    observed = np.array(transfer.shade_diffuse(light, made, dtype(0.5)))
    observed += 0.01 * rng.normal(size=observed.shape).astype(dtype)
    prior = np.array([0.3, 0.2, 0.1, 0.1])
    expected = inverse.fit_light(observed, made, 0.5, 2, prior=prior)
    assert expected.value.dtype == dtype

    mask = np.zeros((8, 10), bool)
    mask.flat[rng.choice(80, 60, replace=False)] = True
    picture, around = np.full((8, 10, 3), np.nan, dtype), np.zeros((8, 10, 3), dtype)
    picture[mask], around[mask] = observed, normals
    found = inverse.fit_light(picture, around, 0.5, 2, mask=mask, prior=prior)
    tolerance = {np.float32: 2e-3, np.float64: 1e-9}[dtype]
    np.testing.assert_allclose(found.value, expected.value, rtol=0, atol=tolerance)
    np.testing.assert_allclose(found.noise, expected.noise, rtol=tolerance)


@pytest.mark.slow
@pytest.mark.parametrize("channels", [1, 3])
def test_blocks(channels, monkeypatch, rng):
    normals, albedo = cap(rng), rng.uniform(0.2, 0.9, (COUNT, channels))
    observed, weights = rng.uniform(0.1, 1, (COUNT, 3)), rng.uniform(0.5, 2, COUNT)
    make = functools.partial(harmonics.evaluate, degree=2)
    data = [jnp.asarray(x) for x in (observed, normals, albedo, weights)]
    whole = _light_solve.compress_rows(*data, make)
    monkeypatch.setattr(_light_solve, "_BLOCK", 10)
    parts = _light_solve.compress_rows(*data, make)
    light = jnp.asarray(rng.normal(size=(3, 9)))
    np.testing.assert_allclose(
        jnp.linalg.norm(parts.residual(light)), jnp.linalg.norm(whole.residual(light)), rtol=1e-13
    )
    assert np.allclose(np.tril(parts.operator[0], -1), 0, rtol=0, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(("loss", "dtype"), [("huber", np.float64), ("cauchy", np.float32)])
def test_outliers_count_less(loss, dtype, rng):
    normals = cap(rng, 400)
    light = some_light(rng, 2)
    observed = 0.5 * matrix(normals, 2) @ light.T + 0.005 * rng.normal(size=(400, 3))
    fit = functools.partial(
        inverse.fit_light, surface=normals.astype(dtype), albedo=0.5, degree=2, prior=PRIOR
    )
    clean = fit(observed)
    observed[:40] += 1.0  # highlights
    found = {kind: fit(observed, loss=kind) for kind in ("squares", loss)}
    assert found[loss].value.dtype == dtype
    errors = {kind: np.linalg.norm(np.asarray(one.value) - light) for kind, one in found.items()}
    # The median of 400 of which a tenth are large is that of Gaussian errors' quantile 0.56.
    assert float(found[loss].noise) == pytest.approx(0.005, rel=0.15)
    best = np.linalg.norm(np.asarray(clean.value) - light)
    assert errors["squares"] > 0.3
    assert errors[loss] < {"huber": 2.5, "cauchy": 1.3}[loss] * best + 0.01
    with pytest.raises(RuntimeError, match=r"light was not found in 1 steps .* maximum"):
        fit(observed, loss=loss, max_steps=1)


@pytest.mark.slow
def test_deviations_are_true_of_light_like_the_prior(rng):
    """Lights drawn from the prior, from one view: errors over deviations are of size 1."""
    normals = jnp.asarray(cap(rng, 500))
    prior = np.asarray(inverse.light_variances(6))
    variances = np.concatenate([[0], prior])[harmonics.degrees(6)]
    fit = jax.jit(lambda observed: inverse.fit_light(observed, normals, 0.5, 2, prior=prior))
    ratios = []
    for _ in range(40):
        light = jnp.asarray(3 * np.sqrt(variances) * rng.normal(size=(3, 49))).at[:, 0].set(3)
        observed = 0.5 / np.pi * sphere.irradiance(light, normals)
        found = fit(observed + 0.02 * rng.normal(size=observed.shape))
        ratios.append((found.value - light[:, :9]) / found.confidence.deviation)
    assert np.sqrt(np.mean(np.square(ratios))) == pytest.approx(1, abs=0.1)


def test_errors(rng, unchecked):
    normals = cap(rng)
    observed = np.ones((COUNT, 3))
    made = transfer.Transfer(np.ones((COUNT, 4)), normals, normals, np.zeros((COUNT, 1), int))
    for arguments, options, sentence in [
        ((observed, made, 0.5, 2), {}, "degree 2 needs a transfer of that degree, got degree 1"),
        ((observed, normals, 0.5, 2), {"prior": "probe"}, "did you mean 'probes'"),
        ((observed, normals, 0.5, 2), {"prior": np.ones(1)}, "2 to 12 bands, got shape \\(1,\\)"),
        ((observed, normals, 0.5, 2), {"prior": np.zeros(3)}, "finite and > 0, got 0"),
        ((observed, normals, 0.5, 2), {"noise": 0.0}, "noise must be a number > 0"),
        ((observed[:-1], normals, 0.5, 2), {}, r"expected observed \(48, 3\)"),
        ((observed[None], normals[None], np.ones((1, COUNT)), 2), {}, r"\(1, 48, 1\) or"),
        ((0 * observed, normals, 0.5, 2), {}, "no light to recover"),
        ((np.nan * observed, normals, 0.5, 2), {}, "give them weight 0"),
    ]:
        with pytest.raises(ValueError, match=sentence):
            inverse.fit_light(*arguments, **options)


def test_other_forms_of_a_transfer_are_refused_with_what_to_give(unchecked):
    points = sphere.fibonacci(9).directions
    eight_bits = transfer.quantize(transfer.unshadowed(points, points, 1))
    stored = object.__new__(transfer.StoredTransfer)  # only its class is looked at
    for form, sentence in [
        (stored, r"got a StoredTransfer: give its \.load\(\)"),
        (eight_bits, "got a QuantizedTransfer: give the Transfer that it was made of"),
    ]:
        with pytest.raises(TypeError, match=sentence):
            inverse.fit_light(np.ones((9, 3)), form, 0.5, 1)
