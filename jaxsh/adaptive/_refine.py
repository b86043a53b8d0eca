"""Regions of interest, grown and smoothed along the edges of the mesh (Lee & Kim 2014, §4.4)."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int


def grow(
    region: Bool[Array, " v"],
    neighbors: Int[Array, "v n"],
    joins: Callable[[Bool[Array, " v"]], Bool[Array, " v"]],
    rings: int,
) -> Bool[Array, " v"]:
    """A breadth-first search outwards from a region, for at most so many rings.

    Each ring is what borders on the region and was not looked at before; `joins` says which of it
    joins. The search ends early where nothing does.
    """

    def ring(carry):
        count, region, seen, _ = carry
        fringe = jnp.any(region[neighbors], axis=1) & ~seen
        joined = joins(fringe) & fringe
        return count + 1, region | joined, seen | fringe, jnp.any(joined)

    def more(carry):
        return carry[-1] & (carry[0] < rings)

    start = jnp.asarray(0, jnp.int32), region, region, jnp.any(region)
    return jax.lax.while_loop(more, ring, start)[1]


def smooth(
    added: Float[Array, "3 v"], region: Bool[Array, " v"], neighbors: Int[Array, "v n"]
) -> Float[Array, "3 v"]:
    """What a region adds to the base, faded out over two rings around it (figure 7).

    In breadth-first order each vertex of a ring takes the mean over all its neighbours, so that
    the second ring sees the first one's new values.
    """
    real = neighbors != jnp.arange(len(neighbors), dtype=neighbors.dtype)[:, None]
    valence = jnp.maximum(jnp.sum(real, axis=1), 1).astype(added.dtype)[None]
    for _ in range(2):
        ring = jnp.any(region[neighbors], axis=1) & ~region
        mean = jnp.sum(jnp.where(real[None], added[:, neighbors], 0.0), axis=-1) / valence
        added = jnp.where(ring[None], mean, added)
        region = region | ring
    return added
