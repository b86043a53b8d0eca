"""Colors for numbers, which tell those apart who see red and green as one.

Sequential from zero up (viridis), diverging around zero where values have both signs (RdBu).
"""

from typing import Any, NamedTuple

import matplotlib
import numpy as np
from jaxtyping import Float
from matplotlib.colors import Colormap, LogNorm, Normalize

from .._core.checks import check_number, described
from .._core.srgb import LUMINANCE

POSITIVE = "#e07b39"
NEGATIVE = "#3b7dd8"
# R, G and B, of different lightness (Okabe and Ito, 2008).
CHANNELS = ("#d55e00", "#009e73", "#0072b2")
MARK = "#ff00ff"  # of negative light

_SEQUENTIAL, _DIVERGING = "viridis", "RdBu_r"
_DECADES = 1e-4  # of the largest value: where a logarithmic scale begins by itself


class ColorScale(NamedTuple):
    """Tells where a number stands between two limits, and its color."""

    norm: Normalize
    cmap: Colormap
    extend: str  # the ends beyond which there are values

    def colors(self, values: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape 3"]:
        """Give RGB in 0 to 1."""
        return np.asarray(self.cmap(self.norm(values)))[..., :3]


def color_scale(
    values: Float[np.ndarray, "..."], limits: Any, log: bool, *, signed: bool = False
) -> ColorScale:
    """Choose colors for values: around zero where some are negative, or where it is said."""
    lowest, highest = float(values.min()), float(values.max())
    low, high = _bounds(limits)
    largest = high if high is not None else max(-lowest, highest) or 1.0
    if log:
        if lowest < 0:
            raise ValueError(f"log needs values that are not negative, got {lowest:g}")
        if low is None:
            low = max(lowest, _DECADES * largest)
            if lowest == highest == largest:  # all the same: a decade below it
                low = largest / 10
        if not 0 < low < largest:
            raise ValueError(f"log needs limits above zero that differ, got ({low:g}, {largest:g})")
        norm: Normalize = LogNorm(low, largest, clip=True)
    else:
        if low is None:
            low = -largest if signed or lowest < 0 else 0.0
        norm = Normalize(low, largest)
    high = largest
    under, over = lowest < low, highest > high
    extend = {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[under, over]
    centered = low == -high and not log
    return ColorScale(norm, matplotlib.colormaps[_DIVERGING if centered else _SEQUENTIAL], extend)


def _bounds(limits: Any) -> tuple[float | None, float | None]:
    """Read the lower and the upper bound, where they are said."""
    if limits is None:
        return None, None
    if isinstance(limits, tuple | list) or (isinstance(limits, np.ndarray) and limits.ndim):
        if len(limits) != 2:
            raise ValueError(f"expected limits as (low, high), got {described(limits)}")
        low, high = (check_number("limits", one) for one in limits)
        if not low < high:
            raise ValueError(f"expected limits with low < high, got ({low:g}, {high:g})")
        return low, high
    return None, check_number("limits", limits, above=0.0)


def text_on(color: Float[np.ndarray, " 3"]) -> str:
    """Choose black or white, whichever stands out from an encoded color (luma of Rec. 601)."""
    return "black" if float(np.dot(color, (0.299, 0.587, 0.114))) > 0.5 else "white"


def rgba(
    colors: Float[np.ndarray, "*shape 3"], alpha: Float[np.ndarray, "*shape"]
) -> Float[np.ndarray, "*shape 4"]:
    """Put encoded colors, clipped, and their alpha together."""
    return np.concatenate([np.clip(colors, 0, 1), alpha[..., None]], axis=-1)


def luminance(radiance: Float[np.ndarray, "*shape c"]) -> Float[np.ndarray, "*shape"]:
    """Take the luminance of linear sRGB (Rec. 709); of one channel the channel."""
    if radiance.shape[-1] == 1:
        return radiance[..., 0]
    return radiance @ np.array(LUMINANCE, radiance.dtype)
