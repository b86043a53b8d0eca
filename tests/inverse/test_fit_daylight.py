"""Sun, sky and ground recovered from one picture of a diffuse object."""

import functools
import re

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import inverse, sky, sphere, transfer
from jaxsh.inverse._pixels import as_rows

ALBEDO = np.array([0.6, 0.5, 0.4])
SHAPE = 12, 20


def glow(sun, turbidity):
    """A sky of degree 1 that is compiled faster than Preetham's, with a color by turbidity."""
    x, y, z = sun
    haze = turbidity - 2
    rows = [[3 * haze, y, 1 + z, x], [4 + haze, 0.8 * y, 1.5, 0.8 * x], [9 + z, y, haze, x]]
    return jnp.stack([jnp.stack([jnp.asarray(c, sun.dtype) for c in row]) for row in rows])


def daylight(model, clearness=0.7, ground=(0.3, 0.2, 0.1), elevation=40.0, turbidity=3.3):
    e, a = np.radians([elevation, 70.0])
    sun = jnp.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    disc = sky.sun_radiance(sun, turbidity) * (0.02 if model is glow else 1.0)
    numbers = (jnp.asarray(x) for x in (turbidity, 0.02))
    return inverse.Daylight(sun, *numbers, clearness * disc, jnp.asarray(ground))


def picture(value, model, normals, albedo=ALBEDO, sunlit=1.0):
    """What the daylight shows of normals (..., 3), each part of it by its own formula."""
    above = value.exposure * (model or sky.preetham_harmonics)(value.sun, value.turbidity)
    disc = np.pi * np.sin(sky.SUN_RADIUS) ** 2 * np.asarray(value.exposure * value.sun_radiance)
    irradiance = np.asarray(sphere.irradiance(above, normals.reshape(-1, 3)))
    irradiance = irradiance.reshape(normals.shape)
    irradiance = irradiance + (sunlit * np.maximum(normals @ value.sun, 0))[..., None] * disc
    level = np.asarray(sky.horizontal_irradiance(above)) + float(value.sun[2]) * disc
    below = np.asarray(value.ground) * level * (1 - normals[..., 2:]) / 2
    return albedo / np.pi * (irradiance + below)


@pytest.fixture
def normals(rng):
    """Of a picture from the side: none faces away."""
    drawn = rng.normal(size=(*SHAPE, 3))
    drawn[..., 1] = -np.abs(drawn[..., 1])
    return drawn / np.linalg.norm(drawn, axis=-1, keepdims=True)


def assert_recovered(found, truth, atol):
    assert found.converged, found.message
    for name, scale in {
        "sun": 1.0,
        "turbidity": 1.0,
        "exposure": truth.exposure,
        "sun_radiance": np.abs(truth.sun_radiance).max() or 1e6,
        "ground": 1.0,
    }.items():
        ours, theirs = (np.asarray(getattr(x, name)) for x in (found.value, truth))
        np.testing.assert_allclose(ours / scale, theirs / scale, rtol=0, atol=atol, err_msg=name)


def test_recovers_a_small_picture(normals):
    """Lengths of normals do not count, nor what is outside of the mask."""
    truth = daylight(glow)
    observed = picture(truth, glow, normals)
    mask = np.ones(SHAPE, bool)
    mask[:2] = False
    observed[0], normals[1] = np.nan, np.nan
    found = inverse.fit_daylight(observed, 3 * normals, ALBEDO, sky=glow, mask=mask, starts=2)
    assert_recovered(found, truth, 1e-6)
    assert found.statistics.residual < 1e-7
    assert not found.statistics.at_bound
    assert found.value.sun.dtype == jnp.float64
    assert found.confidence.covariance.shape == (11, 11)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "at_bound"),
    [
        ({}, False),
        ({"elevation": 5.0, "turbidity": 3.0}, False),
        ({"elevation": 88.0}, False),
        ({"clearness": 0.0, "turbidity": 4.0}, True),
        ({"clearness": np.array([1.0, 0.5, 0.2]), "ground": (0.0, 0.4, 1.0)}, True),
    ],
)
def test_recovers_preetham_s_sky(options, at_bound, normals):
    """In the fourth the sky is overcast: where the sun is its glow tells."""
    truth = daylight(None, **options)
    found = fit_of_a_picture(picture(truth, None, normals), normals)
    assert_recovered(found, truth, 5e-5)
    assert bool(found.statistics.at_bound) == at_bound


@jax.jit
def fit_of_a_picture(observed, normals):
    return inverse.fit_daylight(observed, normals, ALBEDO, throw=False)


@pytest.mark.slow
def test_noise_does_what_the_confidence_says(normals, rng):
    """Errors of forty draws in units of the deviations that each fit gives."""
    truth = daylight(None)
    clean = picture(truth, None, normals)
    scores = []
    for _ in range(40):
        observed = clean + 0.01 * clean.mean() * rng.normal(size=clean.shape)
        found = fit_of_a_picture(observed, normals)
        assert found.converged
        error = jax.tree.map(lambda a, b: a - b, found.value, truth)
        scores.append(
            np.concatenate(
                [
                    np.ravel(x)
                    for x in jax.tree.leaves(
                        jax.tree.map(lambda e, d: e / d, error, found.confidence.deviation)
                    )
                ]
            )
        )
    scores = np.stack(scores)
    # Of forty draws: deviation 0.11, mean 0.16 by themselves.
    np.testing.assert_allclose(np.sqrt(np.mean(scores**2, axis=0)), 1, rtol=0, atol=0.35)
    np.testing.assert_allclose(np.mean(scores, axis=0), 0, rtol=0, atol=0.5)


@pytest.mark.slow
def test_float32_and_batches(normals):
    """In the normals' dtype, as many pictures as there are, in any unit of light."""
    truths = [daylight(glow), daylight(glow, elevation=20.0, clearness=0.3)]
    observed = np.stack([picture(truth, glow, normals) for truth in truths])

    @jax.jit
    @jax.vmap
    def fit(observed):
        normal = jnp.asarray(normals, jnp.float32)
        return inverse.fit_daylight(observed, normal, ALBEDO, sky=glow, starts=2)

    found = fit(jnp.asarray(observed, jnp.float32))
    for number, truth in enumerate(truths):
        one = jax.tree.map(lambda leaf, at=number: leaf[at], found)
        assert one.value.sun.dtype == jnp.float32
        assert_recovered(one, truth, 1e-3)
    bright = jax.tree.map(lambda leaf: leaf[0], fit(jnp.asarray(1e12 * observed, jnp.float32)))
    bright = eqx.tree_at(lambda found: found.value.exposure, bright, bright.value.exposure / 1e12)
    assert_recovered(bright, truths[0], 1e-3)


@pytest.mark.slow
def test_through_a_transfer_and_with_known_shadows(normals, rng):
    """Cut to the transfer's degree the sun is found in what is cut alike; `sunlit` is not cut."""
    truth = daylight(glow)
    fit = functools.partial(inverse.fit_daylight, sky=glow, starts=2)
    flat = normals.reshape(-1, 3)
    baked = transfer.unshadowed(flat, flat, 4)
    albedo = rng.uniform(0.2, 0.9, flat.shape)
    soft = transfer.shade_diffuse(truth.harmonics(4, sky=glow), baked, albedo)
    assert_recovered(fit(soft, baked, albedo), truth, 2e-5)

    sunlit = rng.uniform(size=SHAPE).round(1)
    cast = picture(truth, glow, normals, albedo.reshape(normals.shape), sunlit)
    rows = cast.reshape(-1, 3), baked, albedo
    pixels = cast, normals, albedo.reshape(normals.shape)
    for data, known in ((rows, sunlit.ravel()), (pixels, sunlit)):
        found = fit(*data, sunlit=known, exposure=0.02)
        assert_recovered(found, truth, 2e-5)
        assert found.value.exposure == 0.02
        assert found.confidence.deviation.exposure == 0


def test_its_light_is_that_of_sky_sun_and_ground():
    """The sun as a point is 3e-4 off in degree 10, and less below."""
    value = daylight(None)
    light = sky.preetham_harmonics(value.sun, value.turbidity, 4, table="wide")
    light = light + 0.7 * sky.sun_harmonics(value.sun, value.turbidity, 4)
    light = 0.02 * sky.with_ground(light, value.ground)
    error = np.abs(value.harmonics(4) - light).max() / np.abs(light).max()
    assert error < 6e-5
    disc = value.suns.harmonics(4)
    np.testing.assert_allclose(
        value.harmonics(4, sun=False) + disc, light, rtol=0, atol=6e-5 * np.abs(light).max()
    )
    with pytest.raises(ValueError, match="daylight needs degree >= 1, got 0"):
        value.harmonics(0)


@pytest.mark.usefixtures("unchecked")
def test_refusals(normals):
    observed = np.ones(normals.shape)
    fit = functools.partial(inverse.fit_daylight, observed, sky=glow)
    point = transfer.unshadowed(normals[0], normals[0], 0)
    row = [[True, False] * 10]
    assert as_rows(observed[:1], normals[:1], 0.5, None, row, 0).weights.tolist() == [1, 0] * 10
    for sentence, call in {
        "expected observed (12, 20, 3), got shape (20, 3)": lambda: inverse.fit_daylight(
            observed[0], normals, 0.5
        ),
        "expected normals (V, 3) or (H, W, 3)": lambda: fit(normals[0, 0], 0.5),
        "expected albedo as a number": lambda: fit(normals, np.ones(2)),
        "expected mask (12, 20) of booleans": lambda: fit(normals, 0.5, mask=np.ones(SHAPE)),
        "expected weights (12, 20), got": lambda: fit(normals, 0.5, weights=np.ones(3)),
        "weights must be finite": lambda: fit(normals, 0.5, weights=-np.ones(SHAPE)),
        "expected sunlit (12, 20), got": lambda: fit(normals, 0.5, sunlit=np.ones(3)),
        "expected mask (12, 20) of booleans, got a list": lambda: fit(
            normals, 0.5, mask=[[True], [True, False]]
        ),
        "sunlit must be from 0 to 1, got 1.5 to 1.5": lambda: fit(
            normals, 0.5, sunlit=np.full(SHAPE, 1.5)
        ),
        "there is no light": lambda: fit(normals, 0.5, mask=np.zeros(SHAPE, bool)),
        "needs a transfer of degree >= 1": lambda: inverse.fit_daylight(
            observed[0], point, 0.5, sky=glow
        ),
        "to give (3, K), got shape (3,)": lambda: inverse.fit_daylight(
            observed, normals, 0.5, sky=lambda sun, haze: haze * sun
        ),
        "starts must be an integer >= 1": lambda: fit(normals, 0.5, starts=0),
    }.items():
        with pytest.raises(ValueError, match=re.escape(sentence)):
            call()
