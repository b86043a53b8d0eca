"""A polygon as receivers see it: above the horizon, beside what stands before it."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ._arcs import Arcs, Rows, coefficients, coefficients_with_gradient, edge_arcs
from ._clip import clip, clip_cone, clip_horizon, joined, with_room
from ._vectors import dot, select, unit


class Scene(NamedTuple):
    """Corners of the light and of convex blockers. The horizon, if any, comes with the points."""

    vertices: Float[Array, "n 3"]
    blockers: tuple[Float[Array, "m 3"], ...]


class Plan(NamedTuple):
    """What is known at trace time. Clips need convex loops; a whole outline may be concave."""

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
    """Of the length of twice the area, by Newell's formula."""
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
