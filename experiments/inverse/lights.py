"""What the experiments on near lights recovered from shading share."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import inverse, midrange, transfer

from ..shared.lights import exact_light, rectangle


def some(baked: transfer.Transfer, count: int, seed: int) -> transfer.Transfer:
    """Of `count` vertices, drawn at random; all where there are no more."""
    total = len(baked.positions)
    rows = np.random.default_rng(seed).choice(total, min(count, total), replace=False)
    return jax.tree.map(lambda x: x[np.sort(rows)], baked)


def lamp(
    away: Float[np.ndarray, " 3"],
    target: Float[np.ndarray, " 3"],
    size: tuple[float, float],
    roll: float,
    radiance: Sequence[float] | Float[np.ndarray, " 3"],
) -> inverse.Rectangle:
    """A rectangle at `away` that faces the target, turned by `roll` in its plane."""
    level = inverse.rectangle_of(rectangle(away, target, size, radiance))
    cos, sin = np.cos(roll), np.sin(roll)
    axes = jnp.asarray(np.array([[cos, sin], [-sin, cos]]) @ np.asarray(level.axes))
    return inverse.Rectangle(level.center, axes, level.size, level.radiance)


def shade(
    lights: Sequence[midrange.Polygon], baked: transfer.Transfer, albedo: float
) -> Float[Array, "v 3"]:
    """Exact at each vertex; lights do not hide each other."""
    return transfer.shade_diffuse(exact_light(lights, baked.positions, baked.degree), baked, albedo)


def with_noise(clean: Float[Array, "v 3"], level: float, key: Array) -> Float[Array, "v 3"]:
    """Gaussian, independent at each vertex and channel, relative to the mean."""
    return clean + level * clean.mean() * jax.random.normal(key, clean.shape, clean.dtype)
