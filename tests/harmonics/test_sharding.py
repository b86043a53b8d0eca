"""Harmonics on a mesh of devices: functions and directions keep their sharding.

`legendre`, `gaunt` and `window` make constants on the host, from nothing that could be sharded.
"""

import jax
import jax.numpy as jnp
import numpy as np
import oracles
import pytest
from jax.sharding import PartitionSpec as P
from sharding import ROWS, WHOLE, check_sharded

from jaxsh import harmonics

SECOND = P(None, "rows")
COUNT = 8


@pytest.mark.parametrize("dtype", [np.float64, pytest.param(np.float32, marks=pytest.mark.slow)])
def test_the_basis_and_its_gradient(dtype, rng):
    def everything(d):
        first = harmonics.evaluate(d, 2, axis=0)
        slope = jax.grad(lambda d: jnp.sum(harmonics.evaluate(d, 2) ** 3))(d)
        return first, *harmonics.evaluate_with_gradient(d, 2), slope

    directions = rng.normal(size=(COUNT, 3)).astype(dtype)
    check_sharded(everything, (directions,), (ROWS,), (SECOND, ROWS, ROWS, ROWS))


def test_the_basis_where_the_second_axis_is_sharded(rng):
    def everything(d):
        last, first = harmonics.evaluate(d, 1), harmonics.evaluate(d, 1, axis=0)
        with_gradient = harmonics.evaluate_with_gradient(d, 1, axis=0)
        return last, first, with_gradient, harmonics.evaluate_with_gradient(d, 1)

    third, fourth = P(None, None, "rows"), P(None, None, None, "rows")
    directions = rng.normal(size=(3, COUNT, 3))
    out = (SECOND, third, (third, fourth), (SECOND, SECOND))
    check_sharded(everything, (directions,), (SECOND,), out)


def test_sums_over_the_basis(rng):
    def everything(one, each, d, second):
        values = harmonics.synthesize(one, d), harmonics.synthesize(each, d)
        slope = jax.grad(lambda c, d: jnp.sum(harmonics.synthesize(c, d) ** 2), (0, 1))(each, d)
        return *values, *slope, harmonics.synthesize(one, second)

    one, each = rng.normal(size=(2, 4)), rng.normal(size=(COUNT, 2, 4))
    arguments = one, each, rng.normal(size=(COUNT, 3)), rng.normal(size=(3, COUNT, 3))
    specs = WHOLE, ROWS, ROWS, SECOND
    check_sharded(everything, arguments, specs, (ROWS, ROWS, ROWS, ROWS, SECOND))


@pytest.mark.slow
def test_rotations(rng):
    def of_functions(f, rotations, angles):
        turned = harmonics.rotate(f, rotations), harmonics.rotate(f, jnp.eye(3))
        return *turned, harmonics.rotate_z(f, angles)

    def of_one(f, rotations, angles):
        turned = harmonics.rotate(f, rotations), harmonics.rotate_z(f, angles)
        return *turned, harmonics.rotation_matrix(rotations, 1)

    f, rotations = rng.normal(size=(COUNT, 9)), oracles.rotations(rng, COUNT)
    angles = rng.normal(size=COUNT)
    check_sharded(of_functions, (f, rotations, angles), (ROWS, ROWS, ROWS), ROWS)
    check_sharded(of_one, (f[0], rotations, angles), (WHOLE, ROWS, ROWS), ROWS)


def test_products_and_kernels(rng):
    def everything(f, g, exponents):
        kernels = harmonics.phong(exponents, 2, normalized=True)
        return (
            harmonics.product(f, g),
            harmonics.product(f, jnp.ones(4)),
            harmonics.triple_integral(f, g, f),
            harmonics.product_matrix(f, 1),
            harmonics.convolve(f, kernels),
            harmonics.convolve(f, harmonics.clamped_cosine(2)),
            harmonics.damping(exponents, 2),
            harmonics.disc(exponents, 2),
            harmonics.softening(exponents / 9, 2),
        )

    f, g, exponents = (
        rng.normal(size=(COUNT, 9)),
        rng.normal(size=(COUNT, 4)),
        rng.uniform(1, 9, COUNT),
    )
    check_sharded(everything, (f, g, exponents), (ROWS, ROWS, ROWS), ROWS)


def test_conversions(rng):
    def everything(light):
        splats = harmonics.convert(light, "jaxsh", "gaussian-splatting")
        return (
            splats,
            harmonics.convert(splats, "gaussian-splatting", "e3nn-norm"),
            harmonics.convert(light, "jaxsh", "unity"),
            harmonics.convert(light, "jaxsh", "pyshtools-4pi"),
        )

    check_sharded(everything, (rng.normal(size=(COUNT, 3, 9)),), (ROWS,), ROWS)


def test_a_large_product_is_one_call(rng):
    """Where one device would take blocks; with a second axis in front, too."""
    f, g = rng.normal(size=(2, 1030, 4)), rng.normal(size=(1030, 4))
    check_sharded(harmonics.product, (f, g), (SECOND, ROWS), SECOND)


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(2, COUNT, 4), pytest.param((COUNT, 4), marks=pytest.mark.slow)])
def test_dering_and_its_gradient(shape, rng):
    def everything(c):
        (clean, strength), pull = jax.vjp(harmonics.dering, c)
        slope = pull((jnp.ones_like(clean), jnp.ones_like(strength)))[0]
        return clean, strength, slope, harmonics.dering(c, of="glossy", exponent=9.0)

    c = rng.normal(size=shape)
    c[..., 0] = np.abs(c[..., 0]) + 0.5
    spec = ROWS if len(shape) == 2 else SECOND
    check_sharded(everything, (c,), (spec,), spec)


def test_no_loop_off_the_cpu():
    """Loops that only a CPU's cache wants are one batched call in the program for a GPU."""

    def loops(f, *shapes):
        arguments = [jax.ShapeDtypeStruct(shape, jnp.float32) for shape in shapes]
        traced = jax.jit(f).trace(*arguments)
        lowered = (traced.lower(lowering_platforms=(p,)).as_text() for p in ("cpu", "cuda"))
        return [text.count("stablehlo.while") for text in lowered]

    def slope(d):
        return jax.grad(lambda d: harmonics.evaluate(d, 2).sum())(d)

    assert loops(slope, (4096, 3)) == [1, 0]
    assert loops(harmonics.product, (4096, 9), (4096, 9)) == [1, 0]
