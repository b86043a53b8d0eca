"""Fused shading against the light of each vertex, made first."""

import math

import jax
import jax.numpy as jnp
import jax.test_util
import numpy as np
import pytest
from near_light import expand, random_transfer

from jaxsh.geometry import knot
from jaxsh.harmonics import evaluate
from jaxsh.midrange import (
    Expansion,
    Grid,
    extrapolate,
    interpolate,
    inverse_distance_weights,
    shade,
)
from jaxsh.transfer import bake, shade_diffuse


@pytest.mark.parametrize(
    ("count", "dtype"), [*((count, np.float64) for count in (1, 4, 10, 20)), (4, np.float32)]
)
def test_one_sample_shades_like_its_extrapolation(rng, count, dtype):
    transfer = random_transfer(rng, 11, 2, dtype)
    one = Expansion(rng.normal(size=3), rng.normal(size=(3, 4, count)))  # of lower degree
    albedo = rng.uniform(size=(11, 3))
    found = shade(one, transfer, albedo)
    assert found.dtype == dtype
    expected = shade_diffuse(extrapolate(one, transfer.positions), transfer, albedo)
    np.testing.assert_allclose(found, expected, rtol=0, atol=200 * np.finfo(dtype).eps)
    flat = shade(one, transfer, 0.5, rule="none")
    expected = shade_diffuse(one.coefficients, transfer, 0.5)
    np.testing.assert_allclose(flat, expected, rtol=0, atol=200 * np.finfo(dtype).eps)


@pytest.mark.parametrize(
    ("order", "rule"),
    [
        pytest.param(1, "none", marks=pytest.mark.slow),
        pytest.param(1, "full", marks=pytest.mark.slow),
        pytest.param(2, "half", marks=pytest.mark.slow),
    ],
)
def test_samples_shade_like_their_blend(rng, order, rule):
    transfer = random_transfer(rng, 150, 1)
    grid = Grid(np.full(3, -0.4), np.full(3, 0.4), (2, 3, 3))
    x, albedo = transfer.positions, rng.uniform(size=3)
    samples = expand(grid.points, 1, order)
    for weights in (grid.weights(x), inverse_distance_weights(x, grid.points)):
        light = interpolate(samples, weights, x, rule=rule)
        found = shade(samples, transfer, albedo, weights=weights, rule=rule)
        expected = shade_diffuse(light, transfer, albedo)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)


def test_unshadowed_is_ramamoorthi_and_hanrahan(rng):
    mesh = knot(300)
    transfer = bake(mesh, 4, shadows=False)
    light = Expansion(np.zeros(3), rng.normal(size=(3, 25, 4)))
    # λ_l of the clamped cosine, degrees 0 to 4, as printed in their eqs. 8 and 9.
    lambdas = [math.pi, 2 * math.pi / 3, math.pi / 4, 0, -math.pi / 24]
    spread = np.repeat(lambdas, [1, 3, 5, 7, 9])
    basis = np.asarray(evaluate(transfer.normals, 4)) * spread
    each = np.asarray(extrapolate(light, transfer.positions))
    expected = np.einsum("vk,vck->vc", basis, each) / math.pi
    np.testing.assert_allclose(shade(light, transfer, 1.0), expected, rtol=0, atol=1e-5)


def test_shade_is_linear_and_differentiates(rng):
    transfer = random_transfer(rng, 5, 1)
    grid = Grid(np.full(3, -0.6), np.full(3, 0.6), (3, 2, 2))
    terms = jnp.asarray(rng.normal(size=(12, 3, 4, 4)))
    weights = grid.weights(transfer.positions)

    @jax.jit
    def radiance(terms, points):
        return shade(Expansion(points, terms), transfer, 0.5, weights=weights)

    jax.test_util.check_grads(
        radiance, (terms, grid.points), order=1, modes=["fwd", "rev"], eps=1e-6
    )
    both = jax.vmap(radiance, in_axes=(0, None))(jnp.stack([terms, -3 * terms]), grid.points)
    np.testing.assert_allclose(both[1], -3 * both[0], rtol=1e-12, atol=1e-13)


def test_shade_moves_with_its_vertices(rng):
    transfer = random_transfer(rng, 4, 1)
    light = Expansion(np.zeros(3), rng.normal(size=(3, 4, 10)))

    @jax.jit
    def radiance(positions):
        moved = type(transfer)(
            transfer.coefficients, positions, transfer.normals, transfer.neighbors
        )
        return shade(light, moved, 1.0)

    jax.test_util.check_grads(
        radiance, (transfer.positions,), order=1, modes=["fwd", "rev"], eps=1e-6
    )


@pytest.mark.usefixtures("unchecked")
def test_near_shade_errors(rng):
    transfer = random_transfer(rng, 4, 1)
    one = Expansion(np.zeros(3), np.zeros((3, 4, 4)))
    many = Expansion(np.zeros((2, 3)), np.zeros((2, 3, 4, 4)))
    weights = inverse_distance_weights(transfer.positions, many.point)
    for wrong in (
        lambda: shade(many, transfer, 1.0),
        lambda: shade(one, transfer, 1.0, rule="half"),
    ):
        with pytest.raises(ValueError, match="without weights"):
            wrong()
    with pytest.raises(ValueError, match="expansions of 2 samples"):
        shade(one, transfer, 1.0, weights=weights)
    with pytest.raises(ValueError, match="rule must be one of"):
        shade(many, transfer, 1.0, weights=weights, rule="x")  # pyright: ignore
    with pytest.raises(ValueError, match="above the transfer's"):
        shade(Expansion(np.zeros(3), np.zeros((3, 9, 4))), transfer, 1.0)
    with pytest.raises(ValueError, match="expected albedo"):
        shade(one, transfer, np.ones(2))
