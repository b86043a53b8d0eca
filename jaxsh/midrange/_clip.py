"""What of a light is seen: loops of arcs cut by planes through the receiver."""

import jax
import jax.numpy as jnp
from jaxtyping import Array

from .._core.xla import materialize
from ._arcs import Arcs, Rows, edge_arcs
from ._vectors import dot, reciprocal, scale, select


def clip(loops: Arcs, start_side: Array, end_side: Array, plane: tuple[Rows, Rows] | None = None):
    """The part of convex loops (loops, arcs, 3, receivers) where `side` >= 0, a linear function.

    Sutherland and Hodgman's clip with arcs in any order, so that it is all the same operations
    for all receivers: the arcs keep their parts, the first result, and one more closes each loop,
    from where it goes out to where it comes in, the second. That has the normal and `near` of
    `plane`, or those of the edge that it is, at rest in space. What is cut away leaves arcs of no
    length.
    """
    start_in, end_in = start_side >= 0, end_side >= 0
    leaves, enters = start_in & ~end_in, ~start_in & end_in
    share = start_side * reciprocal(start_side - end_side)
    crossing = loops.start + scale(share, loops.end - loops.start)
    start = select(enters, crossing, loops.start)
    end = select(leaves, crossing, select(end_in, loops.end, loops.start))

    def only(mask: Array) -> Rows:
        """The crossing in the mask; the mean where rounding finds two at one corner."""
        count = jnp.sum(mask, axis=1, keepdims=True).astype(share.dtype)
        total = jnp.sum(select(mask, crossing, jnp.zeros_like(crossing)), axis=1, keepdims=True)
        return scale(reciprocal(count), total)

    closed = jnp.any(leaves, axis=1, keepdims=True) & jnp.any(enters, axis=1, keepdims=True)
    out = select(closed, only(leaves), loops.start[:, :1])
    back = select(closed, only(enters), out)
    kept = Arcs(start, end, loops.normal, loops.near)
    if plane is None:
        return kept, edge_arcs(out, back)
    return kept, Arcs(out, back, *(jnp.broadcast_to(rows, out.shape) for rows in plane))


def joined(*loops: Arcs) -> Arcs:
    """All arcs of all."""
    return Arcs(*(jnp.concatenate(rows, axis=1) for rows in zip(*loops, strict=True)))


def with_room(loops: Arcs, count: int) -> Arcs:
    """So many arcs of no length more."""
    shape = len(loops.end), count, *loops.end.shape[2:]
    end, normal, near = (
        jnp.broadcast_to(rows[:, -1:], shape) for rows in (loops.end, loops.normal, loops.near)
    )
    return joined(loops, Arcs(end, end, normal, near))


def clip_horizon(loops: Arcs, normal: Rows) -> Arcs:
    """The part above the plane through the receiver with this unit normal, (3, receivers)."""
    normal = normal[None, None]
    plane = -normal, jnp.zeros_like(normal)
    return joined(
        *materialize(clip, loops, dot(normal, loops.start), dot(normal, loops.end), plane)
    )


def clip_cone(loops: Arcs, cone: Arcs, turn: Array) -> Arcs:
    """The part within a convex cone, given by its arcs (arcs, 3, receivers).

    `turn` (receivers,) is 1 where they go counter-clockwise around it, and -1 where clockwise.
    """
    present, new = loops.start.shape[1], len(cone.start)

    def cut(loops, plane):
        i, outward, near = plane
        sides = -dot(outward, loops.start), -dot(outward, loops.end)
        kept, closing = materialize(clip, loops, *sides, (outward, near))
        put = jax.lax.dynamic_update_slice_in_dim
        return jax.tree.map(lambda a, b: put(a, b, present + i, axis=1), kept, closing), None

    outward = scale(turn[None], cone.normal)
    planes = jnp.arange(new, dtype=jnp.int32), outward[:, None, None], cone.near[:, None, None]
    # Room for the one more arc of each plane: a loop whose body is compiled once.
    return jax.lax.scan(cut, with_room(loops, new), planes)[0]
