"""Marks where a picture is negative, which light is not."""

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from matplotlib.transforms import ScaledTranslation

from ._colors import MARK

_ROUNDING = 1e-6  # of the largest radiance: negative light below this is rounding


def mark_negative(
    ax: Axes,
    x: Float[np.ndarray, " w"],
    y: Float[np.ndarray, " h"],
    lowest: Float[np.ndarray, "h w"],
    largest: float,
    share: str,
    below: float = 4.0,
) -> None:
    """Hatch where the least channel is negative, and say where and how low.

    That is said in a legend, so many points `below` the axes: above them is the title.
    """
    least = float(lowest.min())
    if not least < -_ROUNDING * largest:
        return
    hatched = ax.contourf(x, y, lowest, levels=[1.01 * least, 0.0], colors="none", hatches=["///"])
    hatched.set(edgecolor=MARK, linewidth=0.0)
    if lowest.max() > 0:
        ax.contour(x, y, lowest, levels=[0.0], colors=MARK, linewidths=1.2)
    text = f"negative: {share}, down to −{-least:.2g}"
    lower = ScaledTranslation(0, -below / 72, ax.figure.dpi_scale_trans)
    ax.legend(
        handles=[Patch(facecolor="none", edgecolor=MARK, hatch="///", label=text)],
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        bbox_transform=ax.transAxes + lower,
        borderaxespad=0,
        frameon=False,
        fontsize="small",
    )
