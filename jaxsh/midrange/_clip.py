"""Arcs cut by the horizon, and the parts of edges within convex cones and outside of others.

Derived in docs/near_light_polygons.md, "What is seen".
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .._core.xla import in_turn
from ._arcs import Arcs, Rows, Vectors, resting_arcs
from ._vectors import cross, dot, reciprocal, scale, select

# Planes nearer to each other than so many roundings are one plane.
_ONE_PLANE = 32

Number = Float[Array, "..."]


def cut(start: Vectors, end: Vectors, start_side: Array, end_side: Array) -> tuple[Rows, ...]:
    """The part of convex loops (loops, arcs, 3, n) where `side` >= 0, a linear function.

    Sutherland and Hodgman's clip with arcs in any order, so that it is all the same operations
    for all receivers: the arcs keep their parts, the first two results, and one more closes each
    loop, from where it goes out to where it comes in, the second two. What is cut away leaves
    arcs of no length.
    """
    start_in, end_in = start_side >= 0, end_side >= 0
    leaves, enters = start_in & ~end_in, ~start_in & end_in
    share = start_side * reciprocal(start_side - end_side)
    crossing = start + scale(share, end - start)
    kept_start = select(enters, crossing, start)
    kept_end = select(leaves, crossing, select(end_in, end, start))

    def only(mask: Array) -> Rows:
        """The crossing in the mask; the mean where rounding finds two at one corner."""
        count = jnp.sum(mask, axis=1, keepdims=True).astype(share.dtype)
        total = jnp.sum(select(mask, crossing, jnp.zeros_like(crossing)), axis=1, keepdims=True)
        return scale(reciprocal(count), total)

    closed = jnp.any(leaves, axis=1, keepdims=True) & jnp.any(enters, axis=1, keepdims=True)
    out = select(closed, only(leaves), start[:, :1])
    back = select(closed, only(enters), out)
    return kept_start, kept_end, out, back


def clip_horizon(loops: Arcs, normal: Float[Array, "3 n"], orient: Float[Array, "loops n"]) -> Arcs:
    """The part of convex loops above the plane through the receiver with this unit normal.

    `orient` is 1 where a loop runs counter-clockwise, and -1 where it runs clockwise.
    """
    normal = normal[None, None]
    start, end, out, back = cut(
        loops.start, loops.end, dot(normal, loops.start), dot(normal, loops.end)
    )
    closing = resting_arcs(out, back, scale(-orient[:, None], normal))
    rows = zip((start, end, *loops[2:]), closing, strict=True)
    return Arcs(*(jnp.concatenate(pair, axis=1) for pair in rows))


class Edges(NamedTuple):
    """Edges (*edges, 3, n) to be cut by planes.

    `normal`, and normal × start and × end, vectors in the plane of the edge square to its ends.
    """

    normal: Vectors
    start: Vectors
    end: Vectors


def edges_of(arcs: Arcs, axis: int) -> Edges:
    """Prepare edges for `within`, with an axis of length 1 more, for the cones."""
    turned = (cross(arcs.normal, row) for row in (arcs.start, arcs.end))
    return Edges(*(jnp.expand_dims(row, axis) for row in (arcs.normal, *turned)))


def within(
    edges: Edges,
    planes: Float[Array, "planes *any 3 n"],
    along: bool | Bool[Array, "..."],
    against: bool,
) -> tuple[Number, Number]:
    """Find from where to where, low < high as shares of it, an edge is within convex cones.

    `planes` are the cones' outward unit normals, one after the other, whose axes and those of the
    edges broadcast; zeros are none. Both edges of a crossing place it at ±n × outward: so they
    meet, however small the angle between them. An edge that lies in a plane is on that account
    within, or without, as `along` says where its outward normal is the plane's, and `against`
    where it is the opposite.
    """
    limit = (_ONE_PLANE * jnp.finfo(planes.dtype).eps) ** 2
    along = along if isinstance(along, bool) else along[None]
    # The same to the last bit but for the sign, whichever of both planes is the edge's.
    axis = cross(planes, edges.normal[None]) - cross(edges.normal[None], planes)
    same_plane = dot(axis, axis) < 4 * limit
    first, last = dot(axis, edges.start[None]), dot(axis, edges.end[None])  # >= 0 is within
    first_in, last_in = first >= 0, last >= 0
    share = first * reciprocal(first - last)
    here = same_plane & (dot(planes, planes) > 0)
    facing = dot(edges.normal[None], planes) > 0
    without = here & ~((facing & along) | (~facing & against))
    without = without | (~same_plane & ~first_in & ~last_in)
    low = jnp.where(~same_plane & ~first_in & last_in, share, 0)
    high = jnp.where(~same_plane & first_in & ~last_in, share, 1)
    high = jnp.where(jnp.any(without, axis=0), -1, jnp.min(high, axis=0, initial=1))
    return jnp.max(low, axis=0, initial=0), high


def left_over(base: tuple[Number, Number], taken: tuple[Number, Number]) -> tuple[Number, Number]:
    """Find what intervals (c, *any) that may overlap leave of one (*any): c + 1, some empty.

    They begin where the base does or where one ends that is `taken`, and reach to where the next
    begins; those that do not begin there, because another covers it, are empty.
    """
    low, high = base
    begin, end = jnp.maximum(taken[0], low[None]), jnp.minimum(taken[1], high[None])
    some = begin < end
    if len(begin) == 1:
        none = jnp.broadcast_to(high, some[0].shape)
        lows = jnp.broadcast_to(low, none.shape), jnp.where(some, end, none)[0]
        return jnp.stack(lows), jnp.stack([jnp.where(some, begin, none)[0], none])
    order = jnp.arange(len(begin), dtype=jnp.int32).reshape(-1, *(1,) * low.ndim)

    def piece(begins):
        start, number, there = begins
        later = (end > start[None]) | ((end == start[None]) & (order > number))
        covered = jnp.any(some & (begin <= start[None]) & later, axis=0)
        ahead = jnp.where(some & (begin > start[None]), begin, high[None])
        stop = jnp.minimum(jnp.min(ahead, axis=0), high)
        return start, jnp.where(there & ~covered, jnp.maximum(stop, start), start)

    starts = jnp.concatenate([low[None], end])
    numbers = jnp.arange(-1, len(begin), dtype=jnp.int32)
    there = jnp.concatenate([jnp.ones_like(some[:1]), some])
    return in_turn(piece, (starts, numbers, there))
