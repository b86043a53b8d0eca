"""Weights without samples that something hides, so that no light leaks through walls."""

import functools

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, Int

from .._core.checks import check_number, check_type
from .._core.xla import in_blocks, keep_rows, rounded_once, rows_at_once
from ._cube import RadianceCube
from ._expansion import check_positions
from ._weights import Weights

# Below this sum of positive weights that are left, all fade out: next to nothing sees the place.
_LEAST = 1e-3
# Positions of a block on one CPU, times samples: what is looked up for them stays in cache.
_PAIRS = 2**14


def visible_weights(
    weights: Weights,
    cubes: RadianceCube,
    positions: Float[ArrayLike, "v 3"],
    *,
    tolerance: float = 1e-3,
) -> Weights:
    """Take away the weights of samples that do not see a position, and give them to those that do.

    Samples on the far side of a wall have light that never comes through it. After Majercik,
    Guertin, Nowrouzezahrai & McGuire 2019, "Dynamic diffuse global illumination with ray-traced
    irradiance fields", but for the test: they compare distances with the mean and the variance of
    those around a direction, which takes positions close behind a wall for visible. The texels of a
    radiance cube know the plane of what they see, and a position is hidden behind it or not. Of the
    four texels around its direction more than half, by their bilinear shares, must let it be seen:
    a sample counts by 2 s - 1 of their share s.

    **Arguments**

    - `weights`: of S samples at V positions, which sum to one.
    - `cubes`: captured at the samples' points, S of them, of any resolution. What is smaller than a
      texel hides nothing.
    - `positions`: (V, 3).
    - `tolerance`: a position is hidden where it is farther than a surface by more than this share.
      Surfaces that bend within a texel need more, or hide themselves.

    **Returns** `Weights` of the same samples and in the same order. Their sum is one, but zero
    where no sample of positive weight sees the position: it is left black. In between, below 0.001
    of positive weights, they fade out. Where all samples see it, they are as they were. Elsewhere
    they lose linear precision, so that `interpolate`'s rule "half" does not fit. `shade` takes them
    too.

    Differentiable in weights and positions, forward and reverse, with kinks where the direction
    passes a texel's center and steps where a position crosses a surface; constant in the cubes.
    Raises `ValueError` for shapes that do not fit.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import midrange
    >>> corners = np.array([[2.0, -2, -2], [2, 2, -2], [2, 2, 2], [2, -2, 2]])
    >>> wall = midrange.Polygon(corners, np.ones(3), two_sided=True)
    >>> points = np.array([[0.0, 0, 0], [4, 0, 0]])
    >>> cubes = midrange.capture(midrange.Scene([wall]), points, 8)
    >>> positions = np.array([[1.0, 0, 0], [1.9, 0, 0], [2.1, 0, 0]])
    >>> weights = midrange.inverse_distance_weights(positions, points, exponent=1)
    >>> midrange.visible_weights(weights, cubes, positions).values.round(2).tolist()
    [[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
    """
    check_type("weights", weights, Weights)
    check_type("cubes", cubes, RadianceCube)
    tolerance = check_number("tolerance", tolerance, least=0.0)
    positions = check_positions(positions)
    if positions.ndim != 2 or len(positions) != len(weights.values):
        raise ValueError(
            f"expected positions ({len(weights.values)}, 3) for these weights, got shape "
            f"{positions.shape}"
        )
    if cubes.point.shape != (weights.samples, 3):
        raise ValueError(
            f"expected the cubes of {weights.samples} samples, got points {cubes.point.shape}"
        )
    values, cells = weights.values, weights.cells
    seen = functools.partial(_visible, resolution=cubes.resolution, tolerance=tolerance)
    planes = jax.lax.stop_gradient((cubes.normal, cubes.plane_distance, cubes.point))
    numbers = () if cells is None else (cells.cell,)
    samples = None if cells is None else cells.samples
    values = keep_rows(
        seen, planes, samples, positions, values, *numbers, like=values, axis=0, out=0
    )
    return Weights(values, cells)


@functools.partial(jax.jit, static_argnames=("resolution", "tolerance"))
def _visible(planes, samples, positions, values, *cell, resolution: int, tolerance: float):
    normal, plane_distance, point = (array.astype(values.dtype) for array in planes)
    texels = jnp.concatenate([normal, plane_distance[..., None]], axis=-1).reshape(-1, 4)

    def weigh(positions, values, *cell):
        if samples is None:
            which = jnp.broadcast_to(jnp.arange(len(point), dtype=jnp.int32)[None], values.shape)
        else:
            which = samples[cell[0]]
        offsets = positions.astype(values.dtype)[:, None] - point[which]
        numbers, shares = rounded_once(functools.partial(_around, resolution=resolution), offsets)
        found = texels[which[..., None] * (6 * resolution**2) + numbers]
        along = jnp.sum(found[..., :3] * offsets[..., None, :], axis=-1)
        ahead = along >= found[..., 3] * (1 + tolerance)
        visible = jnp.maximum(2 * jnp.sum(shares * ahead.astype(shares.dtype), axis=-1) - 1, 0)
        kept = values * visible
        # What the others lose goes to the samples that see the position. Without negative weights
        # this divides by what is left.
        given = jnp.maximum(values, 0) * visible
        total = jnp.sum(given, axis=-1, keepdims=True)
        share = given / jnp.maximum(total, _LEAST)
        whole = kept + (1 - jnp.sum(kept, axis=-1, keepdims=True)) * share
        # Negative weights alone, without those that they correct, would be negative light.
        return whole * jnp.minimum(total / _LEAST, 1)

    columns = values.shape[1]
    size, bytes_of_row = max(1, _PAIRS // columns), 24 * columns * values.dtype.itemsize
    most = rows_at_once(bytes_of_row)
    return in_blocks(weigh, positions, values, *cell, size=size, most=most)


def _around(
    offsets: Float[Array, "*batch 3"], resolution: int
) -> tuple[Int[Array, "*batch 4"], Float[Array, "*batch 4"]]:
    """Number the four texels around a direction, of its face alone, and weigh them bilinearly."""
    sizes = jnp.abs(offsets)
    axis = jnp.argmax(sizes, axis=-1).astype(jnp.int32)
    largest = jnp.max(sizes, axis=-1)
    x, y, z = (offsets[..., i] / jnp.where(largest > 0, largest, 1) for i in range(3))
    positive = jnp.take_along_axis(offsets, axis[..., None], axis=-1)[..., 0] >= 0
    # The table of `sphere.cube_map`, backwards.
    sign = jnp.where(positive, 1, -1).astype(offsets.dtype)
    u = jnp.select([axis == 0, axis == 1], [-sign * z, x], sign * x)
    v = jnp.where(axis == 1, sign * z, -y)
    face = 2 * axis + jnp.where(positive, 0, 1).astype(jnp.int32)
    columns, rows = (_neighbors(side, resolution) for side in (u, v))
    numbers, shares = [], []
    for row, i in zip(*rows, strict=True):
        for column, j in zip(*columns, strict=True):
            numbers.append((face * resolution + row) * resolution + column)
            shares.append(i * j)
    return jnp.stack(numbers, axis=-1), jnp.stack(shares, axis=-1)


def _neighbors(side: Float[Array, "*batch"], resolution: int):
    """Find the centers on both sides of a place from -1 to 1, and their shares."""
    place = jnp.clip((side + 1) * (resolution / 2) - 0.5, 0, resolution - 1)
    first = jnp.minimum(jnp.floor(place).astype(jnp.int32), max(resolution - 2, 0))
    share = place - first.astype(place.dtype)
    second = jnp.minimum(first + 1, resolution - 1)
    return (first, second), (1 - share, share)
