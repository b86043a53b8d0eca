"""Captures radiance cubes of a scene, by rays."""

import math
import sys
from typing import Any, Literal, cast

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from .._core.checks import (
    as_finite,
    check_choice,
    check_size,
    check_type,
    check_vectors,
)
from ._analytic import capture_shapes
from ._cube import RadianceCube, texels
from ._emitters import Polygon, Sphere
from ._scene import Scene


def capture(
    scene: Scene,
    point: Float[ArrayLike, "*batch 3"],
    resolution: int = 64,
    *,
    rays: Literal["embree", "analytic"] = "embree",
    progress: bool = True,
) -> RadianceCube:
    """Capture the radiance that a scene sends to one point (3,), or to each of many (..., 3).

    One ray goes through the center of each texel, as in the rendered cube maps of Annen et al.
    2004 (§5). A surface is seen from the side it shows: normals face the point, backs are black.
    The sky is the environment's mean over a texel.

    **Arguments**

    - `scene`: emitters, blockers and environment.
    - `point`: where the cube maps are taken, in the scene's unit of length.
    - `resolution`: texels along a side of a face.
    - `rays`:
      "embree" finds each ray's triangle with `geometry.ray_scene`, by Embree where it is
      installed and by JAX elsewhere, in float32; distances come from that triangle's plane, in
      float64, and spheres are met in closed form. It runs on the host, outside of `jit`, and is
      constant to differentiation.
      "analytic" tests each ray against each edge of each polygon and each sphere, in JAX, so that
      the cost grows with their number: for few of them, without meshes, inside `jit` and `vmap`.
      Differentiable in points, vertices, centers, radii and radiance, through distances, normals
      and radiance. Which surface a texel sees is constant: take the coefficients' derivative in
      the point from `project_cube_with_gradient`.
    - `progress`: with "embree", a bar for many points, on a terminal.

    **Returns** a `RadianceCube`: with "embree" in the scene's dtype, float64 if any emitter has
    it, else float32; with "analytic" in the dtype of the points, and sharded as they are.

    Raises `ValueError` for a wrong shape, resolution or `rays`, for points that are not finite
    where their values are known, and for meshes with "analytic".

    **Example**

    >>> import numpy as np
    >>> from jaxsh import midrange
    >>> ball = midrange.Sphere(np.array([0.0, 0.0, 2.0]), np.array(0.5), np.ones(3))
    >>> cube = midrange.capture(midrange.Scene([ball]), np.zeros(3), 8, rays="analytic")
    >>> cube.radiance.shape, round(float(cube.distance.min()), 1)
    ((384, 3), 1.6)
    """
    resolution = check_size("resolution", resolution)
    check_type("scene", scene, Scene)
    check_choice("rays", rays, ("embree", "analytic"))
    point = as_finite(point, "point", wait=True)
    check_vectors("point", point)
    if rays == "analytic":
        return _analytic(scene, point, resolution)
    points = np.asarray(point, np.float64)
    batch, count = points.shape[:-1], 6 * resolution**2
    shapes = {
        "radiance": (count, 3),
        "distance": (count,),
        "plane_distance": (count,),
        "normal": (count, 3),
    }
    dtype = scene.dtype
    arrays = {name: np.empty((*batch, *shape), dtype) for name, shape in shapes.items()}
    directions = np.asarray(texels(resolution).directions, np.float64)
    for place in _progress(np.ndindex(batch), math.prod(batch), progress):
        for array, seen in zip(
            arrays.values(), _seen(scene, points[place], directions, resolution), strict=True
        ):
            array[place] = seen
    made = {name: jnp.asarray(array) for name, array in arrays.items()}
    return RadianceCube(**made, point=jnp.asarray(points, dtype))


def _analytic(scene: Scene, point, resolution: int) -> RadianceCube:
    shapes = (*scene.emitters, *scene.blockers)
    meshes = [type(shape).__name__ for shape in shapes if not isinstance(shape, Polygon | Sphere)]
    if meshes:
        raise ValueError(
            f'rays="analytic" takes polygons and spheres, got {meshes[0]}: use rays="embree"'
        )
    sky = scene.sky(resolution)
    emitters, blockers = cast(Any, scene.emitters), cast(Any, scene.blockers)  # no meshes
    return capture_shapes(emitters, blockers, sky, point, resolution)


def _seen(scene: Scene, point: np.ndarray, directions: np.ndarray, resolution: int):
    """Trace radiance, distance, plane distance and normal along each direction."""
    sky = scene.sky(resolution)
    radiance, distance, offset, normal = _triangles(scene, point, directions, sky)
    for center, radius, light in zip(*scene.spheres, strict=True):
        way = center - point
        along, depth = directions @ way, radius**2 - way @ way
        squared = along**2 + depth
        root = np.sqrt(np.maximum(squared, 0))
        # From without the nearer of two crossings, from within the one ahead.
        t = along + root if depth > 0 else along - root
        here = (squared > 0) & (t > 0) & (t < distance)
        outwards = (directions[here] * t[here, None] - way) / radius
        radiance[here] = 0 if depth > 0 else light
        distance[here] = t[here]
        normal[here] = -outwards if depth > 0 else outwards
        offset[here] = -root[here] * t[here] / radius
    return radiance, distance, offset, normal


def _triangles(scene: Scene, point: np.ndarray, directions: np.ndarray, sky: np.ndarray):
    """Trace the flat surfaces alone."""
    count = len(directions)
    if scene.rays is None:
        return sky.copy(), np.full(count, np.inf), np.full(count, -np.inf), np.zeros((count, 3))
    hit = scene.rays.closest_hit(point, directions.astype(np.float32))
    # Rows of only those triangles that are seen, and a last one for the sky.
    seen = np.flatnonzero(np.bincount(hit.face[hit.face >= 0]))
    row = np.full(len(scene.triangles.areas) + 1, len(seen))
    row[seen] = np.arange(len(seen))
    row = row[hit.face]  # -1, a miss, is the last

    surface = scene.triangles
    h = np.einsum("td,td->t", surface.normals[seen], surface.corners[seen, 0] - point)
    behind = (h > 0)[:, None]
    table = np.zeros((len(seen) + 1, 7))
    table[:-1, :3] = np.where(behind, surface.back[seen], surface.front[seen])
    table[:-1, 3:6] = np.where(behind, -1, 1) * surface.normals[seen]
    table[:-1, 6] = -np.abs(h)
    table[-1, 6] = -np.inf
    found = table[row]
    radiance, normal, offset = found[:, :3], found[:, 3:6], found[:, 6]
    if scene.environment is not None:
        missed = row == len(seen)
        radiance[missed] = sky[missed]
    x, y, z = directions.T
    cosine = normal[:, 0] * x + normal[:, 1] * y + normal[:, 2] * z
    ahead = cosine < 0  # but for rounding where a plane is seen edge on, and for the sky
    distance = np.where(ahead, offset / np.where(ahead, cosine, -1), hit.distance)
    return radiance, distance, offset, normal


def _progress(places, total: int, wanted: bool):
    """Show a bar on a terminal for captures longer than a second."""
    if not wanted or total < 2:
        return places
    from tqdm import tqdm

    return tqdm(
        places, total=total, desc="capture", unit=" points", delay=1, file=sys.stderr, disable=None
    )
