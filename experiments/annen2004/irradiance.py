"""Irradiance gradients (Ward & Heckbert 1992): the older rival, on lights that nothing hides.

A record holds the irradiance at a point of the surface, with its normal, and how it changes as
the point moves (translational gradient) and as the normal turns (rotational gradient). Theirs come
from a sampled hemisphere, ours are exact: the rival at its best.
"""

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from scipy.cluster.vq import kmeans2
from scipy.spatial import KDTree

from jaxsh import midrange

_AXES = np.array([3, 1, 2])  # of degree 1, in the order x, y, z
_SCALE = math.sqrt(4 * math.pi / 3)


class Records(NamedTuple):
    """Irradiance at points of a surface, and its gradients by the rotation and the position."""

    points: Float[Array, "s 3"]
    normals: Float[Array, "s 3"]
    value: Float[Array, "s 3"]
    rotation: Float[Array, "s 3 3"]
    translation: Float[Array, "s 3 3"]
    radius: Float[Array, " s"]  # harmonic mean of the distances to the lights


def irradiance(
    lights: Sequence[midrange.Polygon], positions: Float[Array, "n 3"], normals: Float[Array, "n 3"]
) -> Float[Array, "n 3"]:
    """E = n·F, where F = ∫ L ω dω over the upper hemisphere is in the harmonics of degree 1."""
    light = sum(
        midrange.polygon_harmonics(polygon, positions, 1, horizon=normals) for polygon in lights
    )
    flux = _SCALE * jnp.asarray(light)[..., _AXES]
    return jnp.sum(flux * normals[:, None], axis=-1)


def make_records(
    lights: Sequence[midrange.Polygon], points: Float[Array, "s 3"], normals: Float[Array, "s 3"]
) -> Records:
    """At the horizon n·ω = 0, so that its motion changes nothing, and both gradients are F's own.

    The normal that turns by a small θ becomes n + θ × n, so E grows by (θ × n)·F = θ·(n × F).
    """
    parts = [
        midrange.polygon_harmonics_with_gradient(polygon, points, 1, horizon=normals)
        for polygon in lights
    ]
    light, gradient = (functools.reduce(jnp.add, part) for part in zip(*parts, strict=True))
    flux, slope = _SCALE * light[..., _AXES], _SCALE * gradient[..., _AXES, :]
    value = jnp.sum(flux * normals[:, None], axis=-1)
    rotation = jnp.cross(jnp.broadcast_to(normals[:, None], flux.shape), flux)
    translation = jnp.sum(slope * normals[:, None, :, None], axis=-2)
    centers = jnp.stack([jnp.mean(polygon.vertices, axis=0) for polygon in lights])
    distances = jnp.linalg.norm(points[:, None] - centers[None].astype(points.dtype), axis=-1)
    return Records(
        points, normals, value, rotation, translation, 1 / jnp.mean(1 / distances, axis=-1)
    )


def interpolate_records(
    records: Records,
    positions: Float[Array, "v 3"],
    normals: Float[Array, "v 3"],
    *,
    gradients: bool = True,
    exponent: float = 1.0,
) -> Float[Array, "v 3"]:
    """Σ w (E + (n_i × n)·∇_r E + (x - x_i)·∇_t E) / Σ w, w = 1 / (|x - x_i| / R_i + √(1 - n·n_i)).

    All records count; a power of w above theirs, 1, leaves the near ones more of the say, as
    their radius of validity does.
    """
    offsets = positions[:, None] - records.points[None]
    aligned = jnp.matmul(normals, records.normals.T, precision="highest")
    away = jnp.linalg.norm(offsets, axis=-1) / records.radius[None]
    apart = away + jnp.sqrt(jnp.maximum(1 - aligned, 0))
    weights = (jnp.min(apart, axis=1, keepdims=True) + 1e-9) / (apart + 1e-9)
    weights = weights**exponent
    weights = weights / jnp.sum(weights, axis=1, keepdims=True)
    total = jnp.matmul(weights, records.value, precision="highest")
    if not gradients:
        return total
    turns = jnp.cross(
        jnp.broadcast_to(records.normals[None], offsets.shape),
        jnp.broadcast_to(normals[:, None], offsets.shape),
    )
    for moves, gradient in ((turns, records.rotation), (offsets, records.translation)):
        total = total + jnp.einsum("vs,vsd,scd->vc", weights, moves, gradient, precision="highest")
    return total


def record_places(
    positions: Float[np.ndarray, "v 3"], normals: Float[np.ndarray, "v 3"], count: int, seed: int
) -> Int[np.ndarray, " s"]:
    """Vertices evenly spread over positions and normals: nearest to the means of clusters."""
    both = np.concatenate([positions, normals], axis=1).astype(np.float64)
    means, _ = kmeans2(both, count, iter=20, minit="++", rng=np.random.default_rng(seed))
    return np.unique(KDTree(both).query(means)[1])
