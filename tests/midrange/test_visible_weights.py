"""Samples that something hides weigh nothing."""

import jax
import jax.numpy as jnp
import jax.test_util
import numpy as np
import pytest
from lights import rectangle

from jaxsh import geometry, midrange

LAMP = midrange.Polygon(rectangle([0, 0, 1.6], [1, 0, 0], [0, 0.5, 0]), np.ones(3), two_sided=True)


def box(half):
    corners = np.array(list(np.ndindex(2, 2, 2)), float) * 2 * half - half
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [quad[:3] for quad in quads] + [[*quad[2:], quad[0]] for quad in quads]
    return geometry.make_mesh(corners, np.array(faces))


@pytest.fixture(scope="module")
def grid():
    return midrange.Grid(-np.ones(3), np.ones(3), (5, 5, 5))


@pytest.fixture(scope="module")
def cubes(grid):
    return midrange.capture(midrange.Scene([LAMP], [box(0.6)]), grid.points, 16)


def test_no_light_leaks_into_a_closed_box(rng, grid, cubes):
    samples = midrange.make_expansion(grid.points, midrange.project_cube(cubes, 1))
    inside = rng.uniform(-0.59, 0.59, (400, 3))
    weights = grid.weights(inside)
    plain = midrange.interpolate(samples, weights, inside)
    assert np.abs(plain).max() > 0.09
    found = midrange.interpolate(samples, weights, inside, visibility=cubes)
    np.testing.assert_array_equal(found, 0)
    # A sample in the box sees all of it: nothing is dark because nothing is known.
    visible = midrange.visible_weights(weights, cubes, inside)
    np.testing.assert_allclose(visible.values.sum(axis=1), 1, rtol=0, atol=1e-14)


def hidden_by_rays(positions, points, half):
    """Whether the segment from each point to each position meets the surface of a box."""
    start, way = points[None], positions[:, None] - points[None]
    with np.errstate(divide="ignore"):
        first, second = (-half - start) / way, (half - start) / way
    enter, leave = np.minimum(first, second).max(axis=-1), np.maximum(first, second).min(axis=-1)
    inside = (np.abs(points) < half).all(axis=-1)[None]
    meets = enter < leave
    return meets & np.where(inside, leave < 1, (enter > 0) & (enter < 1))


@pytest.mark.parametrize("dense", [False, True])
def test_what_is_hidden_is_what_segments_meet(rng, grid, cubes, dense):
    x = rng.uniform(-1, 1, (300, 3))
    weights = midrange.inverse_distance_weights(x, grid.points) if dense else grid.weights(x)
    found = midrange.visible_weights(weights, cubes, x)
    hidden = hidden_by_rays(x, np.asarray(grid.points), 0.6)
    if not dense:
        np.testing.assert_array_equal(found.indices, weights.indices)
        hidden = np.take_along_axis(hidden, np.asarray(weights.indices), axis=1)
    values, given = np.asarray(found.values), np.asarray(weights.values)
    np.testing.assert_allclose(values.sum(axis=1), 1, rtol=0, atol=1e-15)  # 4e-16
    # Texels cannot tell where the direction passes the box's silhouette within one of them: of the
    # pairs 0.4 % are seen through it and 0.07 % are not seen beside it, and none of the grid's.
    wrong = (values > 1e-9) & hidden & (given > 1e-9)
    assert wrong.mean() < (0.004 if dense else 1e-9)
    lost = (values < 1e-9) & ~hidden & (given > 1e-3)
    assert lost.mean() < (0.0008 if dense else 1e-9)
    # The rest is what it was, divided by its sum: in 40 % and 99.3 % of the rows to rounding. The
    # others move the mean of what rows are off to 0.009 and 0.0006; it is 0.46 as they were given.
    seen = np.where(hidden, 0, given)
    off = np.abs(values - seen / seen.sum(axis=1, keepdims=True)).sum(axis=1)
    assert (off < 1e-14).mean() > (0.39 if dense else 0.99)
    assert off.mean() < (0.0095 if dense else 0.0006)


@pytest.mark.slow
def test_where_all_see_weights_stay(rng, grid):
    """Negative ones too, outside the grid."""
    cubes = midrange.capture(midrange.Scene([LAMP]), grid.points, 4)
    x = rng.uniform(-1.3, 1.3, (50, 3))
    weights = grid.weights(x)
    found = midrange.visible_weights(weights, cubes, x)
    np.testing.assert_allclose(found.values, weights.values, rtol=0, atol=1e-14)
    single = grid.weights(x.astype(np.float32))
    assert midrange.visible_weights(single, cubes, x).values.dtype == np.float32
    at_a_sample = midrange.visible_weights(grid.weights(grid.points), cubes, grid.points)
    np.testing.assert_array_equal(at_a_sample.values, grid.weights(grid.points).values)


def test_positions_that_no_sample_sees_stay_black():
    walls = midrange.Scene([LAMP], [box(0.3)])
    points = np.array([[-1.0, 0, 0], [1, 0, 0]])
    cubes = midrange.capture(walls, points, 8)
    between = np.zeros((1, 3))
    weights = midrange.inverse_distance_weights(between, points)
    np.testing.assert_array_equal(midrange.visible_weights(weights, cubes, between).values, 0)


def test_a_negative_weight_alone_does_not_count():
    """Of two samples beside a box, only the first sees a position beside it."""
    points, position = np.array([[-1.0, 0, 0], [1, 0, 0]]), np.array([[-0.9, 0, 0]])
    cubes = midrange.capture(midrange.Scene([LAMP], [box(0.3)]), points, 8)
    weights = midrange.Weights(jnp.array([[-0.5, 1.5]]))
    np.testing.assert_array_equal(midrange.visible_weights(weights, cubes, position).values, 0)
    weights = midrange.Weights(jnp.array([[1.5, -0.5]]))
    np.testing.assert_array_equal(
        midrange.visible_weights(weights, cubes, position).values, [[1, 0]]
    )


def test_slopes_are_those_of_differences(rng, grid, cubes):
    x = jnp.asarray(rng.uniform(-1, 1, (6, 3)))
    factors = rng.normal(size=(6, 125))

    def weigh(x):
        weights = midrange.inverse_distance_weights(x, grid.points, exponent=2.0)
        return jnp.sum(factors * midrange.visible_weights(weights, cubes, x).values)

    # Short steps: kinks are as close as texels' centers. 2.3e-9 measured.
    jax.test_util.check_grads(
        weigh, (x,), order=1, modes=["fwd", "rev"], atol=4e-9, rtol=0, eps=1e-7
    )


def test_shapes_that_do_not_fit(rng, grid, cubes):
    x = rng.uniform(-1, 1, (4, 3))
    with pytest.raises(ValueError, match=r"positions \(4, 3\)"):
        midrange.visible_weights(grid.weights(x), cubes, x[:3])
    with pytest.raises(ValueError, match="cubes of 2 samples"):
        midrange.visible_weights(midrange.Weights(jnp.ones((4, 2))), cubes, x)
