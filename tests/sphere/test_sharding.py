"""The sphere on a mesh of devices: sharded over directions, normals, pixels or functions.

The quadratures make constants, from nothing that could be sharded.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.sharding import PartitionSpec as P
from sharding import ROWS, WHOLE, check_sharded

from jaxsh import sphere

SECOND = P(None, "rows")
COUNT = 8
SUM = {"all-reduce": "each device sums its own directions, and all sums are added"}


def summed(function):
    """`function`, whose result is a sum over what each device has, inside `shard_map`."""
    return lambda *arguments: jax.lax.psum(function(*arguments), "rows")


def project(values, directions, weights):
    return sphere.project(values, sphere.Quadrature(directions, weights), 2)


@pytest.mark.parametrize("count", [2050])  # in one call, where one device would take blocks
def test_samples_over_directions(count, rng):
    """Sums over directions stay where these are, and one sum over the devices follows."""
    values, weights = rng.normal(size=(2, count)), rng.uniform(1, 2, count)
    samples = values, rng.normal(size=(count, 3)), weights
    specs = SECOND, ROWS, ROWS
    check_sharded(project, samples, specs, WHOLE, mapped=summed(project), exchange=SUM)


def test_a_quadrature_filled_up_for_two_devices(rng):
    quadrature = sphere.Quadrature(rng.normal(size=(33, 3)), rng.uniform(1, 2, 33))
    values = rng.normal(size=(2, 33))
    shared = quadrature.sharded(jax.devices()[:2])
    filled = np.concatenate([values, np.full((2, 1), 7.0)], axis=1)  # counts nothing
    found = sphere.project(filled, shared, 2)
    expected = sphere.project(values, quadrature, 2)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)
    assert len(shared.weights.sharding.device_set) == 2


def test_samples_of_many_functions(rng):
    directions, weights = rng.normal(size=(5, 3)), rng.uniform(1, 2, 5)
    arguments = rng.normal(size=(COUNT, 5)), directions, weights
    check_sharded(project, arguments, (ROWS, WHOLE, WHOLE), ROWS)


@pytest.mark.slow
def test_gradient_of_project(rng):
    def pulled(values, directions, weights, pull):
        def loss(*samples):
            return jnp.sum(pull * project(*samples))

        return jax.grad(loss, (0, 1))(values, directions, weights)

    values, weights = rng.normal(size=(2, COUNT)), rng.uniform(1, 2, COUNT)
    arguments = values, rng.normal(size=(COUNT, 3)), weights, rng.normal(size=(2, 9))
    check_sharded(pulled, arguments, (SECOND, ROWS, ROWS, WHOLE), (SECOND, ROWS))


def test_values_at_directions(rng):
    def everything(c, directions):
        slope = jax.grad(lambda d: jnp.sum(sphere.reconstruct(c, d) ** 2))(directions)
        return sphere.reconstruct(c, directions), slope

    c = rng.normal(size=(2, 4))
    many = rng.normal(size=(2050, 3))  # in one call, where one device would take blocks
    check_sharded(everything, (c, many), (WHOLE, ROWS), (SECOND, ROWS))
    functions = rng.normal(size=(COUNT, 3, 9))
    at = rng.normal(size=(5, 3))
    check_sharded(sphere.reconstruct, (functions, at), (ROWS, WHOLE), ROWS)


def test_irradiance_of_a_shared_light(rng):
    def everything(light, normals):
        batch = jnp.stack([light, 2 * light])[:, None]
        slope = jax.grad(lambda n: jnp.sum(sphere.irradiance(light, n) ** 2))(normals)
        one = sphere.irradiance(light[0], normals)
        return sphere.irradiance(light, normals), one, slope, sphere.irradiance(batch, normals)

    arguments = rng.normal(size=(3, 9)), rng.normal(size=(COUNT, 3))
    check_sharded(everything, arguments, (WHOLE, ROWS), (ROWS, ROWS, ROWS, SECOND))
    grid = rng.normal(size=(2, COUNT, 3))
    check_sharded(sphere.irradiance, (arguments[0], grid), (WHOLE, SECOND), SECOND)


@pytest.mark.slow
def test_irradiance_of_a_light_for_each_normal(rng):
    def everything(lights, normals):
        def loss(*arguments):
            return jnp.sum(sphere.irradiance(*arguments) ** 2)

        return sphere.irradiance(lights, normals), jax.grad(loss, (0, 1))(lights, normals)

    arguments = rng.normal(size=(COUNT, 3, 9)), rng.normal(size=(COUNT, 3))
    check_sharded(everything, arguments, (ROWS, ROWS), ROWS)


def test_pictures(rng):
    image = rng.normal(size=(6, 12, 2))

    def channels(image, c):
        return sphere.project_lat_long(image, 2), jnp.moveaxis(
            sphere.reconstruct_lat_long(c, 6, 12), -1, 0
        )

    # By channel, and by columns, over which each device sums its own. Not in `shard_map`, where a
    # part of a picture passes for a picture of its own.
    c = rng.normal(size=(2, 9))
    check_sharded(channels, (image, c), (P(None, None, "rows"), ROWS), ROWS)
    for spec in (ROWS, SECOND):
        project = functools.partial(sphere.project_lat_long, degree=2)
        check_sharded(project, (image,), (spec,), WHOLE, mapped=False, exchange=SUM)


def test_suns(rng):
    suns = sphere.Suns(rng.normal(size=(4, 3)), rng.uniform(0.01, 0.1, 4), rng.normal(size=(4, 3)))
    turn = np.eye(3)[[1, 2, 0]]

    def everything(suns, turn):
        return suns.rotate(turn).harmonics(1), suns.rays(3), suns.rotate(turn).direction

    def mapped(*arguments):
        light, *rest = everything(*arguments)
        return jax.lax.psum(light, "rows"), *rest

    out = WHOLE, ROWS, ROWS
    check_sharded(everything, (suns, turn), (ROWS, WHOLE), out, mapped=mapped, exchange=SUM)


def test_no_loop_off_the_cpu():
    """Loops that only a CPU's cache wants are one batched call in the program for a GPU."""

    def loops(f, *shapes):
        arguments = [jax.ShapeDtypeStruct(shape, jnp.float32) for shape in shapes]
        traced = jax.jit(f).trace(*arguments)
        lowered = (traced.lower(lowering_platforms=(p,)).as_text() for p in ("cpu", "cuda"))
        return [text.count("stablehlo.while") for text in lowered]

    count = 512 * 256
    assert loops(project, (3, count), (count, 3), (count,)) == [1, 0]
    assert loops(sphere.reconstruct, (3, 121), (count, 3)) == [1, 0]
    assert loops(sphere.irradiance, (3, 121), (count, 3)) == [1, 0]
    # Where the basis would take gigabytes, in blocks as large as 256 MB of it.
    assert loops(sphere.reconstruct, (3, 121), (64 * count, 3)) == [1, 1]
