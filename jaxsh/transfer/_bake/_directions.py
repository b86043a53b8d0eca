"""Directions that all vertices share, and which of them are cast first."""

import math
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ...sphere import fibonacci
from ._receivers import basis_at

# For each ray that the user grants the sphere: directions in the quadrature, and guides. So a
# vertex casts about as many rays as with an even set of the granted size, and errs less: the
# experiment `first_light` prints by how much it errs, and the rays that it takes.
_QUADRATURE, _GUIDES, _FEWEST_GUIDES = 9 / 4, 1 / 2, 256
_AROUND = 8


class Directions(NamedTuple):
    """Holds D directions of equal weight, G of them guides.

    Where a guide and those around it agree on whether light is blocked, so do, nearly always,
    the directions nearest to it: these are cast only elsewhere.
    """

    vectors: Float[np.ndarray, "d 3"]
    basis: Float[Array, "d k"]  # y_i times the directions' weight
    guides: Int[np.ndarray, " g"]  # which directions they are
    nearest: Int[np.ndarray, " d"]  # each direction's guide, as one of G; a guide's is itself
    around: Int[np.ndarray, "n g"]  # the guides next to each guide; none where all are guides


def guided(rays: int, degree: int, seed: int, dtype: np.dtype) -> Directions:
    """Make a quadrature finer than `rays` on the sphere, cast whole only where guides disagree."""
    count = math.ceil(_QUADRATURE * rays)
    vectors = turned_fibonacci(count, seed, dtype)
    basis = jnp.asarray(basis_at(vectors, degree) * (4 * math.pi / count))
    number = min(count, max(round(_GUIDES * rays), _FEWEST_GUIDES))
    if number == count:  # no guide speaks for another direction, so none needs its neighbors
        all_of_them = np.arange(count)
        return Directions(vectors, basis, all_of_them, all_of_them, np.empty((0, count), int))
    guides = spread(vectors, number)
    chosen = vectors[guides]
    ranked = np.concatenate(
        [np.argsort(-(part @ chosen.T), axis=1)[:, 1 : _AROUND + 1] for part in _parts(chosen)]
    )
    return Directions(
        vectors=vectors,
        basis=basis,
        guides=guides,
        nearest=np.concatenate([(part @ chosen.T).argmax(axis=1) for part in _parts(vectors)]),
        around=np.ascontiguousarray(ranked.T),
    )


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
    farthest = 0
    for i in range(count):
        chosen[i] = farthest
        distance = np.minimum(distance, 1 - vectors @ vectors[farthest])
        distance[farthest] = -1  # rounding must not let it be chosen again
        farthest = int(distance.argmax())
    return np.sort(chosen)


def _parts(vectors: np.ndarray) -> list[np.ndarray]:
    return [vectors[start : start + 1024] for start in range(0, len(vectors), 1024)]
