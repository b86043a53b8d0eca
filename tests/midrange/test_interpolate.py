"""Expansions, extrapolation, and the rules that blend samples."""

import itertools

import jax
import jax.numpy as jnp
import jax.test_util
import numpy as np
import pytest
from near_light import expand, point_lights

from jaxsh.midrange import (
    Expansion,
    Grid,
    Weights,
    extrapolate,
    interpolate,
    inverse_distance_weights,
    make_expansion,
    monomials,
    moving_least_squares_weights,
)

COUNTS = [1, 4, 10, 20]


def _powers(order):
    return [
        axes
        for q in range(order + 1)
        for axes in itertools.combinations_with_replacement(range(3), q)
    ]


def slow_polynomial(expansion, position):
    """Eq. 14 and its continuation, term by term."""
    d = np.asarray(position) - np.asarray(expansion.point)
    terms = np.asarray(expansion.terms)
    return sum(
        terms[..., i] * np.prod([d[axis] for axis in axes])
        for i, axes in enumerate(_powers(expansion.order))
    )


@pytest.mark.parametrize("order", range(4))
def test_monomials_are_in_their_order(rng, order):
    d = rng.normal(size=(2, 3, 3))
    expected = np.stack([np.prod(d[..., list(axes)], axis=-1) for axes in _powers(order)], axis=-1)
    np.testing.assert_allclose(monomials(jnp.asarray(d), order), expected, rtol=1e-14)


@pytest.mark.parametrize(
    ("count", "dtype"), [*((count, np.float64) for count in COUNTS), (4, np.float32)]
)
def test_extrapolation_is_the_polynomial(rng, count, dtype):
    expansion = Expansion(rng.normal(size=3), rng.normal(size=(3, 4, count)).astype(dtype))
    x = rng.normal(size=(5, 2, 3)).astype(dtype)
    found = extrapolate(expansion, x)
    assert found.dtype == dtype
    expected = np.stack([slow_polynomial(expansion, p) for p in x.reshape(-1, 3)])
    tolerance = 100 * np.finfo(dtype).eps
    np.testing.assert_allclose(found, expected.reshape(5, 2, 3, 4), rtol=0, atol=tolerance)
    at_point = extrapolate(expansion, expansion.point.astype(dtype))
    np.testing.assert_allclose(at_point, expansion.coefficients, rtol=0, atol=tolerance)


def test_extrapolation_of_pairs(rng):
    expansions = Expansion(rng.normal(size=(4, 3)), rng.normal(size=(4, 3, 1, 4)))
    x = rng.normal(size=(5, 1, 3))
    found = extrapolate(expansions, x)
    for i, j in itertools.product(range(5), range(4)):
        one = jax.tree.map(lambda leaf, j=j: leaf[j], expansions)
        np.testing.assert_allclose(found[i, j], slow_polynomial(one, x[i, 0]), rtol=0, atol=1e-13)


@pytest.mark.slow
def test_extrapolation_error_falls_with_its_order():
    step = np.array([0.03, -0.02, 0.01])
    errors, third = [], expand(np.zeros((1, 3)), 2, 3)
    exact = jax.jit(lambda x: point_lights(x, 2))
    for order, count in enumerate(COUNTS):
        one = Expansion(np.zeros(3), third.terms[0, ..., :count])
        near, far = (
            np.abs(extrapolate(one, jnp.asarray(x)) - exact(jnp.asarray(x))).max()
            for x in (step, 2 * step)
        )
        assert np.log2(far / near) == pytest.approx(order + 1, abs=0.35)
        errors.append(near)
    assert np.all(np.diff(errors) < 0)


def test_make_expansion(rng):
    p, c, g = rng.normal(size=(2, 3)), rng.normal(size=(2, 3, 4)), rng.normal(size=(2, 3, 4, 3))
    one = make_expansion(p, c, g)
    assert (one.order, one.degree) == (1, 1)
    np.testing.assert_array_equal(one.coefficients, c)
    np.testing.assert_array_equal(one.gradient, g)
    assert make_expansion(p, c).order == 0


@pytest.mark.parametrize(("rule", "count"), [("none", 4), ("half", 10), ("full", 1), ("full", 20)])
def test_rules_sample_by_sample(rng, rule, count):
    grid = Grid(-np.ones(3), np.ones(3), (2, 3, 3))
    x = rng.uniform(-1.2, 1.2, (7, 3))
    sparse = grid.weights(x)
    assert sparse.indices is not None
    dense = np.zeros((7, 18))
    np.put_along_axis(dense, np.asarray(sparse.indices), np.asarray(sparse.values), axis=1)
    samples = Expansion(grid.points, rng.normal(size=(18, 3, 4, count)))
    k = samples.order
    shares = {
        "none": [1, 0, 0, 0],
        "full": [1, 1, 1, 1],
        "half": [1, k / (k + 1), (k - 1) / (k + 1), (k - 2) / (k + 1)],
    }[rule]
    shares = np.array([shares[len(axes)] for axes in _powers(k)])
    expected = np.zeros((7, 3, 4))
    for v, s in itertools.product(range(7), range(18)):
        one = Expansion(samples.point[s], np.asarray(samples.terms[s]) * shares)
        expected[v] += dense[v, s] * slow_polynomial(one, x[v])
    for weights in (sparse, Weights(jnp.asarray(dense))):
        found = interpolate(samples, weights, x, rule=rule)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)


def _polynomial_light(rng, order, points):
    """Samples, up to `order - 1`, of coefficients that are polynomials of `order`."""
    terms = rng.normal(size=(3, 1, [1, 4, 10, 20][order]))
    everywhere = Expansion(np.zeros(3), terms)
    derivatives = [lambda x: extrapolate(everywhere, x)]
    columns = [extrapolate(everywhere, points)[..., None]]
    for q in range(1, order):
        derivatives.append(jax.jacfwd(derivatives[-1]))
        tensor = jax.jit(jax.vmap(derivatives[q]))(points)
        for axes in itertools.combinations_with_replacement(range(3), q):
            repeated = np.prod([np.prod(range(1, axes.count(a) + 1)) for a in range(3)])
            columns.append(tensor[(..., *axes)][..., None] / repeated)
    return everywhere, Expansion(points, jnp.concatenate(columns, axis=-1))


@pytest.mark.parametrize("order", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_half_rule_is_exact_one_order_above(rng, order):
    x = rng.uniform(-1, 1, (30, 3))
    grid = Grid(-np.ones(3), np.ones(3), (3, 2, 2))
    scattered = jnp.asarray(rng.uniform(-1, 1, (9, 3)))
    for points, weights in (
        (grid.points, grid.weights(x)),
        (scattered, moving_least_squares_weights(x, scattered)),
    ):
        light, samples = _polynomial_light(rng, order, points)
        exact = extrapolate(light, x)
        found = interpolate(samples, weights, x, rule="half")
        np.testing.assert_allclose(found, exact, rtol=0, atol=1e-11)
        full = interpolate(samples, weights, x, rule="full")
        assert np.abs(full - exact).max() > 0.1


def test_full_rule_is_exact_for_its_order(rng):
    x, points = rng.uniform(-1, 1, (9, 3)), rng.uniform(-1, 1, (5, 3))
    light = Expansion(np.zeros(3), rng.normal(size=(3, 4, 4)))
    terms = jnp.concatenate(
        [extrapolate(light, points)[..., None], jnp.tile(light.gradient[None], (5, 1, 1, 1))], -1
    )
    weights = inverse_distance_weights(x, points)
    found = interpolate(Expansion(points, terms), weights, x)
    np.testing.assert_allclose(found, extrapolate(light, x), rtol=0, atol=1e-13)


def test_interpolation_at_samples_is_the_sample(rng):
    points = rng.uniform(-0.4, 0.4, (5, 3)).astype(np.float32)
    samples = expand(points, 1)
    for weights in (
        inverse_distance_weights(points, points, exponent=8.0),
        moving_least_squares_weights(points, points),
    ):
        for rule in ("none", "half", "full"):
            found = interpolate(samples, weights, points, rule=rule)
            np.testing.assert_allclose(found, samples.coefficients, rtol=1e-5, atol=1e-6)


def test_interpolate_transforms(rng):
    points, x = jnp.asarray(rng.uniform(-0.5, 0.5, (4, 3))), jnp.asarray(rng.normal(size=(3, 3)))
    samples = Expansion(points, rng.normal(size=(4, 3, 1, 4)))

    @jax.jit
    def light(terms, x):
        return interpolate(Expansion(points, terms), inverse_distance_weights(x, points), x)

    jax.test_util.check_grads(light, (samples.terms, x), order=1, modes=["fwd", "rev"], eps=1e-6)
    batch = jnp.stack([samples.terms, 2 * samples.terms])
    both = jax.vmap(light, in_axes=(0, None))(batch, x)
    np.testing.assert_allclose(both[1], 2 * light(samples.terms, x), rtol=1e-13)


@pytest.mark.usefixtures("unchecked")
def test_interpolation_errors(rng):
    with pytest.raises(ValueError, match="expected terms"):
        Expansion(np.zeros(3), np.zeros((3, 4, 5)))
    with pytest.raises(ValueError, match="expected point"):
        Expansion(np.zeros((2, 3)), np.zeros((3, 4, 4)))
    with pytest.raises(ValueError, match="coefficients on the last axis"):
        Expansion(np.zeros(3), np.zeros((3, 5, 4)))
    with pytest.raises(ValueError, match="expected gradient"):
        make_expansion(np.zeros(3), np.zeros((3, 4)), np.zeros((3, 4)))
    with pytest.raises(ValueError, match="no gradient"):
        _ = make_expansion(np.zeros(3), np.zeros((3, 4))).gradient
    samples = Expansion(np.zeros((2, 3)), np.zeros((2, 3, 4, 4)))
    with pytest.raises(ValueError, match=r"positions \(\.\.\., 3\)"):
        extrapolate(samples, np.zeros((4, 2)))
    x = np.zeros((4, 3))
    weights = inverse_distance_weights(x, np.ones((3, 3)))
    with pytest.raises(ValueError, match="expansions of 3 samples"):
        interpolate(samples, weights, x)
    weights = inverse_distance_weights(x, np.ones((2, 3)))
    with pytest.raises(ValueError, match="4 positions"):
        interpolate(samples, weights, x[:2])
    with pytest.raises(ValueError, match=r"positions \(V, 3\)"):
        interpolate(samples, weights, np.zeros(3))
    with pytest.raises(ValueError, match="rule must be one of"):
        interpolate(samples, weights, x, rule="third")  # pyright: ignore[reportArgumentType]
