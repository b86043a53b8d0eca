"""Where the directions of a tile lie, and coordinates in which its lobe is a polynomial."""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

# Exponents (i, j) of φ = b_c^(2-i-j) u^i w^j, the quadratic monomials of a direction.
POWERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
# Coordinates reach 1 at this many standard deviations of the tile's directions.
_REACH = 1.8
# A vertex that faces away counts a little, so that all tiles stay bounded.
_FLOOR = 0.05


class Frames(NamedTuple):
    """Of each tile: the middle direction, two axes across it, and the scale along each."""

    centre: Float[Array, "tiles 3"]
    across: Float[Array, "tiles 2 3"]
    scale: Float[Array, "tiles 2"]


def tile_frames(
    axis: Float[Array, "3 blocks b"],
    normals: Float[Array, "3 blocks b"],
    areas: Float[Array, "blocks b"],
    tile: Int[Array, " blocks"],
    count: int,
) -> Frames:
    """From the first two moments of a tile's directions, each weighed with the area seen."""
    facing = sum(n * b for n, b in zip(normals, axis, strict=True))
    weights = areas * (jnp.maximum(facing, 0.0) + _FLOOR)
    pairs = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
    weighed = [weights * b for b in axis]
    rows = jnp.stack([weights, *weighed, *(weighed[i] * axis[j] for i, j in pairs)])
    ones = jnp.ones((rows.shape[-1],), rows.dtype)
    sums = jnp.matmul(rows, ones, precision="highest").T
    sums = jax.ops.segment_sum(sums, tile, num_segments=count, indices_are_sorted=True)
    mean = sums[:, 1:4] / sums[:, :1]
    xx, xy, xz, yy, yz, zz = (sums[:, 4:] / sums[:, :1]).T
    second = jnp.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=-1).reshape(-1, 3, 3)
    centre, first, other = _basis(mean)
    tangents = jnp.stack([first, other], axis=1)
    spread = second - mean[:, :, None] * mean[:, None]
    inner = jnp.einsum("tai,tij,tbj->tab", tangents, spread, tangents, precision="highest")
    a, b, d = inner[:, 0, 0], inner[:, 0, 1], inner[:, 1, 1]
    turn = 0.5 * jnp.arctan2(2 * b, a - d)
    cos, sin = jnp.cos(turn)[:, None], jnp.sin(turn)[:, None]
    across = jnp.stack([cos * first + sin * other, cos * other - sin * first], axis=1)
    half, radius = (a + d) / 2, jnp.sqrt((a - d) ** 2 / 4 + b**2)
    variance = jnp.stack([half + radius, half - radius], axis=-1)
    # Rounding leaves of the variance of equal directions about this much, of either sign.
    floor = 4 * float(jnp.finfo(variance.dtype).eps)
    return Frames(centre, across, _REACH * jnp.sqrt(jnp.maximum(variance, floor)))


def monomials(
    axis: Float[Array, "3 blocks b"], frames: Frames, tile: Int[Array, " blocks"]
) -> Float[Array, "blocks 6 b"]:
    """φ of each vertex's direction in its tile's frame."""
    rows = jnp.concatenate(
        [frames.centre[:, None], frames.across / frames.scale[..., None]], axis=1
    )[tile]
    x, y, z = axis
    c, u, w = (
        rows[:, i, 0, None] * x + rows[:, i, 1, None] * y + rows[:, i, 2, None] * z
        for i in range(3)
    )
    return jnp.stack([c * c, c * u, c * w, u * u, u * w, w * w], axis=1)


def nodes(frames: Frames) -> tuple[Float[Array, "tiles s 3"], Float[Array, "tiles 6 s"]]:
    """Directions at which a tile's lobe is taken, and the fit from there to the coefficients of φ.

    In the plane that touches the sphere at the tile's centre the quadratic monomials, divided by
    b_c², are those of the plane's coordinates. So the fit to the nodes is the same for all tiles,
    up to 1/b_c² of each node.
    """
    places, fit = _plane()
    places, fit = jnp.asarray(places, frames.scale.dtype), jnp.asarray(fit, frames.scale.dtype)
    offsets = places[None] * frames.scale[:, None]
    directions = frames.centre[:, None] + jnp.matmul(offsets, frames.across, precision="highest")
    square = 1 + offsets[..., 0] ** 2 + offsets[..., 1] ** 2
    return directions / jnp.sqrt(square)[..., None], fit[None] * square[:, None]


def constant(frames: Frames) -> Float[Array, "tiles 6"]:
    """Coefficients of φ for the function one, |B|² = b_c² + s_u² u² + s_w² w²."""
    one, zero = jnp.ones_like(frames.scale[:, 0]), jnp.zeros_like(frames.scale[:, 0])
    u, w = frames.scale.T
    return jnp.stack([one, zero, zero, u * u, zero, w * w], axis=-1)


def _plane() -> tuple[np.ndarray, np.ndarray]:
    """Nodes in the plane, the middle and six around it, and the least-squares fit to them."""
    angles = 2 * math.pi * np.arange(6) / 6
    ring = 0.85 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    places = np.concatenate([np.zeros((1, 2)), ring])
    u, w = places.T
    return places, np.linalg.pinv(np.stack([u**i * w**j for i, j in POWERS], axis=-1))


def _basis(mean: Float[Array, "n 3"]) -> tuple[Array, Array, Array]:
    """The unit vector along each mean (z where it is zero) and two across it."""
    length = jnp.sqrt(jnp.sum(mean * mean, axis=-1, keepdims=True))
    up = jnp.asarray([[0.0, 0.0, 1.0]], mean.dtype)
    centre = jnp.where(length > 1e-6, mean / jnp.maximum(length, 1e-6), up)
    x, y, z = centre.T
    # Duff et al. 2017, "Building an orthonormal basis, revisited".
    sign = jnp.where(z < 0, -1.0, 1.0).astype(mean.dtype)
    a = -1 / (sign + z)
    b = x * y * a
    first = jnp.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    return centre, first, jnp.stack([b, sign + y * y * a, -y], axis=-1)
