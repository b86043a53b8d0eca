"""Resampling any picture of the sphere to a lat-long one, by means over solid angles."""

import math

import numpy as np
from jaxtyping import Float

from ._layouts import Tiles, tiles

# Samples taken at a time, so few that they stay in the cache.
_BLOCK = 1 << 15
# Samples along each side of a pixel: at least so many, and twice the source's pixels.
_LEAST, _MOST = 4, 64
_DEFAULT_MAX_HEIGHT = 2048


def resample(
    layout: str,
    picture: Float[np.ndarray, "h w 3"],
    axes: Float[np.ndarray, "3 3"],
    height: int | None,
    *,
    at_edges: bool = False,
) -> Float[np.ndarray, "height width 3"]:
    """Resample to a lat-long picture in our orientation, `height` rows of twice as many columns.

    By default as many columns as the source has pixels on a great circle, up to 2048 rows; float32.
    Each pixel is the mean of n × n samples of equal solid angle, bilinear in the source, with n
    such that there are two or more to a source pixel along each side (4 ≤ n ≤ 64). With `at_edges`
    the outermost pixels are centered on the picture's, or the faces', edges, as OpenEXR's are.
    """
    # A power of two changes no digit, and keeps sums in float32's range.
    largest = picture.max()
    scale = np.float32(2.0 ** (math.frexp(largest)[1] - 1))
    source = tiles(layout, picture / scale, at_edges)
    height = height or min(max(1, source.around // 2), _DEFAULT_MAX_HEIGHT)
    width = 2 * height
    n = min(max(_LEAST, math.ceil(2 * source.around / width)), _MOST)
    # Steps in φ and in cos θ are steps of equal solid angle.
    phi = (np.arange(width * n) + 0.5) * 2 * np.pi / (width * n)
    edges = np.cos(np.arange(height + 1) * np.pi / height)
    share = (np.arange(n) + 0.5) / n
    z = edges[:-1, None] + (edges[1:] - edges[:-1])[:, None] * share

    image = np.empty((height, width, 3), np.float32)
    rows = max(1, _BLOCK // (width * n * n))
    columns = max(1, min(width, _BLOCK // (n * n)))
    for i in range(0, height, rows):
        for j in range(0, width, columns):
            directions = _directions(z[i : i + rows].ravel(), phi[j * n : (j + columns) * n])
            seen = _look_up(source, axes.astype(np.float32) @ directions)
            cells = seen.reshape(len(image[i : i + rows]), n, -1, n, 3)
            image[i : i + rows, j : j + columns] = cells.mean(axis=(1, 3))
    return np.clip(image, 0, largest / scale) * scale  # rounding may have gone beyond


def _directions(z: np.ndarray, phi: np.ndarray) -> Float[np.ndarray, "3 n"]:
    radius = np.sqrt(np.maximum(0, 1 - z**2))
    grid = np.empty((3, len(z), len(phi)), np.float32)
    np.multiply.outer(radius, np.cos(phi), out=grid[0])
    np.multiply.outer(radius, np.sin(phi), out=grid[1])
    grid[2] = z[:, None]
    return grid.reshape(3, -1)


def _look_up(source: Tiles, directions: Float[np.ndarray, "3 n"]) -> Float[np.ndarray, "n 3"]:
    tile, row, column = source.locate(*directions)
    _, height, width, _ = source.pixels.shape
    # Rounding may carry a place over the border's center.
    i = np.clip(np.floor(row), -1, height - 3)
    j = np.clip(np.floor(column), -1, width - 3)
    down, right = (row - i)[:, None], (column - j)[:, None]
    flat = source.pixels.reshape(-1, 3)
    first = (tile * height + i.astype(np.int32) + 1) * width + j.astype(np.int32) + 1
    upper = flat.take(first, 0)
    upper += (flat.take(first + 1, 0) - upper) * right
    lower = flat.take(first + width, 0)
    lower += (flat.take(first + width + 1, 0) - lower) * right
    return upper + (lower - upper) * down
