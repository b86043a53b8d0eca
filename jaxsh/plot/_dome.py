"""The sky as a dome."""

import math
from collections.abc import Callable
from typing import Any, Literal

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from .._core.checks import check_choice, check_flag, check_size, check_type
from ._arrays import read
from ._axes import color_bar, flat_axes
from ._colors import color_scale, luminance
from ._disc import OUTLINE, pixels, show_disc
from ._radiance import along, read_light
from ._tone import Curve, read_tone

Projection = Literal["equal-area", "equidistant"]
_RINGS = (30, 60)  # degrees above the horizon
_ABOVE = 1e-6  # z on the rim: a model of the sky may have nothing at 0


def dome(
    sky: Float[ArrayLike, "..."] | Callable[[Array], Array],
    *,
    label: str | None = None,
    suns: Float[ArrayLike, "*n 3"] | None = None,
    projection: Projection = "equal-area",
    limits: float | tuple[float, float] | None = None,
    log: bool = False,
    exposure: float | None = None,
    curve: Curve = "clip",
    white: float = math.inf,
    resolution: int = 256,
    colorbar: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw the upper half of the sphere as a disc: a sky in color, or its luminance in false color.

    The zenith is in the middle and the horizon the rim, as on a map: +x to the right, +y upwards
    (who looks up sees its mirror image). Dotted rings are 30° and 60° above the horizon. The error
    of a fit is drawn as the difference of two skies, with a label: below zero blue, above red.

    **Arguments**

    - `sky`: a function of directions (N, 3) that gives radiance (N, 1 or 3), or what `light` takes:
      coefficients (K,), (1, K) or (3, K), or a lat-long picture.
    - `label`: of the color bar, with the unit: luminance (Rec. 709) is drawn in false color.
      Without a label the sky is drawn in its colors, tone-mapped.
    - `suns`: directions (3,) or (N, 3) to ring, those below the horizon left away.
    - `projection`: "equal-area" (Lambert's, √(1 - cosθ) from the middle) or "equidistant" (θ).
    - `limits`, `log`: of the color bar, as in `vertices`.
    - `exposure`, `curve`, `white`: of colors, as in `ball`.
    - `resolution`: pixels across the disc.
    - `colorbar`: False leaves it away, where pictures share one.
    - `ax`: axes to draw on; by default those of a new figure.

    **Returns**

    The axes, in radii of the disc. Runs on the host. Raises `ValueError` for a sky of another shape
    or that is not finite above the horizon.

    **Example**

    >>> from jaxsh import plot
    >>> def overcast(view):
    ...     return (1 + 2 * view[:, 2:]) / 3
    >>> ax = plot.dome(overcast, label="luminance / zenith's", resolution=16)
    >>> ax.figure.axes[1].get_ylabel()
    "luminance / zenith's"
    """
    check_choice("projection", projection, ("equal-area", "equidistant"))
    tone = read_tone(exposure, curve, white)
    log, colorbar = check_flag("log", log), check_flag("colorbar", colorbar)
    resolution = check_size("resolution", resolution)
    if label is not None:
        check_type("label", label, str)
    elif limits is not None or log:
        raise ValueError("limits and log are for false color, which a label asks for: got none")
    marks = np.zeros((0, 3)) if suns is None else np.atleast_2d(read("suns", suns))
    if marks.ndim != 2 or marks.shape[1] != 3 or not (marks != 0).any(axis=1).all():
        raise ValueError(f"expected suns as directions (3,) or (N, 3), got shape {marks.shape}")
    directions, covered = _map(resolution, projection)
    seen = _radiance(sky, directions)
    ax = flat_axes(ax, (4.6, 4.0) if label else (4.0, 4.0))
    if label is None:
        show_disc(ax, tone.colors(seen, covered == 1), covered)
    else:
        values = luminance(seen)
        scale = color_scale(values[covered > 0], limits, log)
        show_disc(ax, scale.colors(values), covered)
        if colorbar:
            color_bar(ax, scale, label)
    _draw_frame(ax, projection)
    for mark in marks / np.linalg.norm(marks, axis=1, keepdims=True):
        if mark[2] > 0:
            ax.plot(*_place(mark, projection), "o", ms=11, mfc="none", mec="black", mew=2.6)
            ax.plot(*_place(mark, projection), "o", ms=11, mfc="none", mec="white", mew=1.2)
    ax.set(xlim=(-1.15, 1.15), ylim=(-1.15, 1.15))
    ax.set_axis_off()
    return ax


def _map(resolution: int, projection: str) -> tuple[np.ndarray, np.ndarray]:
    """Compute directions of the pixels, beside the disc those of its rim, and shares in it."""
    x, y, radius, covered = pixels(resolution)
    inside = np.minimum(radius, 1)
    theta = 2 * np.arcsin(inside / np.sqrt(2)) if projection == "equal-area" else inside * np.pi / 2
    z = np.maximum(np.cos(theta), _ABOVE)
    across = np.sqrt(1 - z * z) / np.where(radius > 0, radius, 1)
    return np.stack([x * across, y * across, z], axis=-1), covered


def _place(direction: np.ndarray, projection: str) -> tuple[float, float]:
    z = min(direction[2], 1.0)
    radius = math.sqrt(1 - z) if projection == "equal-area" else math.acos(z) * 2 / math.pi
    across = math.hypot(direction[0], direction[1]) or 1.0
    return radius * direction[0] / across, radius * direction[1] / across


def _radiance(sky: Any, directions: np.ndarray) -> Float[np.ndarray, "n n c"]:
    if not callable(sky):
        return along(read_light(sky, "sky"), directions)
    flat = jnp.asarray(directions.reshape(-1, 3), jnp.result_type(float))
    values = read("the radiance of sky", sky(flat))
    if values.shape not in ((len(flat), 1), (len(flat), 3)):
        raise ValueError(
            f"expected sky to give radiance (N, 1) or (N, 3) for N = {len(flat)} directions, got "
            f"shape {values.shape}"
        )
    return values.reshape(*directions.shape[:2], -1)


def _draw_frame(ax: Axes, projection: str) -> None:
    for degrees in _RINGS:
        e = math.radians(degrees)
        x, _ = _place(np.array([math.cos(e), 0, math.sin(e)]), projection)
        ax.add_patch(Circle((0, 0), x, fill=False, ec="0.7", lw=0.7, ls=":"))
        ax.text(
            0.7071 * x,
            -0.7071 * x,
            f"{degrees}°",
            color="white",
            fontsize="x-small",
            ha="center",
            va="center",
            path_effects=OUTLINE,
        )
    for name, place in {"+x": (1, 0), "+y": (0, 1), "−x": (-1, 0), "−y": (0, -1)}.items():
        x, y = 1.09 * place[0], 1.09 * place[1]
        ax.text(x, y, name, ha="center", va="center", fontsize="small")
