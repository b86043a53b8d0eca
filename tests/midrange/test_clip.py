"""What is seen of a polygon light: above the horizon, and beside what stands before it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from lights import rectangle, surface_quadrature

from jaxsh.midrange import (
    Polygon,
    polygon_harmonics,
    polygon_harmonics_with_gradient,
)

ONE = np.ones(3)
DEGREE = 3
# Concave, at z = 2, facing the origin.
ARROW = np.array([[0.2, 0.1, 2], [-1, 1, 2], [1, 1, 2], [1, -1, 2], [-1, -1, 2]])
WINDOW = rectangle([0.2, 0.1, 2], [0, 1, 0], [1, 0, 0])


def quadrature(vertices, point=(0, 0, 0)):
    return surface_quadrature(vertices, ONE, point, DEGREE)


def cut(vertices, normal, point):
    """Sutherland and Hodgman's clip, one polygon at a time."""
    kept = []
    for a, b in zip(vertices, np.roll(vertices, -1, axis=0), strict=True):
        x, y = (a - point) @ normal, (b - point) @ normal
        kept += [a] if x >= 0 else []
        kept += [a + (b - a) * x / (x - y)] if (x >= 0) != (y >= 0) else []
    return np.array(kept)


def check(polygon, point, expected, **seen):
    """Values; and the gradient beside differences, all from one program."""
    h = 1e-5
    steps = np.concatenate([np.zeros((1, 3)), h * np.eye(3), -h * np.eye(3)])
    values, gradients = polygon_harmonics_with_gradient(polygon, point + steps, DEGREE, **seen)
    np.testing.assert_allclose(values[0, 0], expected, rtol=0, atol=1e-12)
    differences = (values[1:4, 0] - values[4:, 0]) / (2 * h)
    np.testing.assert_allclose(differences.T, gradients[0, 0], rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    "vertices",
    # The convex one, which need not be split, is also cut by the next test.
    [ARROW, pytest.param(WINDOW, marks=pytest.mark.slow)],
    ids=["concave", "convex"],
)
def test_horizon_is_the_cut_polygon(vertices):
    normal, point = np.array([0.8, -0.1, 0.1]), np.array([0.1, 0.2, 0.3])
    normal = normal / np.linalg.norm(normal)
    expected = quadrature(cut(vertices, normal, point), point)[0][0]
    assert np.abs(expected - quadrature(vertices, point)[0][0]).max() > 0.05
    check(Polygon(vertices, ONE), point, expected, horizon=normal)


def test_horizon_above_below_and_through_corners():
    polygon = Polygon(WINDOW, ONE)
    corner = WINDOW[0] / np.linalg.norm(WINDOW[0])
    aside = np.cross(corner, WINDOW[2])  # the plane of a diagonal
    normals = np.stack([[0, 0, 1], [0, 0, -1], aside / np.linalg.norm(aside)])
    value, slope = polygon_harmonics_with_gradient(polygon, np.zeros(3), DEGREE, horizon=normals)
    whole, whole_slope = quadrature(WINDOW)
    np.testing.assert_allclose(value[0], whole, rtol=0, atol=1e-13)
    np.testing.assert_allclose(slope[0], whole_slope, rtol=0, atol=1e-12)
    np.testing.assert_allclose(value[1], 0, rtol=0, atol=1e-15)
    np.testing.assert_allclose(slope[1], 0, rtol=0, atol=1e-15)
    half = WINDOW[[0, 1, 2]] if aside @ WINDOW[1] > 0 else WINDOW[[0, 2, 3]]
    np.testing.assert_allclose(value[2], quadrature(half)[0], rtol=0, atol=1e-13)


def test_blocker_s_shadow_is_taken_away():
    """At half the distance, so its shadow is twice its size; whichever way it faces.

    Behind the light or the point there is none.
    """
    inside = rectangle([0.1, 0.1, 1], [0, 0.2, 0], [0.3, 0, 0])
    whole = quadrature(WINDOW)[0][0]
    left = whole - quadrature(2 * inside)[0][0]
    cases = (inside, left), (inside[::-1], left), (3 * inside, whole), (-inside, whole)
    for vertices, expected in cases:
        check(Polygon(WINDOW, ONE), np.zeros(3), expected, blockers=(Polygon(vertices, ONE),))


def test_blockers_that_overlap_count_once():
    """Shadows [-.4, .6] × [-.5, .3] and [.2, 3] × [-.1, .7], the second over the light's edge."""
    first = rectangle([0.05, -0.05, 1], [0, 0.2, 0], [0.25, 0, 0])
    second = rectangle([0.8, 0.15, 1], [0, 0.2, 0], [0.7, 0, 0])
    shadow = rectangle([0.7, 0.3, 2], [0, 0.4, 0], [0.5, 0, 0])
    both = rectangle([0.4, 0.1, 2], [0, 0.2, 0], [0.2, 0, 0])
    parts = [quadrature(v)[0][0] for v in (WINDOW, 2 * first, shadow, both)]
    expected = parts[0] - parts[1] - parts[2] + parts[3]
    blockers = Polygon(first, ONE), Polygon(second, ONE)
    check(Polygon(WINDOW, ONE), np.zeros(3), expected, blockers=blockers)


@pytest.mark.slow
def test_blockers_that_share_an_edge_leave_no_gap():
    """A square in two triangles blocks as the square does; one as large as the light, all of it."""
    square = rectangle([0.1, 0.05, 1], [0, 0.5, 0], [0.5, 0, 0])
    halves = [Polygon(square[i], ONE) for i in ([0, 1, 2], [0, 2, 3])]
    left = polygon_harmonics_with_gradient(
        Polygon(WINDOW, ONE), np.zeros((1, 3)), DEGREE, blockers=halves
    )
    for light in left:
        np.testing.assert_allclose(light, 0, rtol=0, atol=1e-14)


@pytest.mark.slow
def test_blocker_behind_the_light_or_the_point_does_not_block():
    polygon, whole = Polygon(WINDOW, ONE), quadrature(WINDOW)[0]
    slanted = np.array([[-0.3, 0.2, 1.0], [0.3, 0.2, 1.0], [0.3, 0.4, 4.0], [-0.3, 0.4, 4.0]])
    near = np.array([[-0.3, 0.2, 1], [0.3, 0.2, 1], [0.3, 4 / 15, 2], [-0.3, 4 / 15, 2]])
    offsets = [[0, 0, 3], [0, 0, -5], [0, 9, 0]]
    for offset in offsets:
        blocker = Polygon(slanted + offset, ONE)
        value = polygon_harmonics(polygon, np.zeros(3), DEGREE, blockers=(blocker,))
        np.testing.assert_allclose(value, whole, rtol=0, atol=1e-12)
    # What stands through the light's plane blocks with its part before it.
    shadow = quadrature(near * 2 / near[:, 2:])[0][0]
    assert shadow[0] > 0.003
    expected = whole[0] - shadow
    value = polygon_harmonics(polygon, np.zeros(3), DEGREE, blockers=(Polygon(slanted, ONE),))
    np.testing.assert_allclose(value[0], expected, rtol=0, atol=1e-12)


@pytest.mark.slow
def test_clipped_lights_are_differentiable(rng):
    """Forward as the analytic gradient; reverse in everything, finite also where nothing is cut."""
    corners, blocker = (
        WINDOW[:3],
        Polygon(rectangle([0.1, 0.1, 1], [0, 0.2, 0], [0.3, 0, 0])[:3], ONE),
    )
    polygon = Polygon(corners, ONE)
    points, normals = rng.normal(size=(2, 40, 3)) * 0.5
    seen = dict(horizon=normals, blockers=(blocker,))
    _, gradient = polygon_harmonics_with_gradient(polygon, points, DEGREE, **seen)

    @jax.jit
    def light(polygon, blocker, points, normals):
        return polygon_harmonics(polygon, points, DEGREE, horizon=normals, blockers=(blocker,))

    arguments = polygon, blocker, jnp.asarray(points), jnp.asarray(normals)
    value, back = jax.vjp(light, *arguments)
    probe = jnp.asarray(rng.normal(size=value.shape))
    slopes = back(probe)
    for slope in jax.tree.leaves(slopes):
        assert jnp.isfinite(slope).all()
    expected = jnp.sum(probe[..., None] * gradient, axis=(1, 2))
    np.testing.assert_allclose(slopes[2], expected, rtol=0, atol=1e-11)
    moved = jnp.sum(slopes[0].vertices, axis=0) + jnp.sum(slopes[1].vertices, axis=0)
    np.testing.assert_allclose(moved, -jnp.sum(expected, axis=0), rtol=0, atol=1e-10)


def test_blockers_must_be_convex():
    with pytest.raises(ValueError, match="convex"):
        polygon_harmonics(Polygon(WINDOW, ONE), np.zeros(3), 2, blockers=(Polygon(ARROW / 2, ONE),))
