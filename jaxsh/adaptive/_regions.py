"""Regions of interest: who stays, how a region grows and fades, and work on its vertices alone."""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Shaped

from .._core.xla import block_by_block, equal_blocks, on_mesh, rows_at_once

# Vertices per pass on a CPU: what they need stays in cache.
BLOCK = 1024
# Bytes of what a vertex takes on the way, at most: some 350 samples, or rows of the light's matrix.
_SIZE = 4096
# Shares of all vertices that an accelerator computes: the least that holds the active ones.
_SHARES = (16, 4, 1)
_ROW = 256


# From the numbers of some vertices, or None for all of them in their order.
Work = Callable[[Int[Array, " block"] | None], Float[Array, "rows block"]]


def everywhere(work: Work, count: int, *, whole: bool = False) -> Float[Array, "rows v"]:
    """Calls `work` on the numbers of all vertices, block by block on one CPU, else on all at once.

    With `whole` it is called on all anyhow.
    """
    if whole or count <= BLOCK:
        return work(None)
    again, most = jax.checkpoint(work), rows_at_once(_SIZE)

    def at_once(numbers):
        if count <= most:
            return again(None)
        return block_by_block(again, numbers, size=equal_blocks(count, most), out=1)

    def by_block(numbers):
        return block_by_block(again, numbers, size=BLOCK, out=1)

    numbers = jnp.arange(count, dtype=jnp.int32)
    return jax.lax.platform_dependent(numbers, cpu=by_block, default=at_once)


def compacted(work: Work, active: Bool[Array, " v"]) -> Float[Array, "rows v"]:
    """Calls `work` on the numbers of the active vertices; zero for all others.

    Their numbers are gathered by a running count. On one CPU they are taken block by block, and
    blocks past the last one are skipped. On an accelerator they are taken at once: the least of a
    few shares of all vertices that holds them, which is no more than four times the work, or a
    sixteenth of that for all. So any number of vertices takes the same program, and what is
    skipped costs next to nothing. A loop of so many trips could not be differentiated in reverse;
    one that skips can.
    """
    count = active.shape[0]
    place = _running_count(active) - 1
    # Past the end where not active, and so dropped.
    numbers = jnp.zeros(count, jnp.int32).at[jnp.where(active, place, count)]
    numbers = numbers.set(jnp.arange(count, dtype=jnp.int32), mode="drop")

    def by_block(numbers, place):
        @jax.checkpoint
        def block(order, rows):
            like = jax.eval_shape(work, rows)
            return jax.lax.cond(
                order[0] <= place[-1], work, lambda _: jnp.zeros(like.shape, like.dtype), rows
            )

        order = jnp.arange(count, dtype=jnp.int32)
        return block_by_block(block, order, numbers, size=BLOCK, out=1)

    def by_share(numbers, place):
        def share(size, numbers):
            blocks = equal_blocks(size, rows_at_once(_SIZE))
            done = block_by_block(jax.checkpoint(work), numbers[:size], size=blocks, out=1)
            return jnp.pad(done, ((0, 0), (0, count - size)))

        sizes = sorted({-(-count // part) for part in _SHARES})
        enough = jnp.sum(jnp.asarray(sizes, jnp.int32) <= place[-1], dtype=jnp.int32)
        return jax.lax.switch(enough, [functools.partial(share, size) for size in sizes], numbers)

    if on_mesh(active):
        flat = by_share(numbers, place)
    else:
        flat = jax.lax.platform_dependent(numbers, place, cpu=by_block, default=by_share)
    values = flat.at[:, jnp.maximum(place, 0)].get(mode="promise_in_bounds")
    return jnp.where(active[None], values, 0.0)


def _running_count(active: Bool[Array, " v"]) -> Int[Array, " v"]:
    """Sums cumulatively, row by row of a square, which takes fewer steps than all in one."""
    count = active.shape[0]
    rows = jnp.pad(active, (0, -count % _ROW)).reshape(-1, _ROW)
    along = jnp.cumsum(rows, axis=1, dtype=jnp.int32)
    before = jnp.cumsum(along[:, -1]) - along[:, -1]
    return (along + before[:, None]).reshape(-1)[:count]


class Region(NamedTuple):
    """Holds one kind of lighting on its way through the levels, for V vertices."""

    added: Float[Array, "3 v"]  # to the base, and shown
    degree: Int[Array, " v"]  # that is shown
    active: Bool[Array, " v"]  # still inside
    fractions: Float[Array, " levels"]  # of vertices inside after each level

    @staticmethod
    def start(base: int, count: int, dtype) -> "Region":
        """Start with everyone inside."""
        return Region(
            added=jnp.zeros((3, count), dtype),
            degree=jnp.full(count, base, jnp.int32),
            active=jnp.ones(count, bool),
            fractions=jnp.zeros(0, dtype),
        )


def decide(
    region: Region,
    level: int,
    change: Float[Array, "3 v"],
    threshold: Float[Array, " v"],
    albedo: Float[Array, "3 v"],
    fallback: str,
) -> Region:
    """Keeps those whose accumulated change, as it is seen, reaches the threshold.

    Lee & Kim 2014, algorithm 1.
    """
    change = region.added + jnp.where(region.active[None], change, 0.0)
    stays = region.active & seen_as_changed(change, threshold, albedo)
    shown = region.active if fallback == "level" else stays
    return Region(
        added=jnp.where(shown[None], change, region.added),
        degree=jnp.where(shown, jnp.asarray(level, jnp.int32), region.degree),
        active=stays,
        fractions=jnp.append(region.fractions, jnp.mean(stays, dtype=change.dtype)),
    )


def seen_as_changed(change, threshold, albedo) -> Bool[Array, " v"]:
    """Compares the largest change over the channels, times albedo, with the threshold."""
    red, green, blue = jnp.abs(change * albedo)
    return jnp.maximum(jnp.maximum(red, green), blue) >= threshold


def grow(
    region: Bool[Array, " v"],
    neighbors: Int[Array, "v n"],
    joins: Callable[[Bool[Array, " v"]], Bool[Array, " v"]],
    rings: int,
    names: Any = None,
) -> Bool[Array, " v"]:
    """Searches breadth-first outwards from a region, for at most so many rings (§4.4).

    Each ring is what borders on the region and was not looked at before; `joins` says which of it
    joins. The search ends early where nothing does. `names` are of the axes of a mesh that share
    the vertices out, inside `shard_map`: in each ring all devices learn who is inside.
    """

    def ring(carry):
        count, region, seen, _ = carry
        fringe = jnp.any(_of_all(region, names)[neighbors], axis=1) & ~seen
        joined = joins(fringe) & fringe
        return count + 1, region | joined, seen | fringe, someone(joined)

    def someone(region):
        found = jnp.any(region)
        return found if names is None else jax.lax.pmax(found.astype(jnp.int32), names) > 0

    def more(carry):
        return carry[-1] & (carry[0] < rings)

    start = jnp.asarray(0, jnp.int32), region, region, someone(region)
    return jax.lax.while_loop(more, ring, start)[1]


def _of_all(values: Shaped[Array, "... v"], names: Any) -> Shaped[Array, "... w"]:
    """Values of the vertices of all devices, in their order."""
    if names is None:
        return values
    return jax.lax.all_gather(values, names, axis=values.ndim - 1, tiled=True)


def smooth(
    added: Float[Array, "3 v"],
    region: Bool[Array, " v"],
    neighbors: Int[Array, "v n"],
    names: Any = None,
) -> Float[Array, "3 v"]:
    """Fades out what a region adds to the base, over two rings around it (figure 7).

    In breadth-first order each vertex of a ring takes the mean over all its neighbors, so that
    the second ring sees the first one's new values. `names` as for `grow`: what is added goes to
    all devices too, twice.
    """
    numbers = jnp.arange(len(neighbors), dtype=neighbors.dtype)
    if names is not None:
        numbers = numbers + jax.lax.axis_index(names).astype(numbers.dtype) * len(numbers)
    real = neighbors != numbers[:, None]
    valence = jnp.maximum(jnp.sum(real, axis=1), 1).astype(added.dtype)[None]
    for _ in range(2):
        ring = jnp.any(_of_all(region, names)[neighbors], axis=1) & ~region
        near = _of_all(added, names)[:, neighbors]
        mean = jnp.sum(jnp.where(real[None], near, 0.0), axis=-1) / valence
        added = jnp.where(ring[None], mean, added)
        region = region | ring
    return added
