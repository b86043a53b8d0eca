"""Near light on a mesh of devices: shared out over receivers, vertices, cubes."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cubes import random_cube
from lights import rectangle
from sharding import ROWS, WHOLE, check_sharded

from jaxsh import midrange, transfer

DEGREE = 1
LIGHT = midrange.Polygon(rectangle([0, 0, 2], [0, 1, 0], [1, 0, 0]), np.ones(3))
BLOCKER = midrange.Polygon(rectangle([0.5, 0, 1], [0, 0.4, 0], [0.4, 0, 0]), np.zeros(3))
UP = np.array([0.0, 0, 1])


@pytest.fixture
def points(rng):
    return 0.2 * rng.normal(size=(8, 3))


@pytest.fixture
def expansions(rng):
    return midrange.Expansion(rng.normal(size=(5, 3)), rng.normal(size=(5, 3, 4, 4)))


@pytest.mark.slow
def test_polygon_lights_above_a_horizon_behind_a_blocker(points):
    def light(points):
        return midrange.polygon_harmonics_with_gradient(
            LIGHT, points, DEGREE, horizon=UP, blockers=[BLOCKER]
        )

    check_sharded(light, (points,), (ROWS,), (ROWS, ROWS))


@pytest.mark.slow
def test_a_polygon_light_s_value_and_reverse_mode(points):
    def light(points):
        value, pull = jax.vjp(lambda p: midrange.polygon_harmonics(LIGHT, p, DEGREE), points)
        return value, *pull(value)

    check_sharded(light, (points,), (ROWS,), ROWS)


@pytest.mark.slow
def test_sphere_lights(points):
    ball = midrange.Sphere(np.array([0, 0, 2.0]), np.array(0.5), np.ones(3))

    def light(points):
        alone = midrange.sphere_harmonics(ball, points, DEGREE)
        return alone, *midrange.sphere_harmonics_with_gradient(ball, points, DEGREE)

    check_sharded(light, (points,), (ROWS,), ROWS)


@pytest.mark.slow
def test_analytic_cubes_and_their_derivatives(points):
    scene = midrange.Scene([LIGHT], [BLOCKER])

    def light(points):
        cube = midrange.capture(scene, points, 2, rays="analytic")
        edges = midrange.project_cube_with_gradient(cube, DEGREE, gradient="edges")
        return midrange.taylor(cube, DEGREE, 1), midrange.project_cube(cube, DEGREE), edges

    check_sharded(light, (points,), (ROWS,), ROWS)


def test_cubes_given(rng):
    cube = random_cube(rng, batch=(4,))

    def light(cube):
        surface = midrange.project_cube_with_gradient(cube, DEGREE, gradient="surface")
        return midrange.taylor(cube, DEGREE, 1), surface

    check_sharded(light, (cube,), (ROWS,), ROWS)


def test_surface_integrals(points):
    samples = midrange.surface_samples([LIGHT], 4)

    def light(points):
        alone = midrange.project_surface(samples, points, DEGREE)
        return alone, *midrange.project_surface_with_gradient(samples, points, DEGREE)

    check_sharded(light, (points,), (ROWS,), ROWS)


@pytest.mark.parametrize("weigh", ["inverse", "least squares", "grid"])
def test_interpolation(points, expansions, weigh):
    grid = midrange.Grid(-np.ones(3), np.ones(3), (2, 2, 3))
    if weigh == "grid":
        point, terms = (jnp.concatenate([leaf] * 3)[:12] for leaf in jax.tree.leaves(expansions))
        expansions = midrange.Expansion(point, terms)

    def light(points, expansions):
        weights = {
            "inverse": lambda: midrange.inverse_distance_weights(points, expansions.point),
            "least squares": lambda: midrange.moving_least_squares_weights(
                points, expansions.point
            ),
            "grid": lambda: grid.weights(points),
        }[weigh]()
        return midrange.interpolate(expansions, weights, points)

    check_sharded(light, (points, expansions), (ROWS, WHOLE), ROWS)


def test_extrapolation_and_its_gradient(points, expansions):
    def light(points, expansions):
        one = jax.tree.map(lambda leaf: leaf[0], expansions)
        return midrange.extrapolate(one.truncated(1), points)

    check_sharded(light, (points, expansions), (ROWS, WHOLE), ROWS)


def test_shading(points, expansions, rng):
    arrays = rng.normal(size=(8, 4)), points, points, np.zeros((8, 2), np.int32)
    baked = transfer.Transfer(*map(jnp.asarray, arrays))

    def shade(baked, expansions):
        one = jax.tree.map(lambda leaf: leaf[0], expansions)
        weights = midrange.inverse_distance_weights(baked.positions, expansions.point)
        many = midrange.shade(expansions, baked, 0.5, weights=weights)
        return many, midrange.shade(one, baked, 0.5)

    check_sharded(shade, (baked, expansions), (ROWS, WHOLE), ROWS)


def test_expansions_made_and_their_monomials(rng, points):
    coefficients, gradient = rng.normal(size=(8, 3, 4)), rng.normal(size=(8, 3, 4, 3))
    check_sharded(midrange.make_expansion, (points, coefficients, gradient), (ROWS,) * 3, ROWS)
    monomials = functools.partial(midrange.monomials, order=2)
    check_sharded(monomials, (points,), (ROWS,), ROWS)
    check_sharded(jax.grad(lambda o: monomials(o).sum()), (points,), (ROWS,), ROWS)


def test_visible_weights(points, rng):
    cubes = random_cube(rng, 2, batch=(5,))

    def weigh(points, cubes):
        weights = midrange.inverse_distance_weights(points, cubes.point)
        return midrange.visible_weights(weights, cubes, points).values

    check_sharded(weigh, (points, cubes), (ROWS, WHOLE), ROWS)
