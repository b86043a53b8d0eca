"""Radiance cubes of a scene, by rays."""

import math
import sys

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from .._core.checks import as_float, check_size
from ._cube import RadianceCube, texels
from ._scene import Scene


def capture(
    scene: Scene,
    point: Float[ArrayLike, "*batch 3"],
    resolution: int = 64,
    *,
    progress: bool = True,
) -> RadianceCube:
    """What a scene looks like from one point (3,), or from each of many (..., 3).

    One ray goes through the centre of each texel, as in the paper's rendered cube maps (§5). Which
    triangle it meets Embree says, in float32; distances and offsets come from that triangle's
    plane, in float64. Spheres are met in closed form. The sky is the environment's mean over a
    texel. A surface is seen from the side it shows: normals face the point, backs are black.

    `resolution` is the number of texels along a side of a face. Many points show a bar of their
    `progress`, on a terminal. The result has the scene's dtype: float64 if any emitter has, else
    float32. Constant to differentiation (`capture_analytic` is not). Raises `ValueError` for a
    wrong shape or resolution, and for points that are not finite.
    """
    resolution = check_size("resolution", resolution)
    points = np.asarray(as_float(point), np.float64)
    if points.ndim == 0 or points.shape[-1] != 3:
        raise ValueError(f"expected points (..., 3), got shape {points.shape}")
    if not np.isfinite(points).all():
        raise ValueError("points must be finite, got NaN or infinity")
    batch, count = points.shape[:-1], 6 * resolution**2
    shapes = {
        "radiance": (count, 3),
        "distance": (count,),
        "offset": (count,),
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


def _seen(scene: Scene, point: np.ndarray, directions: np.ndarray, resolution: int):
    """Radiance, distance, offset and normal along each direction."""
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
    """The same of the flat surfaces alone."""
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
    """A bar on a terminal, of what takes longer than a second."""
    if not wanted or total < 2:
        return places
    from tqdm import tqdm

    return tqdm(
        places, total=total, desc="capture", unit=" points", delay=1, file=sys.stderr, disable=None
    )
