"""Coefficients in their places, degree by order."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import ArrayLike, Float
from matplotlib.axes import Axes
from matplotlib.ticker import Formatter, MaxNLocator

from .._core.checks import check_flag, check_type
from ..harmonics import degree_of, degrees, orders
from ._arrays import check_labels, read_coefficients
from ._axes import color_bar, panels
from ._colors import color_scale, text_on

_NUMBERS = 4  # the highest degree at which numbers fit into their squares


def coefficients(
    coefficients: Float[ArrayLike, "*batch k"],
    *,
    titles: Sequence[str] | None = None,
    label: str = "coefficient cₗₘ, in f · √sr",
    limits: float | tuple[float, float] | None = None,
    numbers: bool | None = None,
    colorbar: bool = True,
    ax: Axes | Sequence[Axes] | np.ndarray | None = None,
) -> np.ndarray:
    """Draw coefficients in false color in their places: degree l downwards, order m to the right.

    Colors go around zero, blue below and red above, on one scale for all functions. Each function
    has a panel of its own; three (3, K) without titles are taken for the R, G, B of a light.

    **Arguments**

    - `coefficients`: (..., K), jax or numpy. (rows, columns, K) keeps its grid of panels.
    - `titles`: a title per panel.
    - `label`: beside the color bar. Coefficients of f are in the unit of f times √sr.
    - `limits`: the largest |c| that has a color of its own, or (low, high); by default the largest.
    - `numbers`: whether the numbers are written into the squares; by default up to degree 4 of a
      single function.
    - `colorbar`: False leaves it away, where pictures share one.
    - `ax`: axes, as many as functions; by default those of a new figure.

    **Returns**

    The axes, a one-dimensional array with one per function. Runs on the host. Raises `ValueError`
    for a K that is not a square, values that are not finite, and axes or titles that are not as
    many as functions.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import plot
    >>> (ax,) = plot.coefficients(np.array([1.0, 0.0, 3.0, -4.0]))
    >>> [text.get_text() for text in ax.texts]
    ['1', '0', '3', '−4']
    """
    check_type("label", label, str)
    colorbar = check_flag("colorbar", colorbar)
    values = read_coefficients(coefficients)
    functions = values.reshape(-1, values.shape[-1])
    check_labels("titles", titles, len(functions))
    if titles is None and values.shape[:-1] == (3,):
        titles = "RGB"
    degree = degree_of(values.shape[-1])
    if numbers is None:
        numbers = len(functions) == 1 and degree <= _NUMBERS
    numbers = check_flag("numbers", numbers)
    scale = color_scale(functions, limits, False, signed=True)
    square = 0.62 if numbers else 0.3  # inches
    size = max(3.0, square * (2 * degree + 1) + 1.2), max(2.2, square * (degree + 1) + 0.9)
    axes = panels(ax, values.shape[:-1], size)
    for number, (panel, function) in enumerate(zip(axes, functions, strict=True)):
        _draw(panel, function, degree, scale, numbers)
        if titles is not None:
            panel.set_title(titles[number])
    if colorbar:
        color_bar(list(axes), scale, label)
    return axes


def _draw(ax: Axes, function, degree: int, scale, numbers: bool) -> None:
    rows, columns = degrees(degree), orders(degree) + degree
    table = np.full((degree + 1, 2 * degree + 1), np.nan)
    table[rows, columns] = function
    ax.imshow(
        table,
        extent=(-degree - 0.5, degree + 0.5, degree + 0.5, -0.5),
        aspect="equal",
        origin="upper",
        cmap=scale.cmap,
        norm=scale.norm,
        interpolation="nearest",
    )
    # A square of coefficient zero is white: its border shows that it is there.
    for l in range(degree + 1):
        x, y = np.meshgrid(np.arange(-l, l + 2) - 0.5, [l - 0.5, l + 0.5])
        ax.plot(x, y, color="0.7", linewidth=0.5)
        ax.plot(x.T, y.T, color="0.7", linewidth=0.5)
    if numbers:
        for l, m, value in zip(rows, columns - degree, function, strict=True):
            said = Formatter.fix_minus(f"{value:.2g}")
            color = text_on(scale.colors(np.asarray(value)))
            ax.text(m, l, said, ha="center", va="center", color=color, fontsize="small")
    ax.set(xlim=(-degree - 0.55, degree + 0.55), ylim=(degree + 0.55, -0.55))
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MaxNLocator(integer=True))
    ax.set_xlabel("order m")
    ax.set_ylabel("degree l")
    ax.spines[:].set_visible(False)
