"""Axes to draw on, and what stands beside a picture: color bars, bars of length."""

import math
from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import LogNorm
from matplotlib.lines import Line2D
from matplotlib.ticker import LogFormatter, StrMethodFormatter

from .._core.checks import check_all, check_type
from ._colors import ColorScale


def flat_axes(ax: Axes | None, size: tuple[float, float]) -> Axes:
    """Take the axes given, or those of a new figure of this size in inches."""
    if ax is None:
        from matplotlib import pyplot

        return pyplot.subplots(figsize=size, layout="constrained")[1]
    check_type("ax", ax, Axes)
    if ax.name == "3d":
        raise ValueError('expected flat axes for ax, got some made with projection="3d"')
    return ax


def panels(
    ax: Axes | Sequence[Axes] | np.ndarray | None,
    shape: tuple[int, ...],
    size: tuple[float, float],
) -> np.ndarray:
    """Take axes for each function of the leading axes `shape`, as given or of a new figure."""
    count = math.prod(shape)
    if ax is None:
        return _new_panels(shape, size)
    if not isinstance(ax, Axes):
        check_all("ax", list(ax) if isinstance(ax, np.ndarray) and ax.ndim else ax, object)
    axes = np.array([ax] if isinstance(ax, Axes) else list(np.ravel(np.asarray(ax, object))))
    for one in axes:
        flat_axes(one, size)
    if len(axes) != count:
        raise ValueError(f"expected {count} axes, one per function, got {len(axes)}")
    return axes


def _new_panels(shape: tuple[int, ...], size: tuple[float, float]) -> np.ndarray:
    from matplotlib import pyplot

    count = math.prod(shape)
    square = count if count <= 4 else math.ceil(math.sqrt(count))
    columns = shape[1] if len(shape) == 2 else square
    rows = math.ceil(count / columns)
    figure, grid = pyplot.subplots(
        rows,
        columns,
        figsize=(size[0] * columns, size[1] * rows),
        squeeze=False,
        layout="constrained",
    )
    for unused in grid.ravel()[count:]:
        figure.delaxes(unused)
    return grid.ravel()[:count]


def color_bar(axes: Axes | Sequence[Axes], scale: ColorScale, label: str) -> Colorbar:
    """Draw a bar beside the axes, from which it takes the room."""
    beside = [axes] if isinstance(axes, Axes) else list(axes)
    bar = beside[0].figure.colorbar(
        ScalarMappable(scale.norm, scale.cmap),
        ax=beside if len(beside) > 1 else beside[0],  # tight_layout knows a bar of one alone
        label=label,
        extend=scale.extend,
        fraction=0.046,
        pad=0.03,
    )
    if isinstance(scale.norm, LogNorm):
        plain_logarithm(bar.ax.yaxis)
    return bar


class _Plain(LogFormatter):
    """Writes as plain numbers what its base would write as powers."""

    def __call__(self, x, pos=None):
        return f"{x:g}" if super().__call__(x, pos) else ""


def plain_logarithm(axis: Axis) -> None:
    """Label a logarithmic axis with plain numbers, between the powers of ten where they are few."""
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(_Plain(labelOnlyBase=False, minor_thresholds=(2, 0.4)))


def length_bar(ax: Axes, per_length: float, said: str, unit: str, *, left: bool = False) -> None:
    """Draw a bar of a round length below the picture's corner; one length is so many of x."""
    first, last = sorted(ax.get_xlim())
    length = round_down(0.3 * (last - first) / per_length)
    color = matplotlib.rcParams["text.color"]
    place = ax.get_xaxis_transform()  # x as in the picture, y as a share of the axes
    start = first if left else last - length * per_length
    end = start + length * per_length
    ax.add_artist(
        Line2D([start, end], [-0.03, -0.03], color=color, lw=2, transform=place, clip_on=False)
    )
    ax.text(
        start if left else end,
        -0.05,
        f"{said}{length:g} {unit}".strip(),
        transform=place,
        ha="left" if left else "right",
        va="top",
        color=color,
        fontsize="small",
    )


def round_down(value: float) -> float:
    """Find the largest of 1, 2 and 5 times a power of ten that is not above the value."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(step * power for step in (1, 2, 5) if step * power <= value * (1 + 1e-9))
