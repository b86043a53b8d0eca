"""Directions that all vertices share, and which of them are cast first."""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ...sphere import fibonacci
from ._receivers import basis_at

# For each ray that the user grants the sphere: directions in the quadrature, and guides. So a
# vertex casts about as many rays as with an even set of the granted size, and errs less: the
# experiment `first_light` prints by how much it errs, and the rays that it takes.
_QUADRATURE, _GUIDES, _FEWEST_GUIDES = 9 / 4, 1 / 2, 256
_AROUND, _BLOCK = 8, 256


class Directions(NamedTuple):
    """Holds D directions of equal weight in the order in which they are cast, G guides first.

    Where a guide and those around it agree on whether light is blocked, so do, nearly always,
    the directions nearest to it: these are cast only elsewhere.
    """

    vectors: Float[np.ndarray, "d 3"]
    basis: Float[np.ndarray, "d k"]  # y_i times the directions' weight
    nearest: Int[np.ndarray, " r"]  # the guide of each of the R = D - G others
    around: Int[np.ndarray, "n g"]  # the guides next to each guide; none where all are guides


def guided(rays: int, degree: int, seed: int, dtype: np.dtype) -> Directions:
    """Make a quadrature finer than `rays` on the sphere, cast whole only where guides disagree."""
    count = math.ceil(_QUADRATURE * rays)
    vectors = turned_fibonacci(count, seed, dtype)
    number = min(count, max(round(_GUIDES * rays), _FEWEST_GUIDES))
    guides, nearest, around = vectors, np.empty(0, np.intp), np.empty((0, count), np.intp)
    if number < count:  # else no guide speaks for another direction, and needs no neighbors
        chosen = spread(vectors, number)
        guides, others = vectors[chosen], np.delete(vectors, chosen, axis=0)
        vectors = np.concatenate([guides, others])
        nearest = _nearest(others, guides, 1)[0]
        around = _nearest(guides, guides, 1 + _AROUND)[1:]
    basis = basis_at(vectors, degree) * (4 * math.pi / count)
    return Directions(vectors, basis.astype(dtype, copy=False), nearest, around)


def _nearest(
    vectors: Float[np.ndarray, "n 3"], among: Float[np.ndarray, "g 3"], count: int
) -> Int[np.ndarray, "count n"]:
    """Find the indices of the `count` vectors nearest to each one, nearest first."""
    found = np.empty((count, len(vectors)), np.intp)
    for start in range(0, len(vectors), _BLOCK):
        part = slice(start, start + _BLOCK)
        x, y, z = vectors[part].T[..., None]
        # Not as a matrix product, whose threads keep a core busy while they wait.
        far = -(x * among[:, 0] + y * among[:, 1] + z * among[:, 2])
        some = np.argpartition(far, count - 1, axis=1)[:, :count]
        order = np.take_along_axis(far, some, axis=1).argsort(axis=1, stable=True)
        found[:, part] = np.take_along_axis(some, order, axis=1).T
    return found


def turned_fibonacci(count: int, seed: int, dtype: np.dtype) -> Float[np.ndarray, "count 3"]:
    """Turn the Fibonacci directions, of weight 4π/count, by a rotation drawn uniformly."""
    quaternion = np.random.default_rng(seed).normal(size=4)
    w, *v = quaternion / np.linalg.norm(quaternion)
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    rotation = np.eye(3) + 2 * w * cross + 2 * cross @ cross
    directions = np.asarray(fibonacci(count).directions, np.float64)
    return (directions @ rotation.T).astype(dtype)


def spread(vectors: Float[np.ndarray, "d 3"], count: int) -> Int[np.ndarray, " count"]:
    """Choose `count` vectors, each farthest from those before it; ascending indices."""
    chosen = np.empty(count, int)
    distance = np.full(len(vectors), np.inf)
    x, y, z = np.ascontiguousarray(vectors.T)
    farthest = 0
    for i in range(count):
        chosen[i] = farthest
        u, v, w = vectors[farthest]
        np.minimum(distance, 1 - (u * x + v * y + w * z), out=distance)
        distance[farthest] = -1  # rounding must not let it be chosen again
        farthest = int(distance.argmax())
    return np.sort(chosen)
