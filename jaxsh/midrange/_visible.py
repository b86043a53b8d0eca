"""A polygon as receivers see it: above the horizon, beside what stands before it."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._core.xla import materialize
from ._arcs import Arcs, Rows, coefficients, coefficients_with_gradient, edge_arcs
from ._vectors import dot, reciprocal, scale, select, unit


class Scene(NamedTuple):
    """Corners of the light and of convex blockers. The horizon, if any, comes with the points."""

    vertices: Float[Array, "n 3"]
    blockers: tuple[Float[Array, "m 3"], ...]


class Plan(NamedTuple):
    """Facts known at trace time. Clips need convex loops; a whole outline may be concave."""

    degree: int
    gradient: bool
    two_sided: bool
    horizon: bool
    triangles: bool


class _Cone(NamedTuple):
    """The part of a blocker before the light: its arcs, their sense, and whether it blocks."""

    arcs: Arcs
    turn: Float[Array, " n"]
    blocks: Array


def seen(
    scene: Scene, point: Float[Array, "3 n"], horizon: Float[Array, "3 n"], plan: Plan
) -> list[Array]:
    """(K, n), and (3, K, n) with the gradient, of the visible part of the light at radiance 1."""
    corners = np.arange(len(scene.vertices), dtype=np.int32)[None]
    if plan.triangles:
        i = corners[0, 1:-1]
        corners = np.stack([np.zeros_like(i), i, i + 1], axis=1)
    loops = _outline(scene.vertices[corners], point)
    if plan.horizon:
        loops = clip_horizon(loops, unit(horizon))
    normal = _normal(scene.vertices)
    height = _height(normal, scene.vertices, point)
    arcs = _visible(loops, [_cone(blocker, point, normal, height) for blocker in scene.blockers])
    if plan.gradient:
        lights = list(coefficients_with_gradient(arcs, plan.degree))
    else:
        lights = [coefficients(arcs.start, arcs.end, arcs.normal, plan.degree)]
    # What is seen from behind comes out negative.
    behind = -1 if plan.two_sided else 0
    side = jnp.where(height < 0, 1, jnp.where(height > 0, behind, 0)).astype(point.dtype)
    sides = (side.reshape((1,) * (light.ndim - 1) + side.shape) for light in lights)
    return [jnp.where(s != 0, s * light, 0) for s, light in zip(sides, lights, strict=True)]


def _visible(loops: Arcs, cones: list[_Cone]) -> Arcs:
    """All arcs of the light outside of the cones.

    Cone by cone: the part of the loops within it is added once more, the other way around. All
    harmonics' integrals, and solid angles, are sums over arcs, and so have it taken away.
    """
    parts = [loops]
    for cone in cones:
        most = max(part.start.shape[1] for part in parts)
        filled = [with_room(part, most - part.start.shape[1]) for part in parts]
        together = jax.tree.map(lambda *rows: jnp.concatenate(rows), *filled)
        hidden = clip_cone(together, cone.arcs, cone.turn)
        end = select(cone.blocks[None, None], hidden.start, hidden.end)
        parts.append(Arcs(hidden.end, end, hidden.normal, hidden.near))
    return jax.tree.map(lambda *rows: jnp.concatenate([_flat(row) for row in rows]), *parts)


def _flat(row: Float[Array, "loops arcs 3 n"]) -> Float[Array, "all 3 n"]:
    return row.reshape(row.shape[0] * row.shape[1], *row.shape[2:])


def _outline(corners: Float[Array, "loops m 3"], point: Float[Array, "3 n"]) -> Arcs:
    start = corners[..., None] - point[None, None]
    return edge_arcs(start, jnp.roll(start, -1, axis=1))


def _normal(vertices: Float[Array, "n 3"]) -> Float[Array, " 3"]:
    """Normal of the length of twice the area, by Newell's formula."""
    spokes = vertices - vertices[:1]
    return jnp.cross(spokes, jnp.roll(spokes, -1, axis=0)).sum(axis=0)


def _height(normal: Float[Array, " 3"], vertices: Array, point: Float[Array, "3 n"]) -> Array:
    """normal · (vertex - point): below zero for points in front."""
    return dot(normal[:, None], vertices[0][:, None] - point)


def _cone(vertices: Array, point: Array, normal: Array, height: Array) -> _Cone:
    """`normal` and `height` are those of the light's plane, behind which nothing blocks."""
    arcs = _outline(vertices[None], point)
    facing = -jnp.sign(height)[None, None]

    def before(rows: Rows) -> Array:
        return (dot(normal[None, None, :, None], rows) - height[None, None]) * facing

    sides = before(arcs.start), before(arcs.end)
    own = _height(_normal(vertices), vertices, point)
    blocks = (own != 0) & jnp.any(sides[0] > 0, axis=(0, 1))
    part = jax.tree.map(_flat, joined(*clip(arcs, *sides)))
    return _Cone(part, -jnp.sign(own), blocks)


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
    # Space for one more arc of each plane: a loop whose body is compiled once.
    return jax.lax.scan(cut, with_room(loops, new), planes)[0]
