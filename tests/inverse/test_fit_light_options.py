"""Lights that are not negative, unknown colors and windows in `fit_light`."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.optimize

from jaxsh import harmonics, inverse, sphere
from jaxsh.inverse._nonnegative import nonnegative

PRIOR = np.array([0.3, 0.15, 0.1])


def cap(rng, count):
    """Normals that face one side."""
    normals = rng.normal(size=(count, 3))
    normals[:, 0] = np.abs(normals[:, 0])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def lamp(direction):
    """Light of degree 3 of a lamp and a dim room: it rings."""
    room = np.eye(16)[0]
    return np.stack(
        [c * 2 * np.asarray(harmonics.evaluate(direction, 3)) + room for c in (1, 2, 3)]
    )


def shaded(light, normals):
    return np.asarray(sphere.irradiance(light, normals)) / np.pi


@pytest.mark.slow
def test_nearest_that_is_not_negative(rng):
    """SciPy's nnls on the dual of each channel (Lawson & Hanson's least distance programming)."""
    rows = rng.normal(size=(60, 5)) + np.array([3, 0, 0, 0, 0])
    light = rng.normal(size=(3, 5)) + np.array([[1.0, 0, 0, 0, 0]])
    light[2] = [5, 0, 0, 0, 0]  # has nothing to mend
    roots = rng.normal(size=(3, 5, 5)) * np.array([1, 0.3, 0.1, 0.03, 0.01])[:, None]
    arguments = light, roots @ np.swapaxes(roots, 1, 2), rows
    moved, met, done = nonnegative(*map(jnp.asarray, arguments), 1e-8, 100)
    assert met
    assert done
    for c in range(3):
        dual = np.vstack([(rows @ roots[c]).T, -(rows @ light[c])])
        target = np.append(np.zeros(5), 1)
        left = dual @ scipy.optimize.nnls(dual, target)[0] - target
        expected = light[c] - roots[c] @ left[:5] / left[5]
        np.testing.assert_allclose(moved[c], expected, rtol=0, atol=1e-6)
    assert np.all(moved[2] == light[2])


@pytest.mark.slow
@pytest.mark.parametrize("what", ["irradiance", "light"])
def test_nothing_is_negative(what, rng):
    """A lamp in the dark, the like of which rings."""
    normals = cap(rng, 60)
    light = lamp(np.array([0.6, 0.0, 0.8])) - np.eye(16)[:1]  # in a dark room
    observed = 0.5 * shaded(light, normals) + 0.01 * rng.normal(size=(60, 3))
    free = inverse.fit_light(observed, normals, 0.5, 2, prior=PRIOR)
    found = inverse.fit_light(observed, normals, 0.5, 2, prior=PRIOR, nonnegative=what)
    directions = sphere.fibonacci(3000).directions
    values = sphere.irradiance if what == "irradiance" else lambda c, d: sphere.reconstruct(c, d).T
    mean = np.asarray(values(found.value, directions)).mean(axis=0)
    assert np.all(np.min(values(free.value, directions), axis=0) < -0.05 * mean)
    assert not free.statistics.at_bound
    assert found.statistics.at_bound
    # Bands above the degree, which are cut off, bear a part of the irradiance.
    least = {"irradiance": -0.05, "light": -0.01}[what]
    assert np.all(np.min(values(found.value, directions), axis=0) > least * mean)
    np.testing.assert_allclose(found.confidence.deviation, free.confidence.deviation, rtol=1e-12)
    with pytest.raises(NotImplementedError, match="loss='squares' alone"):
        jax.grad(
            lambda seen: inverse.fit_light(
                seen, normals, 0.5, 2, prior=PRIOR, nonnegative=what
            ).value.sum()
        )(jnp.asarray(observed))


@pytest.mark.slow
def test_unknown_colors(rng):
    """Four materials under one light: both come back, up to the mean color that is told."""
    normals = cap(rng, 400)
    colors, labels = rng.uniform(0.2, 0.9, (4, 3)), rng.integers(0, 4, 400)
    light = lamp(np.array([0.6, 0.0, 0.8]))
    clean = colors[labels] * shaded(light, normals)
    weights = rng.uniform(0.5, 1.5, 400)
    squared = np.bincount(labels, weights**2)
    mean = squared @ colors / squared.sum()

    def fit(observed, normals=normals):
        return inverse.fit_light(
            observed, normals, mean, 2, materials=labels, weights=weights, prior=PRIOR
        )

    found = fit(clean)
    np.testing.assert_allclose(found.albedo, colors, rtol=1e-4)
    np.testing.assert_allclose(found.value, light[:, :9], rtol=0, atol=2e-3)
    single = fit(clean, normals.astype(np.float32))
    assert single.value.dtype == np.float32
    np.testing.assert_allclose(single.albedo, colors, rtol=2e-3)

    ratios = []
    for _ in range(8):
        found = fit(clean + 0.01 * rng.normal(size=clean.shape) / weights[:, None])
        ratios.append((found.value - light[:, :9]) / found.confidence.deviation)
    assert 0.5 < np.sqrt(np.mean(np.square(ratios))) < 1.3
    known = inverse.fit_light(
        clean + 0.01 * rng.normal(size=clean.shape) / weights[:, None],
        normals,
        colors[labels],
        2,
        weights=weights,
        prior=PRIOR,
    )
    assert np.all(known.confidence.deviation < 1.05 * found.confidence.deviation)


@pytest.mark.slow
def test_window_that_is_needed(rng):
    normals = cap(rng, 60)
    observed = shaded(lamp(np.array([0.6, 0.0, 0.8])), normals)
    plain, found = (
        inverse.fit_light(observed, normals, 1.0, 2, prior=PRIOR, window=kind)
        for kind in ("none", "light")
    )
    expected, strength = harmonics.dering(plain.value, of="light", shared=True)
    assert strength > 0
    # Some are zero but for rounding: 1e-16.
    np.testing.assert_allclose(found.value, expected, rtol=0, atol=1e-14)
    share = found.value[:, 8] / plain.value[:, 8]
    np.testing.assert_allclose(
        found.confidence.deviation[:, 8], share * plain.confidence.deviation[:, 8], rtol=1e-6
    )


def test_errors(rng, unchecked):
    normals, observed = cap(rng, 48), np.ones((48, 3))  # a shape that is compiled already
    labels = np.arange(48)
    for options, sentence in [
        ({"materials": labels[:-1]}, r"expected materials \(48,\), got shape \(47,\)"),
        ({"materials": labels - 1}, "numbered 0, 1, …, got -1 to 46"),
        ({"materials": labels, "loss": "huber"}, "loss as 'squares' with materials"),
        ({"nonnegative": "lights"}, "did you mean 'light'"),
        ({"window": "irradience"}, "did you mean 'irradiance'"),
        ({"loss": "square"}, "did you mean 'squares'"),
    ]:
        with pytest.raises(ValueError, match=sentence):
            inverse.fit_light(observed, normals, 0.5, 2, **options)
