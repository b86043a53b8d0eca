"""The gradient of a cube's light with visibility moving: jumps of radiance across texels' edges.

∇c = Σ_e (L_b - L_a) y(ω_e) ν_e |e| (1/r)_near over the great-circle edges e between texels a and
b, ν the unit normal of e towards b (docs/near_light_cubes.md). What moves against what lies behind
it is the nearer surface, at 1/r = q·ω_e on its own plane.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._core.linalg import matmul
from .._core.xla import device_cache
from ..harmonics import evaluate
from ..sphere import cube_map
from ._cube import RadianceCube, inverse_distances


class Edges(NamedTuple):
    """All E = 12·resolution² edges between texels: those to the right, those down, and seams."""

    seams: Int[np.ndarray, "2 s"]  # texels on both sides of those between faces
    centers: Float[Array, "e 3"]  # unit
    normals: Float[Array, "e 3"]  # from the first texel to the second, as long as the edge
    table: Float[Array, "k e"]  # the basis at the centers


def edge_gradient(cube: RadianceCube, edges: Edges) -> Float[Array, "3 k 3"]:
    """∇c of one cube."""
    _, planes = inverse_distances(cube)
    resolution = cube.resolution
    texels = jnp.concatenate([cube.radiance, planes], axis=-1)
    grid = texels.reshape(6, resolution, resolution, 6)
    within = [(grid[:, :, :-1], grid[:, :, 1:]), (grid[:, :-1], grid[:, 1:])]
    pairs = [*within, tuple(texels[side] for side in edges.seams)]
    first, second = (jnp.concatenate([pair[i].reshape(-1, 6) for pair in pairs]) for i in range(2))
    nearest = jnp.maximum(_along(first, edges), _along(second, edges))
    jump = (second[:, :3] - first[:, :3]) * jnp.maximum(nearest, 0)[:, None]
    moved = (jump[:, :, None] * edges.normals[:, None, :]).reshape(-1, 9)
    moved = jnp.concatenate([moved, jnp.zeros_like(moved, shape=(len(moved), 7))], axis=1)
    gradient = matmul(edges.table, moved)[:, :9]
    return jnp.moveaxis(gradient.reshape(-1, 3, 3), 0, 1)


def _along(texels: Float[Array, "e 6"], edges: Edges) -> Float[Array, " e"]:
    x, y, z = (texels[:, 3 + i] * edges.centers[:, i] for i in range(3))
    return x + y + z


@device_cache(maxsize=4)
def edge_table(resolution: int, degree: int, dtype) -> Edges:
    """All edges of a cube of this resolution, and the basis on them; kept."""
    seams, centers, normals = _edges(resolution)
    centers, normals = (jnp.asarray(a, dtype) for a in (centers, normals))
    return Edges(seams, centers, normals, evaluate(centers, degree, axis=0))


def _edges(resolution: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Seams, centers and normals, in float64."""
    texel, corners = (
        np.arange(6 * resolution**2).reshape(6, resolution, resolution),
        _corners(resolution),
    )
    right = texel[:, :, :-1], texel[:, :, 1:], corners[:, :-1, 1:-1], corners[:, 1:, 1:-1]
    down = texel[:, :-1], texel[:, 1:], corners[:, 1:-1, :-1], corners[:, 1:-1, 1:]
    seam = _seams(texel, corners)
    groups = [
        [group[i].reshape(-1, *group[i].shape[3:]) for group in (right, down)] for i in range(4)
    ]
    first, second, start, end = (
        np.concatenate([*group, last]) for group, last in zip(groups, seam, strict=True)
    )
    start, end = (p / np.linalg.norm(p, axis=-1, keepdims=True) for p in (start, end))
    middle, normal = start + end, np.cross(start, end)
    sine = np.linalg.norm(normal, axis=-1, keepdims=True)
    cosine = np.sum(start * end, axis=-1, keepdims=True)
    normal *= np.arctan2(sine, cosine) / sine
    centers = np.asarray(cube_map(resolution).directions, np.float64)
    normal *= np.sign(np.sum(normal * (centers[second] - centers[first]), axis=-1))[:, None]
    middle /= np.linalg.norm(middle, axis=-1, keepdims=True)
    return np.stack(seam[:2]).astype(np.int32), middle, normal


def _corners(resolution: int) -> Float[np.ndarray, "6 r r 3"]:
    """Corners of the texels on the cube, by face, row and column, from the texels of `cube_map`."""
    coarse = np.asarray(cube_map(2).directions, np.float64).reshape(6, 2, 2, 1, 3)
    coarse = coarse / np.abs(coarse).max(axis=-1, keepdims=True)  # 1/2 off the face's middle
    face, down, right = (
        coarse.mean((1, 2)),
        coarse[:, 1, 0] - coarse[:, 0, 0],
        coarse[:, 0, 1] - coarse[:, 0, 0],
    )
    steps = np.linspace(-1, 1, resolution + 1)
    return (
        face[:, None]
        + np.multiply.outer(steps, down[:, 0]).transpose(1, 0, 2)[:, :, None]
        + np.multiply.outer(steps, right[:, 0]).transpose(1, 0, 2)[:, None]
    )


def _seams(texel: Int[np.ndarray, "6 r r"], corners: Float[np.ndarray, "6 c c 3"]):
    """Both texels and both ends of each edge between faces: two borders with the same middle."""
    texels = np.concatenate([texel[:, 0], texel[:, -1], texel[:, :, 0], texel[:, :, -1]], axis=1)
    sides = corners[:, 0], corners[:, -1], corners[:, :, 0], corners[:, :, -1]
    start = np.concatenate([side[:, :-1] for side in sides], axis=1).reshape(-1, 3)
    end = np.concatenate([side[:, 1:] for side in sides], axis=1).reshape(-1, 3)
    middles = np.round((start + end) * texel.shape[-1]).astype(int)  # integers on the cube
    order = np.lexsort(middles.T)
    one, other = order[::2], order[1::2]
    return texels.ravel()[one], texels.ravel()[other], start[one], end[one]
