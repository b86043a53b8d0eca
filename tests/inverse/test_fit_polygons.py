"""Near lights recovered from the shaded vertices of a small mesh."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import geometry, inverse, transfer
from jaxsh.inverse._rectangle import moved, rotate
from jaxsh.midrange import Polygon, polygon_harmonics

ALBEDO = 0.6


@pytest.fixture(scope="module")
def baked():
    """Of about 300 vertices, shadows included, in float64."""
    baked = transfer.bake(geometry.knot(300), 2, directions=256, progress=False)
    return eqx.tree_at(
        lambda t: (t.coefficients, t.positions), baked, replace_fn=lambda x: x.astype(jnp.float64)
    )


def rectangle(center, toward, width, height, radiance):
    """One that faces a point."""
    center = np.asarray(center, float)
    n = np.asarray(toward) - center
    first = np.cross([0.1, 0.2, 1], n)
    first = first / np.linalg.norm(first)
    second = np.cross(n / np.linalg.norm(n), first)
    return inverse.Rectangle(
        jnp.asarray(center),
        jnp.asarray(np.stack([first, second])),
        jnp.array([width, height]),
        jnp.asarray(radiance, float),
    )


def shaded(baked, lights):
    light = sum(polygon_harmonics(p, baked.positions, baked.degree) for p in lights)
    return transfer.shade_diffuse(light, baked, ALBEDO)


LAMP = rectangle([1.2, -1.0, 1.3], [0, 0, 0], 0.9, 0.6, [4.0, 3.0, 1.0])
PANEL = rectangle([-1.5, -0.8, 0.6], [0, 0, 0.2], 0.7, 1.1, [0.5, 1.0, 3.0])


def test_rectangles_and_polygons_are_the_same():
    again = jax.jit(lambda light: inverse.rectangle_of(light.polygon))(LAMP)
    for a, b in zip(jax.tree.leaves(again), jax.tree.leaves(LAMP), strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-14)


def test_cayley_rotates():
    value, slope = jax.jit(
        lambda q: (rotate(LAMP.axes, q), jax.jacfwd(rotate, 1)(LAMP.axes, 0 * q))
    )(jnp.array([0.3, -0.2, 0.5]))
    np.testing.assert_allclose(value @ value.T, np.eye(2), rtol=0, atol=1e-14)
    expected = np.stack([np.cross(np.eye(3)[i], LAMP.axes) for i in range(3)], axis=-1)
    np.testing.assert_allclose(slope, expected, rtol=0, atol=1e-14)


@pytest.mark.slow
def test_recovers_two_lights_from_the_better_guess(baked, rng):
    """Without noise to the last digits, with it as far off as the fit itself says."""
    observed = shaded(baked, (LAMP.polygon, PANEL.polygon))
    white = [2.0, 2.0, 2.0]
    near = (
        rectangle([1.6, -0.7, 1.1], [0, 0, 0], 0.6, 0.6, white).polygon,
        rectangle([-1.2, -1.2, 0.8], [0, 0, 0], 0.6, 0.6, white).polygon,
    )
    far = (
        rectangle([0.3, 1.6, -1.1], [0, 0, 0], 0.6, 0.6, white).polygon,
        rectangle([-0.2, 1.2, 1.4], [0, 0, 0], 0.6, 0.6, white).polygon,
    )
    found = inverse.fit_polygons(observed, baked, ALBEDO, [far, near], max_steps=30)
    assert found.converged
    assert found.statistics.starts == 2
    assert found.statistics.residual < 1e-6
    for light, truth in zip(found.value, (LAMP, PANEL), strict=True):
        np.testing.assert_allclose(light.center, truth.center, rtol=0, atol=1e-4)
        np.testing.assert_allclose(light.radiance, truth.radiance, rtol=1e-3)
        np.testing.assert_allclose(light.size, truth.size, rtol=1e-3)

    noise = 0.01 * float(observed.mean())
    noisy = observed + noise * rng.normal(size=observed.shape)
    found = inverse.fit_polygons(noisy, baked, ALBEDO, [far, near], max_steps=30)
    for light, truth, deviation in zip(
        found.value, (LAMP, PANEL), found.confidence.deviation, strict=True
    ):
        assert (jnp.abs(light.center - truth.center) < 4 * deviation.center).all()
        assert (deviation.center < 0.2).all()


@pytest.mark.slow
def test_float32_under_x64_with_the_pose_kept(baked):
    """Traced, not compiled: what failed here was a dtype (`test_solve` has the numbers)."""
    single = jax.tree.map(lambda x: x.astype(jnp.float32) if x.dtype == float else x, baked)
    found = jax.eval_shape(
        lambda observed: inverse.fit_polygons(
            observed, single, ALBEDO, [LAMP.polygon, PANEL.polygon], turn=False
        ),
        jnp.ones((len(baked.positions), 3)),
    )
    assert {leaf.dtype for leaf in jax.tree.leaves(found.value)} == {jnp.dtype(jnp.float32)}
    assert found.confidence.covariance.dtype == jnp.float32
    kept = moved(LAMP, jnp.zeros(8).at[3].set(jnp.log(2.0)))
    np.testing.assert_array_equal(kept.axes, LAMP.axes)
    np.testing.assert_allclose(kept.size, LAMP.size * jnp.array([2.0, 1.0]), rtol=1e-15)


@pytest.mark.slow
def test_colors_are_those_of_the_lights(baked, rng):
    lights = LAMP.polygon, PANEL.polygon
    truth = np.stack([LAMP.radiance, PANEL.radiance])
    albedo = jnp.asarray(rng.uniform(0.2, 0.9, (len(baked.positions), 3)))
    clean = shaded(baked, lights) / ALBEDO * albedo
    found = inverse.fit_colors(clean, baked, albedo, lights)
    assert found.value.shape == (2, 3)
    assert found.converged
    assert not found.statistics.at_bound
    np.testing.assert_allclose(found.value, truth, rtol=1e-7)

    noisy = clean + 0.05 * float(clean.mean()) * rng.normal(size=clean.shape)
    found = inverse.fit_colors(noisy, baked, albedo, lights)
    assert (jnp.abs(found.value - truth) < 4 * found.confidence.deviation).all()


def test_colors_keep_their_bounds(baked):
    """Beside SciPy's bounded least squares, where a light that is not there would go negative."""
    from scipy.optimize import lsq_linear

    lights = LAMP.polygon, PANEL.polygon
    units = [
        shaded(baked, [eqx.tree_at(lambda p: p.radiance, p, jnp.ones(3))])[:, 0] for p in lights
    ]
    matrix = np.stack(units, axis=-1)
    observed = matrix @ np.array([[2.0, 0.3, 5.0], [-0.4, 1.0, 0.2]])
    albedo = np.full_like(observed, ALBEDO)  # in the form that is compiled already
    found = inverse.fit_colors(observed, baked, albedo, lights, upper=3.0)
    expected = [lsq_linear(matrix, b, (0, 3), tol=1e-14).x for b in observed.T]
    np.testing.assert_allclose(found.value, np.transpose(expected), rtol=0, atol=1e-6)
    assert found.statistics.at_bound
    assert found.value[1, 0] == 0
    assert found.value[0, 2] == 3


def test_fits_of_lights_refuse_mistakes(baked, unchecked):
    observed, lamp = np.ones((len(baked.positions), 3)), LAMP.polygon
    dark = eqx.tree_at(lambda p: p.radiance, lamp, jnp.zeros(3))
    with pytest.raises(ValueError, match="positive radiance"):
        inverse.fit_polygons(observed, baked, ALBEDO, [dark])
    with pytest.raises(ValueError, match="same number"):
        inverse.fit_polygons(observed, baked, ALBEDO, [[lamp], [lamp, lamp]])
    with pytest.raises(ValueError, match="4 vertices"):
        inverse.fit_polygons(observed, baked, ALBEDO, [Polygon(lamp.vertices[:3], lamp.radiance)])
    with pytest.raises(ValueError, match="at least 1 of Polygon"):
        inverse.fit_colors(observed, baked, ALBEDO, [])
    with pytest.raises(ValueError, match="upper must be a number > 0"):
        inverse.fit_colors(observed, baked, ALBEDO, [lamp], upper=0.0)
    with pytest.raises(ValueError, match="expected observed"):
        inverse.fit_colors(observed[:5], baked, ALBEDO, [lamp])


def test_says_which_guesses_shine_on_no_vertex(baked):
    """From behind, or below all horizons; before anything is fitted, as warnings are errors."""
    observed = jnp.ones((len(baked.positions), 3))
    turned = Polygon(PANEL.vertices[::-1], PANEL.radiance)
    guesses = [LAMP.polygon, turned], [LAMP.polygon, PANEL.polygon], [turned, LAMP.polygon]
    with pytest.raises(
        UserWarning, match="is lit by light 1 of guess 0, light 0 of guess 2, which"
    ):
        inverse.fit_polygons(observed, baked, ALBEDO, guesses)
    away = jnp.tile(-LAMP.center / jnp.linalg.norm(LAMP.center), (len(observed), 1))
    away = eqx.tree_at(lambda t: t.normals, baked, away)
    with pytest.raises(UserWarning, match="is lit by light 0 of guess 0, which"):
        inverse.fit_polygons(observed, away, ALBEDO, [LAMP.polygon])
