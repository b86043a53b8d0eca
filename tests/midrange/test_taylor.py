"""Moments of a cube against derivatives of the texel form, and the polygon's own at a distance."""

import functools
import itertools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cubes import moved, random_cube
from jax.test_util import check_grads
from lights import rectangle, surface_quadrature

from jaxsh.midrange import (
    Polygon,
    RadianceCube,
    Scene,
    capture,
    project_cube,
    project_cube_with_gradient,
    taylor,
)

DEGREE = 3


def powers(d, order):
    return [
        math.prod(d[axis] for axis in axes)
        for k in range(order + 1)
        for axes in itertools.combinations_with_replacement(range(3), k)
    ]


def test_terms_are_the_texel_form_s_derivatives(rng):
    """Two orders by nested forward differentiation; the third is seen in the error below."""
    cube = random_cube(rng)
    terms = taylor(cube, DEGREE, 2).terms
    derivatives = [functools.partial(moved, cube, degree=DEGREE)]
    for _ in range(2):
        derivatives.append(jax.jacfwd(derivatives[-1]))
    zero, start = jnp.zeros(3), 0
    for k, derivative in enumerate(derivatives):
        exact = np.asarray(jax.jit(derivative)(zero))
        for axes in itertools.combinations_with_replacement(range(3), k):
            factorial = math.prod(math.factorial(axes.count(axis)) for axis in range(3))
            part = exact[(..., *axes)] / factorial
            np.testing.assert_allclose(
                terms[..., start], part, rtol=0, atol=1e-14 * np.abs(exact).max()
            )
            start += 1
    assert start == terms.shape[-1] == 10


@pytest.mark.parametrize("order", [pytest.param(1, marks=pytest.mark.slow), 3])
def test_error_falls_with_the_offset_s_power(rng, order):
    cube = random_cube(rng)
    expansion = taylor(cube, DEGREE, order)
    assert expansion.order == order
    terms, errors = np.asarray(expansion.terms), []
    for size in (0.1, 0.05):
        d = size * np.array([0.3, -0.5, 0.4])
        guess = terms @ np.array(powers(d, order))
        errors.append(np.linalg.norm(guess - moved(cube, jnp.asarray(d), DEGREE)))
    assert errors[0] / errors[1] > 0.85 * 2 ** (order + 1)


def test_orders_continue_each_other_and_order_one_is_the_gradient(rng):
    cube = random_cube(rng)
    terms = [taylor(cube, DEGREE, order).terms for order in range(4)]
    for lower, higher in itertools.pairwise(terms):
        np.testing.assert_allclose(higher[..., : lower.shape[-1]], lower, rtol=0, atol=1e-13)
    coefficients, gradient = project_cube_with_gradient(cube, DEGREE, gradient="surface")
    np.testing.assert_array_equal(terms[1][..., 0], coefficients)
    np.testing.assert_array_equal(terms[1][..., 1:], gradient)
    np.testing.assert_array_equal(terms[0][..., 0], project_cube(cube, DEGREE))


def test_a_batch_is_its_cubes(rng):
    cube = random_cube(rng, batch=(2, 1))
    expansion = taylor(cube, DEGREE, 1)
    assert expansion.terms.shape == (2, 1, 3, 16, 4)
    for i in range(2):
        one = taylor(jax.tree.map(lambda a, i=i: a[i, 0], cube), DEGREE, 1)
        np.testing.assert_allclose(expansion.terms[i, 0], one.terms, rtol=0, atol=1e-13)


def test_third_order_beats_the_gradient_away_from_a_real_light():
    polygon = Polygon(rectangle([0.2, 0, 2], [0.6, 0, 0.1], [0, -0.5, 0]), np.array([1.0, 2, 3]))
    point, d = np.array([0.1, -0.1, 0.0]), np.array([0.2, 0.25, 0.3])
    expansion = taylor(capture(Scene([polygon]), jnp.asarray(point), 64, rays="analytic"), 4, 3)
    exact, _ = surface_quadrature(polygon.vertices, polygon.radiance, point + d, 4)
    errors = []
    for order in range(4):
        monomials = np.array(powers(d, order))
        guess = np.asarray(expansion.terms)[..., : len(monomials)] @ monomials
        errors.append(np.linalg.norm(guess - exact) / np.linalg.norm(exact))
    assert all(later < 0.5 * earlier for earlier, later in itertools.pairwise(errors))


def test_texels_at_infinity_edge_on_and_at_the_point_add_nothing_to_derivatives(rng):
    """And leave every derivative of the terms themselves finite."""
    cube = random_cube(rng, sky=0.0)
    odd = np.arange(96) % 4
    distance = jnp.where(odd == 1, jnp.inf, jnp.where(odd == 3, 0, cube.distance))
    offset = jnp.where(odd == 1, -jnp.inf, jnp.where(odd >= 2, 0, cube.plane_distance))
    strange = RadianceCube(cube.radiance, distance, offset, cube.normal, cube.point)
    plain = RadianceCube(
        jnp.where(odd[:, None] == 0, cube.radiance, 0),
        cube.distance,
        cube.plane_distance,
        cube.normal,
        cube.point,
    )
    terms, expected = taylor(strange, DEGREE, 2).terms, taylor(plain, DEGREE, 2).terms
    np.testing.assert_allclose(terms[..., 1:], expected[..., 1:], rtol=0, atol=1e-13)
    np.testing.assert_allclose(terms[..., 0], project_cube(cube, DEGREE), rtol=0, atol=1e-14)
    slopes = jax.grad(lambda cube: jnp.sum(taylor(cube, DEGREE, 2).terms ** 2))(strange)
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(slopes))


def test_a_surface_s_two_normals_are_one(rng):
    cube = random_cube(rng)
    turned = eqx.tree_at(
        lambda c: (c.normal, c.plane_distance), cube, (-cube.normal, -cube.plane_distance)
    )
    np.testing.assert_array_equal(taylor(turned, DEGREE, 2).terms, taylor(cube, DEGREE, 2).terms)


def test_jit_vmap_and_float32(rng):
    cube = random_cube(rng, batch=(2,))
    terms = taylor(cube, 2, 2).terms
    mapped = jax.jit(jax.vmap(lambda cube: taylor(cube, 2, 2).terms))(cube)
    np.testing.assert_allclose(mapped, terms, rtol=0, atol=1e-13)
    single = jax.tree.map(lambda a: a.astype(jnp.float32), cube)
    assert taylor(single, 2, 2).terms.dtype == jnp.float32
    np.testing.assert_allclose(
        taylor(single, 2, 2).terms, terms, rtol=0, atol=1e-5 * np.abs(terms).max()
    )


@pytest.mark.slow
def test_derivatives_in_the_whole_cube(rng):
    cube = random_cube(rng, resolution=1, sky=0.0)

    def terms(radiance, distance, offset, normal):
        return taylor(RadianceCube(radiance, distance, offset, normal, cube.point), 1, 2).terms

    arguments = cube.radiance, cube.distance, cube.plane_distance, cube.normal
    check_grads(terms, arguments, order=1, modes=["fwd", "rev"], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("order", [-1, 4, 1.5, "1"])
def test_refuses_an_unknown_order(unchecked, rng, order):
    with pytest.raises(ValueError, match="order must be 0, 1, 2 or 3"):
        taylor(random_cube(rng), 2, order)


def test_refuses_a_wrong_degree(rng):
    with pytest.raises(ValueError, match="degree must be"):
        taylor(random_cube(rng), -1, 1)
