"""Power by degree."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import ArrayLike, Float
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from ..harmonics import degree_of, degrees
from ._arrays import CHANNELS, check_axes, check_labels, read_coefficients


def bands(
    coefficients: Float[ArrayLike, "*batch k"],
    *,
    labels: Sequence[str] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the power of functions in each degree, Σ_m c_lm², on a logarithmic scale.

    The powers of all degrees sum to the integral of f² over the sphere (Parseval). One line per
    function; a degree without power has no point. Three functions (3, K) are taken for the R, G, B
    of a light and drawn in these colors.

    **Arguments**

    - `coefficients`: (..., K), jax or numpy; every function of the leading axes is a line.
    - `labels`: a name per line, for a legend.
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
    colors: Sequence[str | None] = CHANNELS if values.shape[:-1] == (3,) else [None]
    check_labels("labels", labels, len(functions))
    check_axes(ax)
    if ax is None:
        from matplotlib import pyplot

        _, ax = pyplot.subplots(layout="constrained")
    degree = degree_of(values.shape[-1])
    for number, function in enumerate(functions):
        power = np.bincount(degrees(degree), weights=function.astype(float) ** 2)
        ax.plot(
            np.arange(degree + 1),
            np.where(power > 0, power, np.nan),
            marker="o",
            markersize=4,
            color=colors[number % len(colors)],
            label=None if labels is None else labels[number],
        )
    if np.any(functions):
        ax.set_yscale("log")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set_xlabel("degree l")
    ax.set_ylabel("power  Σₘ cₗₘ²")
    ax.grid(alpha=0.3)
    if labels is not None:
        ax.legend(frameon=False)
    return ax
