"""Points: what is taken and what is refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh.geometry import Points

UP = np.array([[0.0, 0.0, 1.0]])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_points_keep_their_dtype(dtype):
    points = Points(np.zeros((2, 3), dtype), np.repeat(UP, 2, axis=0))
    assert points.positions.dtype == points.normals.dtype == dtype
    assert points.num_points == 2


def test_points_pass_through_jit_vmap_and_grad():
    def height(positions):
        return Points(positions, UP).positions[0, 2]

    positions = jnp.ones((1, 3))
    np.testing.assert_array_equal(jax.jit(jax.grad(height))(positions), UP)
    assert jax.vmap(lambda x: Points(x))(jnp.ones((4, 1, 3))).positions.shape == (4, 1, 3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.zeros((0, 3)),), r"positions \(n, 3\) of at least one point, got shape \(0, 3\)"),
        ((np.zeros(3),), r"positions \(n, 3\) of at least one"),
        ((np.zeros((2, 3)), UP), r"normals \(2, 3\), one for each of the positions, got .*\(1, 3"),
        ((np.full((1, 3), np.nan),), "positions must be finite, got nan in 3 of 3"),
        ((np.zeros((1, 3)), np.nan * UP), "normals must be finite"),
        ((np.zeros((1, 3)), 0.5 * UP), "normals of length 1, got 0.5 in row 0, 1 of 1 such"),
        ((np.zeros((1, 3), np.uint8),), "expected real numbers for positions, got dtype uint8"),
    ],
)
def test_what_are_no_points_is_refused(unchecked, arguments, message):
    with pytest.raises(ValueError, match=message):
        Points(*arguments)


def test_traced_normals_are_not_looked_at():
    def lengths(normals):
        return jnp.sum(Points(jnp.zeros((1, 3)), normals).normals)

    assert jax.jit(lengths)(0.5 * UP) == 0.5
