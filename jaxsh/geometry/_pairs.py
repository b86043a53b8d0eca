"""Rays from each of some origins along each of some directions, for use inside `jit`."""

import math

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ._trace import Trace, met, walk_in_lanes
from ._tree import RayTree


def cast_pairs(
    tree: RayTree,
    origins: Float[Array, "m 3"],
    directions: Float[Array, "d 3"],
    wanted: Bool[Array, "m d"],
    *,
    first: bool,
    lanes: int,
) -> Int[Array, "m d"]:
    """Find the leaf that each wanted ray meets; -1 where it meets none, and for all others.

    Of float32 origins in the tree's frame and directions of unit length. A ray is made where a lane
    takes it, from the numbers of its origin and direction, and those that are not wanted cost
    nothing but their place in the queue.
    """
    size = wanted.size
    queue, count = _queue(wanted)

    def ray_of(at: Int[Array, " L"]) -> tuple[Array, Array, Array]:
        row, column = jnp.divmod(at, len(directions))
        return origins[row].T, directions[column].T, jnp.full(at.shape, math.inf, jnp.float32)

    leaf = walk_in_lanes(tree, ray_of, size, queue, first=first, count=count, lanes=lanes)
    return leaf.reshape(wanted.shape)


def met_along(
    tree: RayTree,
    origin: Float[Array, " 3"],
    directions: Float[Array, "d 3"],
    leaf: Int[Array, " d"],
) -> Trace:
    """Give what `trace` does for the leaves that `cast_pairs` has found for one origin."""
    start = jnp.broadcast_to(origin, directions.shape)
    return met(tree, jnp.concatenate([start, directions], axis=1), leaf)


def _queue(wanted: Bool[Array, "m d"]) -> tuple[Int[Array, " n"], Int[Array, ""]]:
    """Number what is wanted, row by row; gives the numbers, first of n, and how many they are."""
    size = wanted.size
    within = jnp.cumsum(wanted, axis=1, dtype=jnp.int32)
    ends = jnp.cumsum(within[:, -1], dtype=jnp.int32)
    number = jnp.arange(size, dtype=jnp.int32)
    turn = (within + (ends - within[:, -1])[:, None]).reshape(-1) - 1
    # What is dropped has a place of its own beyond the end, so that no two write to one.
    place = jnp.where(wanted.reshape(-1), turn, size + number)
    queue = jnp.zeros(size, jnp.int32).at[place].set(number, mode="drop", unique_indices=True)
    return queue, ends[-1]
