"""Functions on the sphere as balloons."""

import math
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb

from .._core.checks import check_flag, check_size
from ..harmonics import degree_of, evaluate
from ._arrays import NEGATIVE, POSITIVE, check_labels, read_coefficients

_VIEW = {"elev": 22.0, "azim": 35.0}


def lobes(
    coefficients: Float[ArrayLike, "*batch k"],
    *,
    titles: Sequence[str] | None = None,
    same_scale: bool = True,
    resolution: int | None = None,
    ax: Axes | Sequence[Axes] | np.ndarray | None = None,
) -> np.ndarray:
    """Draw functions on the sphere as balloons: the radius is |f|, the color tells the sign.

    Orange is positive, blue negative; z points up, and short lines mark +x, +y, +z. Each function
    has a panel of its own.

    **Arguments**

    - `coefficients`: (..., K), jax or numpy. (rows, columns, K) keeps its grid of panels; other
      functions are laid out in a row up to four, and above in a grid near a square.
    - `titles`: a title per panel.
    - `same_scale`: whether one radius means the same value in all panels; otherwise each balloon
      fills its own.
    - `resolution`: steps from pole to pole; by default 6 for each degree, at least 48.
    - `ax`: three-dimensional axes (`projection="3d"`), as many as functions; by default those of a
      new figure.

    **Returns**

    The axes, a one-dimensional array with one per function. Raises `ValueError` for a K that is not
    a square, values that are not finite, axes that are flat or not as many as functions, and titles
    that are not as many.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import plot
    >>> axes = plot.lobes(np.eye(4), titles=["1", "y", "z", "x"], resolution=8)
    >>> axes.shape, axes[2].get_title()
    ((4,), 'z')
    """
    values = read_coefficients(coefficients)
    functions = values.reshape(-1, values.shape[-1])
    check_labels("titles", titles, len(functions))
    same_scale = check_flag("same_scale", same_scale)
    if resolution is not None:
        resolution = check_size("resolution", resolution)
    axes = _axes(ax, values.shape[:-1])
    steps = resolution or max(48, 6 * degree_of(values.shape[-1]))
    theta, phi = np.meshgrid(
        np.linspace(0, np.pi, steps + 1), np.linspace(0, 2 * np.pi, 2 * steps + 1), indexing="ij"
    )
    directions = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    )
    directions = directions.astype(functions.dtype)
    basis = np.asarray(evaluate(jnp.asarray(directions), degree_of(values.shape[-1])))
    radii = np.einsum("...k,nk->n...", basis, functions)
    largest = abs(radii).max(axis=(1, 2))
    if same_scale:
        largest = np.broadcast_to(largest.max(), largest.shape)
    for number, (panel, radius) in enumerate(zip(axes, radii, strict=True)):
        _draw(panel, directions, radius / (largest[number] or 1))
        if titles is not None:
            panel.set_title(titles[number], fontsize=10)
    return axes


def _axes(ax, shape: tuple[int, ...]) -> np.ndarray:
    count = math.prod(shape)
    if ax is None:
        from matplotlib import pyplot

        square = count if count <= 4 else math.ceil(math.sqrt(count))
        columns = shape[1] if len(shape) == 2 else square
        rows = math.ceil(count / columns)
        figure, grid = pyplot.subplots(
            rows,
            columns,
            figsize=(2.2 * columns, 2.2 * rows),
            squeeze=False,
            layout="constrained",
            subplot_kw={"projection": "3d"},
        )
        for unused in grid.ravel()[count:]:
            figure.delaxes(unused)
        return grid.ravel()[:count]
    axes = np.array([ax] if isinstance(ax, Axes) else list(np.ravel(np.asarray(ax, object))))
    if len(axes) != count:
        raise ValueError(f"expected {count} axes, one per function, got {len(axes)}")
    if any(getattr(one, "name", None) != "3d" for one in axes):
        raise ValueError('balloons need axes made with projection="3d", got flat ones')
    return axes


def _draw(ax, directions: Float[np.ndarray, "t p 3"], radius: Float[np.ndarray, "t p"]) -> None:
    x, y, z = np.moveaxis(directions * abs(radius)[..., None], -1, 0)
    # A face has one color: that of the function at its middle.
    middle = (radius[:-1, :-1] + radius[1:, :-1] + radius[:-1, 1:] + radius[1:, 1:]) / 4
    colors = np.where((middle >= 0)[..., None], to_rgb(POSITIVE), to_rgb(NEGATIVE))
    ax.plot_surface(
        x, y, z, facecolors=colors, rcount=len(x), ccount=x.shape[1], linewidth=0, antialiased=False
    )
    for axis, name in enumerate("xyz"):
        line = np.zeros((3, 2))
        line[axis] = 0, 1.15
        ax.plot(*line, color="0.6", linewidth=0.7, zorder=0)
        ax.text(*(1.25 * np.eye(3)[axis]), name, color="0.4", fontsize=7, ha="center", va="center")
    ax.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
    ax.set_proj_type("ortho")
    ax.set_box_aspect((1, 1, 1), zoom=1.45)
    ax.view_init(**_VIEW)
    ax.set_axis_off()
