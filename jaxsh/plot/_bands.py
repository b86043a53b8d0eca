"""Power by degree."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import ArrayLike, Float
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from .._core.checks import check_type
from ..harmonics import degree_of, degrees
from ._arrays import check_labels, read_coefficients
from ._axes import flat_axes, plain_logarithm
from ._colors import CHANNELS

_MARKERS = "os^Dv"


def bands(
    coefficients: Float[ArrayLike, "*batch k"],
    *,
    labels: Sequence[str] | None = None,
    unit: str = "f² · sr",
    ax: Axes | None = None,
) -> Axes:
    """Draw the power of functions in each degree, Σ_m c_lm², on a logarithmic scale.

    The powers of all degrees sum to the integral of f² over the sphere (Parseval). One line per
    function; a degree without power has no point. Three functions (3, K) are taken for the R, G, B
    of a light and named so.

    **Arguments**

    - `coefficients`: (..., K), jax or numpy; every function of the leading axes is a line.
    - `labels`: a name per line, for a legend.
    - `unit`: of the power: that of f², times steradian.
    - `ax`: axes to draw on; by default those of a new figure.

    **Returns**

    The axes. Raises `ValueError` for a K that is not a square, values that are not finite, and
    labels that are not as many as functions.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import plot
    >>> ax = plot.bands(np.array([[1.0, 0.0, 3.0, 4.0]]), labels=["f"])
    >>> ax.get_lines()[0].get_ydata().tolist()
    [1.0, 25.0]
    """
    values = read_coefficients(coefficients)
    functions = values.reshape(-1, values.shape[-1])
    check_labels("labels", labels, len(functions))
    check_type("unit", unit, str)
    colors: Sequence[str | None] = [None]
    if values.shape[:-1] == (3,):
        colors, labels = CHANNELS, labels or "RGB"
    ax = flat_axes(ax, (6.4, 4.8))
    degree = degree_of(values.shape[-1])
    for number, function in enumerate(functions):
        power = np.bincount(degrees(degree), weights=function.astype(float) ** 2)
        ax.plot(
            np.arange(degree + 1),
            np.where(power > 0, power, np.nan),
            marker=_MARKERS[number % len(_MARKERS)],
            markersize=5,
            color=colors[number % len(colors)],
            label=None if labels is None else labels[number],
        )
    if np.any(functions):
        ax.set_yscale("log")
        plain_logarithm(ax.yaxis)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set_xlabel("degree l")
    ax.set_ylabel(f"power Σₘ cₗₘ², in {unit}")
    ax.grid(alpha=0.3)
    if labels is not None:
        ax.legend(frameon=False)
    return ax
