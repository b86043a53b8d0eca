"""A transfer in the order of a tiling, in few numbers: all at once, or a slice of its blocks."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._core.linalg import matmul
from .._core.xla import in_turn, rows_at_once
from ..transfer._glossy_kernels import in_steps, rows_of
from ._sharing import Shared, made_of_rows, on_rows, own
from ._turned import turned

# Along which axis the rows of a device stand in a transfer, a tiling and a rule, and in what
# `outlined` gives beside its weights.
_GIVEN = (0, 0, None, None)
_OUTLINE = (1, 1, 1)


def places(
    permutation: Int[Array | np.ndarray, "blocks b"], vertices: int, shared: Shared | None
) -> Int[Array, " v"]:
    """Finds where in a permutation each vertex is; raises `ValueError` where it is of others."""
    parts = shared.parts if shared else 1
    count = vertices // parts

    def find(part, permutation):
        inside = permutation - part * count
        place = np.full(count, -1, np.int32)
        if inside.min() >= 0 and inside.max() < count:
            place[inside.ravel()] = np.arange(inside.size, dtype=np.int32)
        if place.min() < 0:
            held = len(np.unique(permutation))
            where = " on each device" if parts > 1 else ""
            raise ValueError(f"expected a tiling of {count} vertices{where}, got one of {held}")
        return (place + np.int32(part * inside.size),)

    if len(permutation) % parts:
        raise ValueError(
            f"expected a tiling made of a transfer that {parts} devices share, got "
            f"{len(permutation)} blocks"
        )
    return made_of_rows(find, shared, permutation)[0]


@functools.partial(jax.jit, static_argnames=("quantized", "shared"))
def arrange_all(transfer, tiling, lights, rows, quantized, shared=None):
    def arrange(transfer, tiling, lights, rows):
        rows, *outline = _outlined(transfer, tiling, lights, rows)
        return *_sampled(transfer.coefficients, _own(transfer, tiling), rows, quantized), *outline

    return on_rows(arrange, shared, _GIVEN, (0, 0, *_OUTLINE), transfer, tiling, lights, rows)


@functools.partial(jax.jit, static_argnames="shared")
def outlined(transfer, tiling, lights, rows, shared):
    """All but the samples, and the weights that these are sums with."""
    given = transfer, tiling, lights, rows
    return on_rows(_outlined, shared, _GIVEN, (0, *_OUTLINE), *given)


def _own(transfer, tiling):
    """The vertex at each place and the tile of each block, counted from this device's first."""
    permutation = own(tiling.permutation, transfer.num_points)
    return permutation, own(tiling.tile, len(tiling.axes))


def _outlined(transfer, tiling, lights, rows):
    both = turned(jnp.concatenate([rows, lights]), tiling.axes)
    rows, lights = both[:, : len(rows)], jnp.moveaxis(both[:, len(rows) :], 2, 0)
    order = _own(transfer, tiling)[0].reshape(-1)
    positions, normals = rows_of(transfer.positions[order], transfer.normals[order])
    return rows, lights, positions, normals


def _sampled(coefficients, parts, rows, quantized):
    def sampled(part):
        vertices, tile = part
        some = coefficients.at[vertices].get(mode="promise_in_bounds")
        samples = matmul(rows[tile], some.T)
        return in_steps(samples, 1) if quantized else (samples, jnp.ones_like(samples[:, 0]))

    size = parts[0].shape[1] * coefficients.shape[1] * coefficients.itemsize
    return in_turn(sampled, parts, most=rows_at_once(size))


@functools.partial(jax.jit, static_argnames=("size", "shared"))
def slice_of(transfer, tiling, rows, start, size, shared):
    """The samples of `size` blocks of each device."""

    def sampled(transfer, tiling, rows, start):
        parts = (
            jax.lax.dynamic_slice_in_dim(array, start, size) for array in _own(transfer, tiling)
        )
        return _sampled(transfer.coefficients, tuple(parts), rows, True)

    return on_rows(sampled, shared, (*_GIVEN[:2], 0, None), 0, transfer, tiling, rows, start)


@functools.partial(jax.jit, static_argnames=("starts", "shared"))
def joined(slices, starts, shared):
    """Joins the slices of each device, each from where the one before has ended."""

    def join(slices):
        return jnp.concatenate([one[start:] for one, start in zip(slices, starts, strict=True)])

    return on_rows(join, shared, (0,), 0, slices)


def turns(axes: Float[Array, "tiles 3"]) -> Float[Array, "tiles 3 3"]:
    """Builds rotations that take +z to each axis: about y, then about z."""
    x, y, z = axes.T
    across = jnp.hypot(x, y)
    pole = across == 0
    scale = jnp.where(pole, 1, across)
    cosine, sine = jnp.where(pole, 1, x) / scale, y / scale
    first = jnp.stack([z * cosine, z * sine, -across], axis=-1)
    second = jnp.stack([-sine, cosine, jnp.zeros_like(z)], axis=-1)
    return jnp.stack([first, second, axes], axis=-1)
