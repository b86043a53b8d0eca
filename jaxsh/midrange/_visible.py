"""A polygon as receivers see it: above the horizon, beside what stands before it."""

import functools
import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .._core.xla import as_one, materialize
from ._arcs import Arcs, coefficients, coefficients_with_gradient, edge_arcs
from ._clip import clip_horizon, cut, edges_of, left_over, within
from ._vectors import close_dot, cross, difference, dot, scale, select, unit


class Scene(NamedTuple):
    """Corners of the light and of convex blockers, the last repeated where they have fewer.

    `plane` is the light's unit normal, rounded, and what the rounding leaves. The horizon, if
    any, comes with the points.
    """

    vertices: Float[Array, "n 3"]
    plane: Float[Array, "2 3"]
    blockers: Float[Array, "b m 3"]


class Plan(NamedTuple):
    """Facts known at trace time. Clips need convex loops; a whole outline may be concave."""

    degree: int
    gradient: bool
    two_sided: bool
    horizon: bool
    triangles: bool
    in_front: bool  # whether all of all blockers is in front of the light's plane


def seen(
    plan: Plan, scene: Scene, point: Float[Array, "3 n"], horizon: Float[Array, "3 n"]
) -> list[Array]:
    """(K, n), and (K, 3, n) with the gradient, of the visible part of the light at radiance 1."""
    arcs, apex, ahead, active = as_one(functools.partial(_boundary, plan), scene, point, horizon)
    if plan.gradient:
        lights = coefficients_with_gradient(arcs, apex, active, plan.degree)
    else:
        lights = [coefficients(arcs, apex, active, plan.degree)]

    def on_side(ahead, *lights):
        # What is seen from behind comes out negative.
        behind = -1 if plan.two_sided else 0
        side = jnp.where(ahead < 0, 1, jnp.where(ahead > 0, behind, 0)).astype(ahead.dtype)
        sides = (side.reshape((1,) * (light.ndim - 1) + side.shape) for light in lights)
        return [jnp.where(s != 0, s * light, 0) for s, light in zip(sides, lights, strict=True)]

    return materialize(on_side, ahead, *lights)


def _boundary(
    plan: Plan, scene: Scene, point: Float[Array, "3 n"], horizon: Float[Array, "3 n"]
) -> tuple[Arcs, Float[Array, "3 n"], Float[Array, " n"], Bool[Array, " arcs"] | None]:
    """The arcs around what is seen, an apex, 1 for points behind the light, and arcs that count."""
    corners = np.arange(len(scene.vertices), dtype=np.int32)[None]
    if plan.triangles:
        i = corners[0, 1:-1]
        corners = np.stack([np.zeros_like(i), i, i + 1], axis=1)
    height = materialize(_height, scene, point)
    ahead = jnp.sign(height)  # 1 for points behind: the plane's normal points away from them
    apex = scale(ahead, scene.plane[0][:, None])
    loops = _outline(scene.vertices[corners], point)
    turns = jnp.sign(dot(_area(scene.vertices[corners]), scene.plane[:1, :, None]))
    orient = -turns * ahead[None]
    if plan.horizon:
        loops = clip_horizon(loops, unit(horizon), orient)
    arcs, active = _flat(loops), None
    if len(scene.blockers):
        arcs, active = _beside_blockers(scene, loops, orient, ahead, point, plan)
    return arcs, apex, ahead, active


def _beside_blockers(
    scene: Scene,
    loops: Arcs,
    orient: Float[Array, "loops n"],
    ahead: Float[Array, " n"],
    point: Float[Array, "3 n"],
    plan: Plan,
) -> tuple[Arcs, Bool[Array, " arcs"] | None]:
    """All arcs of the light outside of the blockers' cones, and which of them anybody has.

    Parts of the light's edges outside of all cones, and the other way around parts of the
    blockers' edges within the light and outside of all other cones: the boundary of what the
    union of the blockers leaves. Where two edges lie in one plane with the receiver, both bound
    nothing if what is seen is on neither side of it, and otherwise that of the light or of the
    first blocker does.
    """
    count = len(scene.blockers)
    edges, blocks, turn = _blockers(scene, ahead, point, plan)  # (b, m, 3, n) and (b, n)
    outward = scale(turn[:, None], edges.normal)
    cones = jnp.moveaxis(outward, 1, 0)  # one plane after the other

    def hidden(part, own=None):
        """The intervals of those that block, with their axis first."""
        low, high = part
        there = blocks if own is None else blocks[None, None] & own
        low = jnp.where(there, low, 1)
        return jnp.moveaxis(low, -2, 0), jnp.moveaxis(jnp.where(there, high, 0), -2, 0)

    zero = jnp.zeros_like(loops.start[..., 0, :])
    walls = scale(orient[:, None], loops.normal)
    shadow = within(edges_of(loops._replace(normal=walls), 2), cones[:, None, None], True, False)
    lit = left_over((zero, zero + 1), hidden(shadow))
    # Of each edge of a blocker the part within each convex loop of the light, (b, m, loops, n).
    walls = jnp.moveaxis(walls, 1, 0)[:, None, None]
    outwards = edges_of(edges._replace(normal=outward), 2)
    low, high = within(outwards, walls, False, False)
    high = jnp.where(blocks[:, None, None], high, -1)
    base = low, jnp.maximum(low, high)
    if count > 1:
        number = np.arange(count)
        later = jnp.asarray(number[:, None] > number[None])[:, None, :, None]
        other = jnp.asarray(number[:, None] != number[None])[:, None, :, None]
        part = hidden(within(outwards, cones[:, None, None], later, True), other)
        base = left_over(base, (part[0][:, :, :, None], part[1][:, :, :, None]))
    else:
        base = base[0][None], base[1][None]
    flip = (orient[None] * turn[:, None] > 0)[None, :, None]
    edges = jax.tree.map(lambda row: row[None, :, :, None], edges)
    parts = [
        _parts(jax.tree.map(lambda row: row[None], loops), lit, None),
        _parts(edges, base, flip),
    ]
    active = [_flat_rows(high > low, 1).any(axis=-1) for low, high in (lit, base)]
    # Beside one blocker there is too little to leave out.
    together = jax.tree.map(lambda *rows: jnp.concatenate(rows), *parts)
    return together, jnp.concatenate(active) if count > 1 else None


def _parts(arcs: Arcs, share: tuple[Array, Array], flip: Bool[Array, "..."] | None) -> Arcs:
    """Cut arcs from share to share, all in one axis, turned around where `flip`."""
    first, last = (scale(1 - t, arcs.start) + scale(t, arcs.end) for t in share)
    normal = jnp.broadcast_to(arcs.normal, first.shape)
    if flip is not None:
        first, last = select(flip, last, first), select(flip, first, last)
        normal = scale(jnp.where(flip, -1, 1).astype(normal.dtype), normal)
    line, near = (jnp.broadcast_to(row, first.shape) for row in (arcs.line, arcs.near))
    return _flat(Arcs(first, last, normal, line, near))


def _flat(arcs: Arcs) -> Arcs:
    return jax.tree.map(lambda row: _flat_rows(row, 2), arcs)


def _flat_rows(row: Array, kept: int) -> Array:
    """All axes but the last few as one; there may be no receivers."""
    return row.reshape(math.prod(row.shape[:-kept]), *row.shape[-kept:])


def _outline(corners: Float[Array, "loops m 3"], point: Float[Array, "3 n"]) -> Arcs:
    first = corners[..., None]
    return edge_arcs(first, jnp.roll(first, -1, axis=1), point[None, None])


def _area(corners: Float[Array, "loops m 3"]) -> Float[Array, "loops 3 1"]:
    """Normals of the length of twice the area, by Newell's formula."""
    spokes = (corners - corners[:, :1])[..., None]
    return jnp.sum(cross(spokes, jnp.roll(spokes, -1, axis=1)), axis=1)


def _height(scene: Scene, point: Float[Array, "3 n"]) -> Float[Array, " n"]:
    """normal · (vertex - point): below zero for points in front. Only its sign is wanted."""
    way, rest = difference(scene.vertices[0][:, None], point)
    normal, left = (row[:, None] for row in scene.plane)
    return jax.lax.stop_gradient(close_dot(normal, way) + (dot(left, way) + dot(normal, rest)))


def _blockers(
    scene: Scene, ahead: Float[Array, " n"], point: Float[Array, "3 n"], plan: Plan
) -> tuple[Arcs, Bool[Array, "b n"], Float[Array, "b n"]]:
    """Their edges, whether they block, and 1 where they are seen counter-clockwise, else -1.

    Only the part on the receiver's side of the light's plane blocks.
    """
    first = scene.blockers[..., None]  # (b, m, 3, 1)
    second = jnp.roll(first, -1, axis=1)
    own = dot(_area(scene.blockers), first[:, 0] - point[None])
    blocks = own != 0
    if not plan.in_front:
        normal = scene.plane[None, None, 0, :, None]
        side = dot(normal, first - scene.vertices[0].reshape(1, 1, 3, 1))
        sides = side, jnp.roll(side, -1, axis=1)

        def before(facing):
            start, end, out, back = cut(first, second, *(facing * side for side in sides))
            there = jnp.any(facing * side > 0, axis=1)
            starts, ends = (jnp.concatenate(x, axis=1) for x in ((start, out), (end, back)))
            return starts, ends, there

        parts = before(1)
        if plan.two_sided:
            front = ahead < 0
            parts = (jnp.where(front, a, b) for a, b in zip(parts, before(-1), strict=True))
        first, second, there = parts
        blocks = blocks & there
    return edge_arcs(first, second, point[None, None]), blocks, -jnp.sign(own)
