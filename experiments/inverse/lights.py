"""What the experiments on near lights recovered from shading share."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import geometry, inverse, midrange, transfer

from ..annen2004.scenes import exact_light, rectangle
from ..runner import Context


def bake(
    context: Context, name: str | None, degree: int, directions: int
) -> tuple[str, geometry.Mesh, transfer.Transfer]:
    """A mesh of the data, the first where none is named, and its transfer in float64.

    So that what is seen without noise is the method and not rounding.
    """
    name = name or context.data.meshes()[0]
    mesh = context.data.mesh(name)
    with context.time("bake"):
        baked = transfer.bake(
            mesh, degree, directions=directions, seed=context.seed, progress=False
        )
        jax.block_until_ready(baked.coefficients)
    double = transfer.Transfer(
        baked.coefficients.astype(jnp.float64),
        baked.positions.astype(jnp.float64),
        baked.normals,
        baked.neighbors,
    )
    return name, mesh, double


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
