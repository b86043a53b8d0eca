"""Weights of samples: eq. 16, moving least squares, grids."""

import itertools

import jax
import jax.numpy as jnp
import jax.test_util
import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from jaxsh.midrange import (
    Grid,
    grid_around,
    inverse_distance_weights,
    moving_least_squares_weights,
)


@pytest.mark.parametrize("exponent", [1.0, 4.0, 5.5])
def test_inverse_distances_are_eq_16(rng, exponent):
    x, p = rng.normal(size=(7, 3)), rng.normal(size=(4, 3))
    slow = (1 / np.linalg.norm(x[:, None] - p[None], axis=-1)) ** exponent
    weights = inverse_distance_weights(x, p, exponent=exponent)
    np.testing.assert_allclose(weights.values, slow / slow.sum(axis=1, keepdims=True), rtol=1e-13)
    assert weights.indices is None
    assert weights.samples == 4


@pytest.mark.parametrize(
    ("make", "dtype"),
    [(inverse_distance_weights, np.float64), (moving_least_squares_weights, np.float32)],
)
def test_weights_at_and_near_samples(rng, make, dtype):
    p = rng.normal(size=(6, 3)).astype(dtype)
    x = np.concatenate([p, p + dtype(1e-7), p * dtype(1e4)])
    values = make(x, p, exponent=8.0).values
    assert values.dtype == dtype
    np.testing.assert_array_equal(values[:6], np.eye(6, dtype=dtype))
    np.testing.assert_allclose(values[6:12], np.eye(6), rtol=0, atol=3e-6)
    np.testing.assert_allclose(values.sum(axis=1), 1, rtol=50 * np.finfo(dtype).eps * 1e4)

    def share(x):
        return make(x[None], p, exponent=8.0).values[0]

    slopes = jax.jit(jax.vmap(jax.jacfwd(share)))(jnp.asarray(x[:12]))
    assert np.isfinite(slopes).all()
    assert np.abs(slopes).max() < 100


def test_shared_distance_has_the_true_slope():
    p = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 2, 0]])
    slope = jax.jacfwd(lambda x: inverse_distance_weights(x[None], p, exponent=2.0).values[0])
    step = 1e-6
    ends = np.array([[step, 0, 0], [-step, 0, 0]])
    values = np.asarray(inverse_distance_weights(ends, p, exponent=2.0).values)
    expected = (values[0] - values[1]) / (2 * step)
    np.testing.assert_allclose(slope(jnp.zeros(3))[:, 0], expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float32, 3e-5), (np.float64, 1e-13)])
def test_least_squares_weights_are_linear(rng, dtype, tolerance):
    x, p = rng.normal(size=(50, 3)).astype(dtype), rng.normal(size=(9, 3)).astype(dtype)
    w = moving_least_squares_weights(x, p, exponent=3.0).values
    np.testing.assert_allclose(w.sum(axis=1), 1, rtol=0, atol=tolerance)
    np.testing.assert_allclose(w @ p, x, rtol=0, atol=tolerance)


def test_least_squares_weights_solve_their_problem(rng):
    x, p = rng.normal(size=(1, 3)), rng.normal(size=(7, 3))
    u = np.asarray(inverse_distance_weights(x, p, exponent=2.0).values)[0]
    # Least Σ (w - u)²/u with Σ w = 1 and Σ w p = x, by Lagrange's multipliers.
    constraints = np.concatenate([np.ones((7, 1)), p], axis=1)
    right = np.append(1, x[0]) - constraints.T @ u
    w = u + u * (constraints @ np.linalg.solve((constraints.T * u) @ constraints, right))
    found = moving_least_squares_weights(x, p).values[0]
    np.testing.assert_allclose(found, w, rtol=0, atol=1e-12)


@pytest.mark.parametrize("kept", [0, 1, 2])
def test_flat_samples_are_linear_along_themselves(rng, kept):
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0][:kept]
    p = rng.normal(size=(6, kept)) @ axes + np.ones(3)
    if kept == 0:
        p = p[:1]
    x = rng.normal(size=(20, 3))
    w = np.asarray(moving_least_squares_weights(x, p).values)
    np.testing.assert_allclose(w.sum(axis=1), 1, rtol=0, atol=1e-13)
    np.testing.assert_allclose((w @ p - x) @ axes.T, np.zeros((20, kept)), rtol=0, atol=1e-11)
    assert np.abs(w).max() < 50


@pytest.mark.parametrize("shape", [(2, 2, 2), (2, 3, 4)])
def test_grid_is_trilinear(rng, shape):
    grid = Grid(np.array([-1.0, 0, 2]), np.array([1.0, 3, 4]), shape)
    axes = [np.linspace(a, b, n) for a, b, n in zip(grid.lower, grid.upper, shape, strict=True)]
    np.testing.assert_allclose(grid.points, list(itertools.product(*axes)), rtol=0, atol=1e-15)
    # Inside, on samples, and outside: sums of products of linear functions are reproduced.
    x = np.concatenate([rng.uniform(-1.5, 4.5, (300, 3)), grid.points])
    weights = grid.weights(x)
    dense = np.asarray(weights.values)
    if weights.indices is not None:
        dense = np.zeros((len(x), grid.size))
        np.put_along_axis(dense, np.asarray(weights.indices), np.asarray(weights.values), axis=1)
    assert weights.samples == grid.size
    np.testing.assert_allclose(dense.sum(axis=1), 1, rtol=0, atol=1e-12)
    np.testing.assert_allclose(dense @ grid.points, x, rtol=0, atol=1e-12)
    np.testing.assert_allclose(dense[300:], np.eye(grid.size), rtol=0, atol=1e-14)


def test_grid_interpolates_in_cells(rng):
    grid = Grid(np.zeros(3), np.ones(3), (4, 4, 4))
    values = rng.normal(size=(4, 4, 4))
    x = rng.uniform(0, 1, (200, 3))
    weights = grid.weights(x)
    steps = np.linspace(0, 1, 4)
    expected = RegularGridInterpolator((steps, steps, steps), values)(x)
    found = np.sum(np.asarray(weights.values) * values.ravel()[weights.indices], axis=1)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)
    # The blocks hold each position once, beside others of its cell.
    cells = weights.cells
    assert cells is not None
    rows = np.asarray(cells.rows)
    np.testing.assert_array_equal(np.sort(rows[rows < 200]), np.arange(200))
    np.testing.assert_array_equal(rows.ravel()[cells.place], np.arange(200))
    for row in rows:
        assert len(set(np.asarray(cells.cell)[row[row < 200]])) <= 1


@pytest.mark.slow
def test_weights_jit_and_slopes(rng):
    x, p = jnp.asarray(rng.uniform(0.1, 0.9, (5, 3))), jnp.asarray(rng.normal(size=(6, 3)))
    grid = Grid(np.zeros(3), np.ones(3), (3, 2, 2))
    for make in (
        lambda x: inverse_distance_weights(x, p).values,
        lambda x: moving_least_squares_weights(x, p).values,
        lambda x: grid.weights(x).values,
    ):
        compiled = jax.jit(make)
        np.testing.assert_allclose(compiled(x), make(x), rtol=0, atol=1e-13)
        jax.test_util.check_grads(compiled, (x,), order=1, modes=["fwd", "rev"], eps=1e-6)


def test_grid_around_keeps_off_the_box(rng):
    x = rng.uniform(-1, 1, (500, 3))
    grid = grid_around(x, (2, 3, 4))
    half = (x.max(axis=0) - x.min(axis=0)) / 2
    expected = half * np.cos(np.pi / (2 * np.array([2, 3, 4])))
    np.testing.assert_allclose((grid.upper - grid.lower) / 2, expected, rtol=1e-12)


@pytest.mark.usefixtures("unchecked")
def test_weight_errors():
    x, p = np.zeros((4, 3)), np.ones((2, 3))
    for make in (inverse_distance_weights, moving_least_squares_weights):
        with pytest.raises(ValueError, match="exponent must be a number > 0"):
            make(x, p, exponent=0.0)
        with pytest.raises(ValueError, match="at least one point"):
            make(x, p[:0])
        with pytest.raises(ValueError, match=r"expected positions"):
            make(x[:, :2], p)
    with pytest.raises(ValueError, match="each number of the shape must be an integer >= 2"):
        Grid(np.zeros(3), np.ones(3), (1, 2, 2))
    with pytest.raises(ValueError, match="lower < upper"):
        Grid(np.ones(3), np.zeros(3), (2, 2, 2))
    with pytest.raises(ValueError, match=r"expected positions \(V, 3\)"):
        Grid(np.zeros(3), np.ones(3), (2, 2, 2)).weights(np.zeros(3))
