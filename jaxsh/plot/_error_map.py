"""A number over two parameters."""

import numpy as np
from jaxtyping import ArrayLike, Float
from matplotlib.axes import Axes
from matplotlib.ticker import Formatter

from .._core.checks import check_flag, check_type
from ._arrays import read
from ._axes import color_bar, flat_axes
from ._colors import color_scale, text_on


def error_map(
    errors: Float[ArrayLike, "rows columns"],
    x: Float[ArrayLike, " columns"],
    y: Float[ArrayLike, " rows"],
    *,
    label: str,
    x_label: str,
    y_label: str,
    limits: float | tuple[float, float] | None = None,
    log: bool = False,
    numbers: bool = False,
    colorbar: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw a number that depends on two parameters, as a fit's error on sun and turbidity.

    Colors are those of `vertices`: from zero up, or around zero where some errors are negative.
    Each cell reaches half way to the next one, so that both axes are true to scale; with `numbers`
    cells are of one size, and the values of x and y are written at each.

    **Arguments**

    - `errors`: (rows, columns), jax or numpy; row i belongs to y[i], column j to x[j].
    - `x`, `y`: the parameters, rising.
    - `label`, `x_label`, `y_label`: what is drawn and over what, with units.
    - `limits`, `log`: of the color bar, as in `vertices`.
    - `numbers`: whether the errors are written into their cells.
    - `colorbar`: False leaves it away, where pictures share one.
    - `ax`: axes to draw on; by default those of a new figure.

    **Returns**

    The axes, with y upwards. Raises `ValueError` for values that are not finite, parameters that do
    not rise, and shapes that do not fit.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import plot
    >>> ax = plot.error_map(
    ...     np.array([[0.1, 0.2], [0.4, 0.8]]), np.array([10.0, 60.0]), np.array([2.0, 8.0]),
    ...     label="error, %", x_label="sun's elevation, °", y_label="turbidity",
    ... )
    >>> ax.get_xlabel(), ax.figure.axes[1].get_ylabel()
    ("sun's elevation, °", 'error, %')
    """
    for name, text in (("label", label), ("x_label", x_label), ("y_label", y_label)):
        check_type(name, text, str)
    log, numbers = check_flag("log", log), check_flag("numbers", numbers)
    colorbar = check_flag("colorbar", colorbar)
    values = read("errors", errors)
    across, upwards = read("x", x), read("y", y)
    if across.ndim != 1 or upwards.ndim != 1 or values.shape != (len(upwards), len(across)):
        raise ValueError(
            f"expected errors (rows, columns) with x (columns,) and y (rows,), got shapes "
            f"{values.shape}, {across.shape} and {upwards.shape}"
        )
    if values.size == 0:
        raise ValueError(f"there is nothing to draw in errors of shape {values.shape}")
    for name, axis in (("x", across), ("y", upwards)):
        if not (np.diff(axis) > 0).all():
            raise ValueError(f"expected {name} to rise, got {np.array2string(axis, threshold=8)}")
    scale = color_scale(values, limits, log)
    ax = flat_axes(ax, (6.0, 4.4))
    if numbers:
        _draw_numbers(ax, values, across, upwards, scale)
    else:
        edges = [_edges(axis) for axis in (across, upwards)]
        ax.pcolormesh(
            *edges, values, cmap=scale.cmap, norm=scale.norm, edgecolors="face", linewidth=0.5
        )
    ax.set_xlabel(x_label)
    ax.set_ylabel(y_label)
    if colorbar:
        color_bar(ax, scale, label)
    return ax


def _draw_numbers(ax: Axes, values, x, y, scale) -> None:
    ax.imshow(values, origin="lower", aspect="auto", cmap=scale.cmap, norm=scale.norm)
    colors = scale.colors(values)
    for (i, j), value in np.ndenumerate(values):
        color = text_on(colors[i, j])
        said = Formatter.fix_minus(f"{value:.3g}")
        ax.text(j, i, said, ha="center", va="center", color=color, fontsize="small")
    ax.set_xticks(range(len(x)), [f"{one:g}" for one in x])
    ax.set_yticks(range(len(y)), [f"{one:g}" for one in y])


def _edges(centers: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n1"]:
    if len(centers) == 1:
        return np.array([centers[0] - 0.5, centers[0] + 0.5])
    middles = (centers[:-1] + centers[1:]) / 2
    return np.concatenate([[2 * centers[0] - middles[0]], middles, [2 * centers[-1] - middles[-1]]])
