"""The bake of PIFu's training data, written again from its formulas.

Saito et al. 2019, "PIFu: pixel-aligned implicit function", in whose published code `prt_util` makes
the transfer of degree 2 that its training pictures are shaded with.
"""

import math

import numpy as np
from jaxtyping import Float, Int
from scipy.special import sph_harm_y

from jaxsh import geometry, harmonics

DEGREE, SIDE = 2, 40
# How far off the surface rays start, in the shortest side of the bounding box.
OFFSET = 1e-3


def directions(side: int, seed: int, *, stratified: bool = False) -> Float[np.ndarray, "n 3"]:
    """Draw side² directions over the sphere: uniformly, as PIFu does, or one in each cell."""
    u, v = np.random.default_rng(seed).random((2, side, side))
    if stratified:
        u, v = (u + np.arange(side)[:, None]) / side, (v + np.arange(side)) / side
    z, phi = (1 - 2 * u).ravel(), (2 * math.pi * v).ravel()
    radius = np.sqrt(1 - z * z)
    return np.stack([-radius * np.cos(phi), -radius * np.sin(phi), z], axis=1)


def basis(vectors: Float[np.ndarray, "n 3"], degree: int = DEGREE) -> Float[np.ndarray, "n k"]:
    """Evaluate real harmonics in its convention, which is ours, in float64."""
    x, y, z = vectors.T
    theta, phi = np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)
    columns = []
    for l, m in zip(harmonics.degrees(degree), harmonics.orders(degree), strict=True):
        value = sph_harm_y(int(l), abs(int(m)), theta, phi) * (-1.0) ** m
        columns.append((value.imag if m < 0 else value.real) * (math.sqrt(2) if m else 1))
    return np.stack(columns, axis=1)


def transfer(
    mesh: geometry.Mesh,
    vectors: Float[np.ndarray, "n 3"],
    chosen: Int[np.ndarray, " c"] | slice = slice(None),
) -> Float[np.ndarray, "c k"]:
    """Sum visibility, clamped cosine and basis over the directions, with equal weights.

    As many directions at a time as the square root of their number; from each vertex rays along
    all of them, those below the surface too, by trimesh, which hands them to Embree.
    """
    import trimesh

    points, normals = np.asarray(mesh.vertices, float), np.asarray(mesh.normals, float)
    whole = trimesh.Trimesh(points, np.asarray(mesh.faces), vertex_normals=normals, process=False)
    points, normals = points[chosen], normals[chosen]
    side, values = math.isqrt(len(vectors)), basis(vectors)
    starts = np.repeat(points, side, axis=0)
    facing = np.repeat(normals, side, axis=0)
    lifted = starts + OFFSET * min(whole.bounding_box.extents) * facing
    total = np.zeros((len(points), values.shape[1]))
    for start in range(0, len(vectors), side):
        part = slice(start, start + side)
        towards = np.tile(vectors[part], (len(points), 1))
        cosines = (towards * facing).sum(axis=1)
        hit = whole.ray.intersects_any(lifted, towards)
        weights = np.where((cosines > 0) & ~hit, cosines, 0)
        products = weights[:, None] * np.tile(values[part], (len(points), 1))
        total += products.reshape(len(points), side, -1).sum(axis=1)
    return 4 * math.pi / len(vectors) * total
