"""Bright regions of a lat-long picture, found on a coarse copy: connected pixels above a level.

Runs on the host. A region is given by the cells of the coarse copy, which stand for blocks of the
picture's pixels; the picture goes on over its seam and over its poles.
"""

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ._quadrature import fejer_weights

_ROWS = 256  # of the coarse copy: 0.7° to a cell, a little more than the sun is wide
_STEP = 1.25  # from level to level


class Coarse(NamedTuple):
    """A picture's brightness by cells, and which of its rows and columns each cell has."""

    brightness: Float[np.ndarray, "h w"]  # mean over the cell, all channels summed; never below 0
    solid_angle: Float[np.ndarray, "h w"]
    rows: Int[np.ndarray, " h+1"]
    columns: Int[np.ndarray, " w+1"]
    weights: Float[np.ndarray, " H"]  # solid angle of a pixel of each of the picture's rows

    @classmethod
    def of(cls, image: Float[np.ndarray, "H W c"]) -> "Coarse":
        height, width, _ = image.shape
        block = -(-height // _ROWS)
        rows, columns = _edges(height, block), _edges(width, block)
        weights = fejer_weights(height) * 2 * np.pi / width
        counts = np.diff(columns)
        flux = np.empty((len(rows) - 1, len(columns) - 1))
        solid_angle = np.empty_like(flux)
        for i, (first, last) in enumerate(itertools.pairwise(rows)):
            weight = weights[first:last]
            row = np.einsum("hwc,h->w", image[first:last], weight, dtype=np.float64)
            flux[i] = np.add.reduceat(row, columns[:-1])
            solid_angle[i] = weight.sum() * counts
        # What is below zero, as of a picture made from coefficients, is no light to be found.
        return cls(np.maximum(flux / solid_angle, 0), solid_angle, rows, columns, weights)

    def level(self, threshold: float) -> float:
        """The mean m of the brightness where that is cut off at `threshold` times m itself.

        What is above does not enter, so that one bright source does not hide the next.
        """
        mean = np.average(self.brightness, weights=self.solid_angle)
        for _ in range(200):
            cut = np.minimum(self.brightness, threshold * mean)
            last, mean = mean, np.average(cut, weights=self.solid_angle)
            if mean >= 0.999 * last:
                break
        return float(mean)

    def regions(
        self, level: float, *, largest: float, least: float
    ) -> Iterator[Bool[np.ndarray, "h w"]]:
        """Connected cells above `level`, each at the lowest level at which it is small enough.

        What is wider than `largest` steradians is looked at again at the next level, where it
        falls apart, down to the last peak. What sheds less than `least` is left out.
        """
        flux = self.brightness * self.solid_angle
        waiting = [(level, self.brightness > level)]
        while waiting:
            level, mask = waiting.pop()
            labels, count = _label(mask)
            areas, fluxes = (
                np.bincount(labels.ravel(), x.ravel(), count + 1) for x in (self.solid_angle, flux)
            )
            found = fluxes >= least
            found[0] = False
            for region in np.flatnonzero(found & (areas <= largest)):
                yield labels == region
            wide = (found & (areas > largest))[labels]
            if wide.any():
                level = _next(level, float(self.brightness[wide].min()))
                waiting.append((level, wide & (self.brightness > level)))


def grown(mask: Bool[np.ndarray, "h w"], reach: int) -> Bool[np.ndarray, "h w"]:
    """Cells of a mask and all that are up to `reach` cells away from it, on the sphere."""
    for _ in range(reach):
        mask = np.pad(mask | np.roll(mask, 1, axis=1) | np.roll(mask, -1, axis=1), ((1, 1), (0, 0)))
        mask = mask[:-2] | mask[1:-1] | mask[2:]
        for pole in (0, -1):
            mask[pole] |= mask[pole].any()
    return mask


def _next(level: float, least: float) -> float:
    """The next level that changes anything: where the rest is black, the first is far below."""
    if level <= 0:
        return least
    return level * _STEP ** max(1, np.floor(np.log(least / level) / np.log(_STEP)))


def _edges(count: int, block: int) -> Int[np.ndarray, " n"]:
    return np.append(np.arange(0, count, block), count)


def _label(mask: Bool[np.ndarray, "h w"]) -> tuple[Int[np.ndarray, "h w"], int]:
    """Number the connected cells of a mask from 1, across the seam and the poles too."""
    number = np.where(mask, np.cumsum(mask).reshape(mask.shape), 0)
    # Each cell and its neighbors to the right and in the row below.
    wrapped = np.concatenate([number[:, -1:], number, number[:, :1]], axis=1)
    pairs = [(number, wrapped[:, 2:])]
    pairs += [(number[:-1], wrapped[1:, k : k + mask.shape[1]]) for k in range(3)]
    for row in (number[:1], number[-1:]):  # all of its cells touch the pole
        pairs.append((row, np.where(row > 0, row.max(), 0)))
    one, two = (np.concatenate([a.ravel() for a in side]) for side in zip(*pairs, strict=True))
    both = (one > 0) & (two > 0)
    # Number 0 is the background's, which has no link.
    _, least = np.unique(_joined(one[both], two[both], int(number.max()) + 1), return_inverse=True)
    return least[number], int(least.max())


def _joined(
    one: Int[np.ndarray, " n"], two: Int[np.ndarray, " n"], count: int
) -> Int[np.ndarray, " count"]:
    """The least of the things that links join each of `count` things with.

    SciPy's `connected_components`, whose import takes longer than all else that is done here.
    """
    least = np.arange(count)
    while True:
        one, two = least[one], least[two]
        apart = one != two
        if not apart.any():
            return least
        one, two = one[apart], two[apart]
        np.minimum.at(least, np.maximum(one, two), np.minimum(one, two))
        while ((further := least[least]) != least).any():
            least = further
