"""A transfer sampled in the order of a tiling: all of it at once, or a slice of its blocks."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._core.linalg import matmul
from .._core.xla import in_turn, rows_at_once
from ..harmonics import evaluate, rotate
from ..transfer._glossy_kernels import in_steps, rows_of


def places(permutation: Int[np.ndarray, "blocks b"], vertices: int) -> Int[np.ndarray, " v"]:
    """Finds where in a permutation each vertex is; raises `ValueError` where it is of others."""
    place = np.full(max(vertices, permutation.max() + 1), -1, np.int32)
    place[permutation.ravel()] = np.arange(permutation.size, dtype=np.int32)
    if len(place) != vertices or place.min() < 0:
        held = np.count_nonzero(place >= 0)
        raise ValueError(f"expected a tiling of {vertices} vertices, got one of {held}")
    return place


@functools.partial(jax.jit, static_argnames="quantized")
def arrange_all(transfer, tiling, directions, rows, quantized):
    rows, *outline = outlined(transfer, tiling, directions, rows)
    parts = tiling.permutation, tiling.tile
    return *_sampled(transfer.coefficients, parts, rows, quantized), *outline


@jax.jit
def outlined(transfer, tiling, directions, rows):
    """All but the samples, and the weights that these are sums with."""
    turns = _turns(tiling.axes)
    directions = matmul(directions[None], jnp.swapaxes(turns, 1, 2))
    rows = rotate(rows, turns[:, None])
    basis = evaluate(directions, transfer.degree, axis=0)
    order = tiling.permutation.reshape(-1)
    positions, normals = rows_of(transfer.positions[order], transfer.normals[order])
    return rows, directions, basis, positions, normals


def _sampled(coefficients, parts, rows, quantized):
    def sampled(part):
        vertices, tile = part
        some = coefficients.at[vertices].get(mode="promise_in_bounds")
        samples = matmul(rows[tile], some.T)
        return in_steps(samples, 1) if quantized else (samples, jnp.ones_like(samples[:, 0]))

    size = parts[0].shape[1] * coefficients.shape[1] * coefficients.itemsize
    return in_turn(sampled, parts, most=rows_at_once(size))


@functools.partial(jax.jit, static_argnames="size")
def slice_of(coefficients, tiling, rows, start, size):
    parts = (
        jax.lax.dynamic_slice_in_dim(array, start, size)
        for array in (tiling.permutation, tiling.tile)
    )
    return _sampled(coefficients, tuple(parts), rows, True)


def _turns(axes: Float[Array, "tiles 3"]) -> Float[Array, "tiles 3 3"]:
    """Builds rotations that take +z to each axis.

    Duff et al. 2017, "Building an orthonormal basis, revisited".
    """
    x, y, z = axes.T
    sign = jnp.where(z < 0, -1.0, 1.0).astype(axes.dtype)
    a = -1 / (sign + z)
    b = x * y * a
    first = jnp.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    return jnp.stack([first, jnp.stack([b, sign + y * y * a, -y], axis=-1), axes], axis=-1)
