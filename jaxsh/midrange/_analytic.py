"""Captures radiance cubes of a few polygons and spheres in JAX alone."""

import functools
from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float

from .._core.checks import flatten_batch
from .._core.linalg import dot, matmul
from .._core.xla import keep_batch
from ._cube import RadianceCube, texels
from ._emitters import Polygon, Sphere
from ._vectors import Components, component_dot

Shape = Polygon | Sphere


class _Seen(NamedTuple):
    """The nearest surface of each texel so far; vectors as three arrays."""

    inverse: Float[Array, " n"]  # 1/r
    plane_distance: Float[Array, " n"]
    normal: Components
    radiance: Components


def capture_shapes(
    emitters: Sequence[Shape],
    blockers: Sequence[Shape],
    sky: Float[ArrayLike, "n 3"],
    point: Float[Array, "*batch 3"],
    resolution: int,
) -> RadianceCube:
    """Capture cubes of polygons and spheres before a sky, in the dtype of the points."""
    directions = tuple(texels(resolution).directions.astype(point.dtype).T)
    rows = tuple(jnp.asarray(sky, point.dtype).T)
    return _cubes(tuple(emitters), tuple(blockers), directions, rows, point)


@jax.jit
def _cubes(
    emitters: tuple[Shape, ...],
    blockers: tuple[Shape, ...],
    directions: Components,
    sky: Components,
    point: Float[Array, "*batch 3"],
) -> RadianceCube:
    shapes = jax.tree.map(lambda a: a.astype(point.dtype), (emitters, blockers))
    leaves, tree = jax.tree.flatten((*shapes, directions, sky))

    def cubes(point, *leaves):
        emitters, blockers, directions, sky = jax.tree.unflatten(tree, leaves)
        shapes = [*((shape, True) for shape in emitters), *((shape, False) for shape in blockers)]
        flat = jax.vmap(functools.partial(_cube, shapes, directions, sky))(flatten_batch(point))
        return jax.tree.map(lambda a: a.reshape(*point.shape[:-1], *a.shape[1:]), flat)

    return keep_batch(cubes, point, *leaves, ndims=(1, *(leaf.ndim for leaf in leaves)))


def _cube(
    shapes: list[tuple[Shape, bool]],
    directions: Components,
    sky: Components,
    point: Float[Array, " 3"],
) -> RadianceCube:
    zero = jnp.zeros_like(directions[0])
    nearest = _Seen(zero, jnp.full_like(zero, -jnp.inf), (zero, zero, zero), sky)
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
    return RadianceCube(radiance, distance, nearest.plane_distance, normal, point)


def _see_polygon(
    polygon: Polygon, shines: bool, point: Float[Array, " 3"], directions: Components
) -> tuple[Bool[Array, " n"], _Seen]:
    to_vertices = polygon.vertices - point[None]
    edges = polygon.vertices[1:] - polygon.vertices[:1]
    area = jnp.sum(jnp.cross(edges[:-1], edges[1:]), axis=0)
    normal = area / jnp.linalg.norm(area)
    h = dot(normal, to_vertices[0])
    behind = h > 0
    # The plane's own axes, and where the ray and the vertices are in them.
    first = edges[0] / jnp.linalg.norm(edges[0])
    second = jnp.cross(normal, first)
    normal = jnp.where(behind, -normal, normal)
    h = -jnp.abs(h)
    inverse = component_dot(tuple(normal), directions) / jnp.where(h < 0, h, -1)
    ahead = (inverse > 0) & (h < 0)
    distance = 1 / jnp.where(ahead, inverse, 1)
    x, y = (component_dot(tuple(axis), directions) * distance for axis in (first, second))
    inside = _inside(matmul(to_vertices, first), matmul(to_vertices, second), x, y)
    bright = jnp.logical_or(polygon.two_sided, ~behind) & shines
    light = jnp.where(bright, polygon.radiance, 0)
    seen = _Seen(inverse, _fill(h, x), _rows(normal, x), _rows(light, x))
    return ahead & inside, seen


def _inside(u: Float[Array, " v"], v: Float[Array, " v"], x: Array, y: Array) -> Array:
    """Tell which points lie in a simple polygon: a ray along x leaves it oddly."""
    inside = jnp.zeros(x.shape, bool)
    for i in range(len(u)):
        ahead = (u[i - 1] - u[i]) * (y - v[i]) - (v[i - 1] - v[i]) * (x - u[i])
        crosses = (v[i] > y) != (v[i - 1] > y)
        inside ^= crosses & ((ahead > 0) == (v[i - 1] > v[i]))
    return inside


def _see_sphere(
    sphere: Sphere, shines: bool, point: Float[Array, " 3"], directions: Components
) -> tuple[Bool[Array, " n"], _Seen]:
    way = sphere.center - point
    along, depth = component_dot(tuple(way), directions), sphere.radius**2 - dot(way, way)
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


def _rows(vector: Float[Array, " 3"], like: Float[Array, " n"]) -> Components:
    x, y, z = (_fill(component, like) for component in vector)
    return x, y, z
