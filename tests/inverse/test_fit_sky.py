"""Sun and turbidity recovered from the shaded vertices of a small mesh."""

import functools
import re

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import geometry, inverse, sky, transfer

ALBEDO = 0.5


@pytest.fixture(scope="module")
def baked():
    """Of 603 vertices, shadows included, in float64."""
    baked = transfer.bake(geometry.knot(600), 6, directions=256, progress=False)
    return eqx.tree_at(lambda t: t.coefficients, baked, baked.coefficients.astype(jnp.float64))


@pytest.fixture(scope="module")
def fit(baked):
    """The fit, compiled once for the module."""

    @jax.jit
    def run(observed, albedo):
        return inverse.fit_sky(observed, baked, albedo, throw=False)

    return lambda observed, albedo=ALBEDO: run(observed, jnp.asarray(albedo))


def glow(sun, turbidity):
    """A sky of degree 1 that is compiled faster than Preetham's."""
    return jnp.tile(jnp.concatenate([jnp.ones(1), turbidity * sun[jnp.array([1, 2, 0])]]), (3, 1))


def direction(elevation, azimuth):
    e, a = np.radians(elevation), np.radians(azimuth)
    return jnp.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def shaded(baked, sun, turbidity, exposure=1.0):
    return exposure * transfer.shade_diffuse(sky.preetham_harmonics(sun, turbidity), baked, ALBEDO)


def degrees_between(a, b):
    return float(np.degrees(2 * np.arcsin(np.linalg.norm(np.asarray(a) - np.asarray(b)) / 2)))


@pytest.mark.parametrize(
    ("elevation", "azimuth", "turbidity"),
    [(90, 0, 3.0), (89.9, 200, 5.5), (55, 10, 2.6), (30, 250, 4.0), (8, 100, 3.2), (0, 300, 5.0)],
)
def test_recovers_sun_and_turbidity(baked, fit, elevation, azimuth, turbidity):
    sun = direction(elevation, azimuth)
    found = fit(shaded(baked, sun, turbidity))
    assert found.converged, found.message
    assert degrees_between(found.value.sun, sun) < 1e-3  # asked for: 0.1 degrees
    assert abs(float(found.value.turbidity) - turbidity) < 1e-3  # asked for: 0.02
    assert found.value.exposure == 1
    assert found.statistics.residual < 1e-5
    # Of 24 starts. Close to the zenith most end on the kink that the model has there.
    assert found.statistics.agreeing >= (2 if elevation == 89.9 else 12)


@pytest.mark.slow
def test_noise_does_what_the_confidence_says(baked, fit, rng):
    """1 % of the mean: errors of twenty draws beside the deviations that each fit gives."""
    sun, turbidity = direction(40, 70), 4.0
    clean = np.asarray(shaded(baked, sun, turbidity))
    errors, said = [], []
    for _ in range(20):
        found = fit(clean + 0.01 * clean.mean() * rng.normal(size=clean.shape))
        assert found.converged
        errors.append([*(found.value.sun - sun), found.value.turbidity - turbidity])
        deviation = found.confidence.deviation
        said.append([*deviation.sun, deviation.turbidity])
    measured, said = np.sqrt(np.mean(np.square(errors), axis=0)), np.mean(said, axis=0)
    np.testing.assert_allclose(said, measured, rtol=0.5)  # of twenty draws, 16 % by itself
    assert np.degrees(np.linalg.norm(measured[:3])) < 0.1


@pytest.mark.parametrize("model", [glow, None])
@pytest.mark.slow
def test_the_solver_s_residual_is_that_of_shade_diffuse(model, baked, rng):
    """The few rows that the fit works on hold all V of them, with weights and colored albedo."""
    sun, exposure = direction(30, 20), 0.02
    albedo = jnp.asarray(rng.uniform(0.2, 0.9, (len(baked.coefficients), 3)))
    weights = jnp.asarray(rng.uniform(0.5, 2, len(albedo))).at[:50].set(0)
    harmonics = model or sky.preetham_harmonics
    lit = exposure * transfer.shade_diffuse(harmonics(sun, 3.0), baked, albedo)
    observed = lit * jnp.asarray(rng.normal(1, 0.02, lit.shape))
    observed = observed.at[:50].set(jnp.nan)
    found = inverse.fit_sky(observed, baked, albedo, sky=model, weights=weights, exposure=None)
    light = harmonics(found.value.sun, found.value.turbidity)
    again = found.value.exposure * transfer.shade_diffuse(light, baked, albedo)
    error, scale = (weights[:, None] * x for x in (observed - again, observed))
    relative = np.linalg.norm(error[50:]) / np.linalg.norm(scale[50:])
    assert float(found.statistics.residual) == pytest.approx(relative, rel=1e-9)

    deviation = found.confidence.deviation
    assert degrees_between(found.value.sun, sun) < 3 * np.degrees(np.linalg.norm(deviation.sun))
    assert abs(found.value.turbidity - 3) < 4 * deviation.turbidity < 0.2
    assert abs(found.value.exposure - exposure) < 4 * deviation.exposure < 0.2 * exposure
    covariance = np.asarray(found.confidence.covariance)  # x, y, z, turbidity, exposure
    np.testing.assert_allclose(
        covariance[:3, :3] @ np.asarray(found.value.sun), 0, rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(np.sqrt(covariance[3, 3]), deviation.turbidity)


def test_not_converged_is_said(baked):
    observed = shaded(baked, direction(40, 70), 4.0)
    with pytest.raises(
        RuntimeError, match=r"not found in 2 steps from 3 starts, residual .*maximum"
    ):
        inverse.fit_sky(observed, baked, ALBEDO, sky=glow, starts=3, max_steps=2)
    found = inverse.fit_sky(observed, baked, ALBEDO, sky=glow, starts=3, max_steps=2, throw=False)
    assert not found.converged
    assert "maximum number of steps" in found.message


def test_a_turbidity_beyond_the_bound_is_said(baked, fit):
    hazy = sky.preetham_harmonics(direction(30, 20), 8.0, table="wide")
    found = fit(transfer.shade_diffuse(hazy, baked, ALBEDO))
    assert found.statistics.at_bound
    assert float(found.value.turbidity) == pytest.approx(6, abs=1e-4)
    assert found.statistics.residual > 0.01


def test_what_the_data_do_not_determine_is_infinite(baked, fit):
    black = fit(shaded(baked, direction(40, 70), 4.0), 0.0)
    assert np.isinf(black.confidence.deviation.turbidity)


@pytest.mark.usefixtures("unchecked")
def test_refusals(baked):
    observed = shaded(baked, direction(40, 70), 4.0)
    fit = functools.partial(inverse.fit_sky, transfer=baked)
    for sentence, call in {
        "expected observed (603, 3), got shape (602, 3)": lambda: fit(observed[1:], albedo=1.0),
        "expected albedo as a number": lambda: fit(observed, albedo=jnp.ones(2)),
        "expected weights (603,)": lambda: fit(observed, albedo=1.0, weights=jnp.ones(3)),
        "weights must be finite": lambda: fit(observed, albedo=1.0, weights=-jnp.ones(603)),
        "3 numbers of observed are NaN": lambda: fit(observed.at[0].set(np.nan), albedo=1.0),
        "there is no light": lambda: fit(jnp.zeros((603, 3)), albedo=1.0),
        "turbidity must be bounds": lambda: fit(observed, albedo=1.0, turbidity=(6.0, 2.5)),
        "exposure must be a number > 0": lambda: fit(observed, albedo=1.0, exposure=0.0),
        "starts must be an integer >= 1": lambda: fit(observed, albedo=1.0, starts=0),
    }.items():
        with pytest.raises(ValueError, match=re.escape(sentence)):
            call()
