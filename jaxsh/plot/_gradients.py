"""Draw how light changes in space, as arrows."""

from typing import Literal

import matplotlib
import numpy as np
from jaxtyping import ArrayLike, Float
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from .._core.checks import check_choice, check_flag, check_type
from ..geometry import Mesh
from ._arrays import read
from ._axes import color_bar, flat_axes, round_down
from ._colors import color_scale

Plane = Literal["xy", "xz", "yz"]
_LONGEST = 0.9  # arrow, in distances between points
_SHORTEST = 0.1  # of the longest: shorter ones would be dots


def gradients(
    points: Float[ArrayLike, "n 3"],
    gradient: Float[ArrayLike, "n 3"],
    *,
    values: Float[ArrayLike, " n"] | None = None,
    label: str = "",
    unit: str = "",
    plane: Plane = "xy",
    mesh: Mesh | None = None,
    limits: float | tuple[float, float] | None = None,
    length: str = "mesh units",
    colorbar: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw gradients of light at points as arrows in a plane: they point where light grows.

    Arrows show the two components in the plane, and their length is on one scale, which the arrow
    above the picture tells; those shorter than a tenth of the longest are left out. The points
    carry the light itself in false color where it is given.
    For the gradient of a light's mean radiance over all directions, take that of its first
    coefficient times √(1/4π): `light[:, :, 0].mean(1) / np.sqrt(4 * np.pi)`.

    **Arguments**

    - `points`: (N, 3), jax or numpy.
    - `gradient`: (N, 3), the change of the light for a unit of x, y and z.
    - `values`: (N,), the light itself.
    - `label`: of the values' color bar, with their unit.
    - `unit`: of the gradient, after the number at the arrow above the picture.
    - `plane`: "xy" (seen from above), "xz" (from the front, -y) or "yz" (from +x).
    - `mesh`: drawn as a gray shape behind the arrows.
    - `limits`: of the color bar, as in `vertices`.
    - `length`: unit of the points, at both axes.
    - `colorbar`: False leaves it away, where pictures share one.
    - `ax`: axes to draw on; by default those of a new figure.

    **Returns**

    The axes. Runs on the host. Raises `ValueError` for arrays that are not finite or do not fit.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import plot
    >>> points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    >>> slope = np.array([[0.5, 0.2, 0.0], [1.0, 0.0, 0.0]])
    >>> ax = plot.gradients(points, slope, unit="W/m³")
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('x, mesh units', 'y, mesh units')
    """
    check_choice("plane", plane, ("xy", "xz", "yz"))
    for name, text in (("label", label), ("unit", unit), ("length", length)):
        check_type(name, text, str)
    colorbar = check_flag("colorbar", colorbar)
    places, slopes = read("points", points), read("gradient", gradient)
    if places.ndim != 2 or places.shape[1] != 3 or slopes.shape != places.shape:
        raise ValueError(
            f"expected points and gradient (N, 3), got shapes {places.shape} and {slopes.shape}"
        )
    if len(places) == 0:
        raise ValueError("there is nothing to draw at no points")
    light = None if values is None else read("values", values)
    if light is not None and light.shape != (len(places),):
        raise ValueError(f"expected values ({len(places)},), got shape {light.shape}")
    scale = None if light is None else color_scale(light, limits, False)
    kept = ["xyz".index(name) for name in plane]
    ax = flat_axes(ax, (5.6, 4.8))
    if mesh is not None:
        check_type("mesh", mesh, Mesh)
        corners = np.asarray(mesh.vertices)[:, kept][np.asarray(mesh.faces)]
        shape = PolyCollection(list(corners), facecolor="0.6", edgecolor="face", lw=0.5, zorder=0)
        ax.add_collection(shape)
        ax.autoscale_view()
    _draw_arrows(ax, places[:, kept].astype(float), slopes[:, kept].astype(float), unit)
    if light is not None and scale is not None:
        ax.scatter(
            *places[:, kept].T,
            c=scale.colors(light),
            s=34,
            edgecolors="0.5",
            linewidths=0.6,
            zorder=2,
        )
        if colorbar:
            color_bar(ax, scale, label)
    ax.set_aspect("equal")
    ax.set_xlabel(f"{plane[0]}, {length}")
    ax.set_ylabel(f"{plane[1]}, {length}")
    return ax


def _draw_arrows(ax: Axes, places, slopes, unit: str) -> None:
    steepest = float(np.hypot(*slopes.T).max())
    extent = np.ptp(places, axis=0)
    spacing = np.sqrt(max(extent[0] * extent[1], (extent.max() or 1) ** 2 / 9) / len(places))
    per_unit = (steepest or 1) / (_LONGEST * spacing)
    long = np.hypot(*slopes.T) > _SHORTEST * steepest
    arrows = ax.quiver(
        *places[long].T,
        *slopes[long].T,
        angles="xy",
        scale_units="xy",
        scale=per_unit,
        color=matplotlib.rcParams["text.color"],
        width=0.005,
        zorder=3,
    )
    tips = np.concatenate([places, places + slopes / per_unit])
    ax.update_datalim(tips)
    margin = 0.4 * spacing
    low, high = tips.min(axis=0) - margin, tips.max(axis=0) + margin
    left, right, bottom, top = *ax.get_xlim(), *ax.get_ylim()
    if ax.collections[0] is arrows:  # nothing else has set the limits
        left, right, bottom, top = low[0], high[0], low[1], high[1]
    ax.set_xlim(min(left, low[0]), max(right, high[0]))
    ax.set_ylim(min(bottom, low[1]), max(top, high[1]))
    if steepest > 0:
        step = round_down(steepest)
        ax.quiverkey(
            arrows, 0.88, 1.04, step, f"{step:g} {unit}".strip(), labelpos="W", coordinates="axes"
        )
