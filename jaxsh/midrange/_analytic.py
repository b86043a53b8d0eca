"""Radiance cubes of a few polygons and spheres, in JAX alone."""

import functools
from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float

from .._core.checks import as_float, check_size
from ._cube import RadianceCube, texels
from ._polygon import Polygon
from ._rows import Rows, dot
from ._sphere import Sphere

Shape = Polygon | Sphere


class _Seen(NamedTuple):
    """What the texels see so far; vectors as three rows."""

    inverse: Float[Array, " n"]  # 1/r
    offset: Float[Array, " n"]
    normal: Rows
    radiance: Rows


def capture_analytic(
    emitters: Sequence[Shape],
    point: Float[ArrayLike, "*batch 3"],
    resolution: int = 64,
    *,
    blockers: Sequence[Shape] = (),
) -> RadianceCube:
    """`capture` of few polygons and spheres without Embree, for use inside `jit` and `vmap`.

    Each ray is tested against each edge of each simple polygon, so the cost grows with their
    number. Differentiable in the points, vertices, centres and radii, through distances, offsets
    and normals, and in the radiance. Which surface a texel sees is constant: for the coefficients'
    derivative in the point take that of `project_cube_with_gradient`.
    The result has the dtype of the point. Raises `ValueError` for wrong shapes.
    """
    resolution = check_size("resolution", resolution)
    point = as_float(point)
    if point.ndim == 0 or point.shape[-1] != 3:
        raise ValueError(f"expected points (..., 3), got shape {point.shape}")
    directions = tuple(texels(resolution).directions.astype(point.dtype).T)
    return _cubes(tuple(emitters), tuple(blockers), directions, point)


@jax.jit
def _cubes(
    emitters: tuple[Shape, ...],
    blockers: tuple[Shape, ...],
    directions: Rows,
    point: Float[Array, "*batch 3"],
) -> RadianceCube:
    emitters, blockers = jax.tree.map(lambda a: a.astype(point.dtype), (emitters, blockers))
    shapes = [*((shape, True) for shape in emitters), *((shape, False) for shape in blockers)]
    flat = jax.vmap(functools.partial(_cube, shapes, directions))(point.reshape(-1, 3))
    return jax.tree.map(lambda a: a.reshape(*point.shape[:-1], *a.shape[1:]), flat)


def _cube(
    shapes: list[tuple[Shape, bool]], directions: Rows, point: Float[Array, " 3"]
) -> RadianceCube:
    zero = jnp.zeros_like(directions[0])
    nearest = _Seen(zero, jnp.full_like(zero, -jnp.inf), (zero, zero, zero), (zero, zero, zero))
    for shape, shines in shapes:
        if isinstance(shape, Polygon):
            hit, seen = _see_polygon(shape, shines, point, directions)
        else:
            hit, seen = _see_sphere(shape, shines, point, directions)
        nearer = hit & (seen.inverse > nearest.inverse)
        nearest = jax.tree.map(lambda a, b, nearer=nearer: jnp.where(nearer, a, b), seen, nearest)
    found = nearest.inverse > 0
    distance = jnp.where(found, 1 / jnp.where(found, nearest.inverse, 1), jnp.inf)
    radiance, normal = (jnp.stack(rows, axis=-1) for rows in (nearest.radiance, nearest.normal))
    return RadianceCube(radiance, distance, nearest.offset, normal, point)


def _see_polygon(
    polygon: Polygon, shines: bool, point: Float[Array, " 3"], directions: Rows
) -> tuple[Bool[Array, " n"], _Seen]:
    to_vertices = polygon.vertices - point[None]
    edges = polygon.vertices[1:] - polygon.vertices[:1]
    area = jnp.sum(jnp.cross(edges[:-1], edges[1:]), axis=0)
    normal = area / jnp.linalg.norm(area)
    h = jnp.dot(normal, to_vertices[0])
    behind = h > 0
    # The plane's own axes, and where the ray and the vertices are in them.
    first = edges[0] / jnp.linalg.norm(edges[0])
    second = jnp.cross(normal, first)
    normal = jnp.where(behind, -normal, normal)
    h = -jnp.abs(h)
    inverse = dot(tuple(normal), directions) / jnp.where(h < 0, h, -1)
    ahead = (inverse > 0) & (h < 0)
    distance = 1 / jnp.where(ahead, inverse, 1)
    x, y = (dot(tuple(axis), directions) * distance for axis in (first, second))
    inside = _inside(to_vertices @ first, to_vertices @ second, x, y)
    bright = jnp.logical_or(polygon.two_sided, ~behind) & shines
    light = jnp.where(bright, polygon.radiance, 0)
    seen = _Seen(inverse, _fill(h, x), _rows(normal, x), _rows(light, x))
    return ahead & inside, seen


def _inside(u: Float[Array, " v"], v: Float[Array, " v"], x: Array, y: Array) -> Array:
    """Whether points lie in a simple polygon of corners (u, v): a ray along x leaves it oddly."""
    inside = jnp.zeros(x.shape, bool)
    for i in range(len(u)):
        ahead = (u[i - 1] - u[i]) * (y - v[i]) - (v[i - 1] - v[i]) * (x - u[i])
        crosses = (v[i] > y) != (v[i - 1] > y)
        inside ^= crosses & ((ahead > 0) == (v[i - 1] > v[i]))
    return inside


def _see_sphere(
    sphere: Sphere, shines: bool, point: Float[Array, " 3"], directions: Rows
) -> tuple[Bool[Array, " n"], _Seen]:
    way = sphere.center - point
    along, depth = dot(tuple(way), directions), sphere.radius**2 - jnp.dot(way, way)
    squared = along * along + depth
    met = squared > 0
    root = jnp.sqrt(jnp.where(met, squared, 1))
    within = depth > 0
    t = jnp.where(within, along + root, along - root)
    hit = met & (t > 0)
    t = jnp.where(hit, t, 1)
    side = jnp.where(within, -1, 1) / sphere.radius
    normal = tuple((d * t - c) * side for d, c in zip(directions, way, strict=True))
    light = jnp.where(jnp.logical_not(within) & shines, sphere.radiance, 0)
    return hit, _Seen(1 / t, -root * t / sphere.radius, normal, _rows(light, t))


def _fill(value: Float[Array, ""], like: Float[Array, " n"]) -> Float[Array, " n"]:
    return jnp.full_like(like, 1) * value


def _rows(vector: Float[Array, " 3"], like: Float[Array, " n"]) -> Rows:
    x, y, z = (_fill(component, like) for component in vector)
    return x, y, z
