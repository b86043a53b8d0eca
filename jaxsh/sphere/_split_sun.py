"""The sun, or any bright compact source, taken out of a light probe."""

import warnings
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from .._core.checks import as_host_float, check_finite, check_number, check_size, said_dtype
from .._core.host import put
from .._core.pictures import check_shape
from ._bright_regions import Coarse, grown
from ._suns import Suns, local_frames

_RING = 2  # cells around a source that say what is behind it
_POINTS = 4  # points for each ray, of which no one outweighs a quarter of a ray


class _Source(NamedTuple):
    """Light that was taken out of some of a picture's pixels."""

    rows: np.ndarray
    columns: np.ndarray
    flux: Float[np.ndarray, "n 3"]
    solid_angle: Float[np.ndarray, " n"]


def split_sun(
    image: Float[ArrayLike, "h w 3"],
    count: int = 1,
    *,
    threshold: float = 4.0,
    largest: float = 0.1,
    least: float = 0.005,
    rays: int = 64,
) -> tuple[Suns, Float[Array, "h w 3"]]:
    """Take the brightest compact sources out of a light probe: the sun, lamps, windows.

    Harmonics of a low degree cannot hold a small bright source: cut off, it rings, below zero too.
    So it is shaded by rays of its own, and the rest of the picture by its coefficients.

    A source is a connected region brighter than `threshold` times the mean of the picture, which
    is taken without what is above that; where a region is wider than `largest`, the peaks in it
    that are not. Of each, what is brighter than the median of its surroundings is taken out of the
    picture, channel by channel. Regions are found on a copy of at most 256 rows, so that leaves or
    noise do not tear a sun apart, and cut out pixel by pixel.

    **Arguments**

    - `image`: (H, W, 3), lat-long as for `project_lat_long`, linear radiance.
    - `count`: how many sources at most, those with the most light. One for a sunny panorama; in
      rooms windows count: shadowed irradiance at degree 10 is off by 9.3, 2.3, 0.9 and 0.7 % with
      0, 1, 4 and 8 of Galileo's tomb.
    - `threshold`: a number >= 1. Any from 2 to 8 leaves the same error within 1.5 %.
    - `largest`: the solid angle of a region in steradians; 0.1 is 20° across. Any from 0.1 to 0.3
      leaves about the same error.
    - `least`: the share of all light that a source has at least.
    - `rays`: unit vectors in the `shape` of the sources, with equal shares of the light.

    These figures are of real probes: `python -m experiments run sharp --preset paper`.

    **Returns** the `Suns`, brightest first, and the picture without them, in its dtype. What is
    taken from the picture is in the suns: integrals over the sphere (weights of `lat_long`) agree
    to rounding. There are fewer than `count` where no more stand out: none at all, with a
    `UserWarning`, under an overcast sky or in a picture that is black or uniform, where clipping
    has left nothing bright, and where what stands out is wider than `largest`, as it then says.
    Runs in NumPy on the host, before `jit`, `vmap` and `grad`.
    Raises `ValueError` for a picture that `project_lat_long` would refuse, one with NaN or
    infinite values, or without three channels.

    **Example**

    >>> from jaxsh import imaging, sphere
    >>> suns, rest = sphere.split_sun(imaging.studio(64, 128))
    >>> light = sphere.project_lat_long(rest, degree=4)  # to be shaded beside the suns
    >>> [round(float(x), 2) for x in suns.direction[0]]
    [-0.55, -0.62, 0.56]
    """
    codes = getattr(image, "dtype", None)
    if codes is not None and np.issubdtype(codes, np.integer):
        raise ValueError(f"expected image in floats, got {said_dtype(codes)}")
    image = as_host_float(image, "image")
    check_shape("image", image.shape, lat_long=True)
    if image.shape[-1] != 3:
        raise ValueError(f"expected image (height, width, 3), RGB, got shape {image.shape}")
    check_finite("image", image, wait=True)
    count = check_size("count", count)
    rays = check_size("rays", rays)
    threshold = check_number("threshold", threshold, least=1.0)
    largest = check_number("largest", largest, above=0.0, most=4 * np.pi)
    least = check_number("least", least, least=0.0, most=1.0)

    coarse = Coarse.of(image)
    rest = np.array(image, jax.dtypes.canonicalize_dtype(image.dtype))
    # Half precision ends at 65,504, which is dark for a sun.
    dtype = rest.dtype if rest.dtype.itemsize > 2 else np.dtype(np.float32)
    sources = []
    for region in _brightest(coarse, count, threshold, largest, least):
        source = _take(rest, coarse, region)
        if source.flux.any():
            sources.append(source)
    if not sources:
        wide = _brightest(coarse, 1, threshold, 4 * np.pi, least)
        width = coarse.solid_angle[wide[0]].sum() if wide else 0.0
        warnings.warn(
            "there is no sun to split off: nothing compact in the picture stands out of its "
            f"surroundings with {100 * least:g} % of the light"
            + (f"; what does is {width:.2g} sr wide, more than {largest=:g}" if wide else ""),
            UserWarning,
            stacklevel=2,
        )
    return _suns(sources, image.shape[:2], rays, dtype), jax.device_put(rest)


def _brightest(
    coarse: Coarse, count: int, threshold: float, largest: float, least: float
) -> list[Bool[np.ndarray, "h w"]]:
    """The regions with the most light in excess of their surroundings, brightest first."""
    level = threshold * coarse.level(threshold)
    enough = least * float((coarse.brightness * coarse.solid_angle).sum())
    found = []
    for region in coarse.regions(level, largest=largest, least=enough):
        around = grown(region, _RING) & ~region
        behind = np.median(coarse.brightness[around]) if around.any() else 0.0
        over = np.maximum(coarse.brightness[region] - behind, 0)
        flux = float(over @ coarse.solid_angle[region])
        if flux >= enough and flux > 0:
            found.append((flux, region))
    found.sort(key=lambda pair: -pair[0])
    return [region for _, region in found[:count]]


def _take(
    rest: Float[np.ndarray, "H W 3"], coarse: Coarse, region: Bool[np.ndarray, "h w"]
) -> _Source:
    """Cut a region's pixels down to the median of those around it, in place; gives what was cut."""
    region = grown(region, 1)
    around = grown(region, _RING) & ~region
    rows, columns = _pixels(coarse, region)
    behind = rest[_pixels(coarse, around)] if around.any() else np.zeros((1, 3), rest.dtype)
    before = rest[rows, columns]
    after = np.minimum(before, np.median(behind, axis=0).astype(rest.dtype)[None])
    rest[rows, columns] = after
    solid_angle = coarse.weights[rows]
    flux = (before.astype(np.float64) - after) * solid_angle[:, None]
    kept = flux.any(axis=1)
    return _Source(rows[kept], columns[kept], flux[kept], solid_angle[kept])


def _pixels(coarse: Coarse, cells: Bool[np.ndarray, "h w"]) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of all pixels of some cells."""
    rows, columns = [], []
    for i in np.flatnonzero(cells.any(axis=1)):
        across = np.flatnonzero(np.repeat(cells[i], np.diff(coarse.columns)))
        down = np.arange(coarse.rows[i], coarse.rows[i + 1])
        rows.append(np.repeat(down, len(across)))
        columns.append(np.tile(across, len(down)))
    return np.concatenate(rows), np.concatenate(columns)


def _suns(sources: list[_Source], size: tuple[int, int], rays: int, dtype: np.dtype) -> Suns:
    direction, solid_angle = np.zeros((len(sources), 3)), np.zeros(len(sources))
    radiance, shape = np.zeros((len(sources), 3)), np.zeros((len(sources), rays, 3))
    for i, source in enumerate(sources):
        weights = source.flux.sum(axis=1)
        # Of a uniform source with the same light and the same mean square of the radiance.
        solid_angle[i] = weights.sum() ** 2 / (weights**2 / source.solid_angle).sum()
        radiance[i] = source.flux.sum(axis=0) / solid_angle[i]
        points, weights = _points(source, weights / weights.sum(), size, rays)
        middle = weights @ points
        direction[i] = middle / np.linalg.norm(middle)
        frame = local_frames(direction[i : i + 1])[0]
        shape[i] = _equal_shares(points @ frame, weights, rays)
    order = np.argsort(-(radiance.sum(axis=1) * solid_angle))
    arrays = (direction[order], solid_angle[order], radiance[order], shape[order])
    return Suns(*(put(array, dtype) for array in arrays))


def _points(
    source: _Source, share: Float[np.ndarray, " n"], size: tuple[int, int], rays: int
) -> tuple[Float[np.ndarray, "m 3"], Float[np.ndarray, " m"]]:
    """Directions within a source's pixels with their shares of its light, many for a bright one."""
    side = np.ceil(np.sqrt(share * rays * _POINTS)).astype(np.int64)
    pixel = np.repeat(np.arange(len(share)), side**2)
    within = np.arange(len(pixel)) - np.repeat(np.cumsum(side**2) - side**2, side**2)
    down, across = np.divmod(within, side[pixel])
    height, width = size
    theta = (source.rows[pixel] + (down + 0.5) / side[pixel]) * np.pi / height
    phi = (source.columns[pixel] + (across + 0.5) / side[pixel]) * 2 * np.pi / width
    sine = np.sin(theta)
    points = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)
    return points, share[pixel] / side[pixel] ** 2


def _equal_shares(
    points: Float[np.ndarray, "n 3"], weights: Float[np.ndarray, " n"], count: int
) -> Float[np.ndarray, "count 3"]:
    """The middles of `count` parts of equal light: halves of halves, across the longer way.

    Neighbors in the result are neighbors on the sphere.
    """
    if count == 1:
        middle = weights @ points
        return (middle / np.linalg.norm(middle))[None]
    flat = points[:, :2] - weights @ points[:, :2] / weights.sum()
    axis = np.argmax(weights @ flat**2)
    order = np.argsort(points[:, axis], kind="stable")
    points, weights = points[order], weights[order]
    first = count // 2
    upto = np.cumsum(weights)
    cut = upto[-1] * first / count
    # A point on the cut belongs to both sides in part.
    left = np.clip(cut - (upto - weights), 0, weights)
    halves = []
    for part, number in ((left, first), (weights - left, count - first)):
        has = part > 0
        halves.append(_equal_shares(points[has], part[has], number))
    return np.concatenate(halves)
