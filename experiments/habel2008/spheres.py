"""Skies as pictures of the whole sphere."""

from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from jaxsh import imaging, sky, sphere

from ..shared.plots import plt

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear Rec. 709
_NEGATIVE = (0.3, 0.5, 1.0)  # light below zero has no color of its own


def sun_at(zenith: float) -> Float[np.ndarray, " 3"]:
    """The sun at so many degrees from the zenith, in the plane y = 0, towards +x."""
    angle = np.radians(zenith)
    return np.array([np.sin(angle), 0.0, max(np.cos(angle), 0.0)])


def sky_picture(
    sun: Float[np.ndarray, " 3"], turbidity: float, height: int
) -> Float[Array, "h w 3"]:
    """Preetham's sky itself, as `sphere.reconstruct_lat_long` would show it."""
    views = sphere.lat_long(height, 2 * height).directions
    seen = sky.preetham_radiance(views, jnp.asarray(sun, views.dtype), turbidity, check="allow")
    return seen.reshape(height, 2 * height, 3)


def mean_luminance(light: Float[Array, "3 k"]) -> float:
    """Over the hemisphere, of a light that is dark below: √(4π) c_00 / 2π."""
    return float(LUMINANCE @ np.asarray(light[:, 0], np.float64)) / np.sqrt(np.pi)


def show_sphere(axis: Axes, image: Float[Any, "h w 3"], exposure: float, title: str) -> None:
    """The sun in the middle, zenith on top, the horizon dotted; bright blue is below zero."""
    image = np.roll(np.asarray(image), image.shape[1] // 2, axis=1)
    negative = -np.minimum(image @ LUMINANCE.astype(image.dtype), 0)[..., None]
    positive, below = (
        np.asarray(imaging.tone_map(jnp.asarray(light), exposure, curve="reinhard", white=4.0))
        for light in (image, np.repeat(negative, 3, axis=-1))
    )
    shown = np.where(negative > 0, below * np.array(_NEGATIVE), positive)
    axis.imshow(shown, extent=(-180, 180, -90, 90), aspect="equal")
    frame(axis, title, "w")


def show_signed(
    axis: Axes, luminance: Float[Any, "h w"], limit: float, title: str, *, top: float = 90
) -> None:
    """As `show_sphere`, of a signed quantity: red above zero, blue below, to ± limit.

    The picture reaches from the nadir to an elevation of `top` degrees.
    """
    luminance = np.roll(np.asarray(luminance), luminance.shape[1] // 2, axis=1)
    axis.imshow(luminance, extent=(-180, 180, -90, top), cmap="RdBu_r", vmin=-limit, vmax=limit)
    frame(axis, title, "k")


def show_scale(axis: Axes, limit: float, label: str) -> None:
    """The colors of `show_signed`, at the right of an axis that is otherwise empty."""
    axis.axis("off")
    scale = axis.inset_axes((0.82, 0.05, 0.06, 0.9))
    colors = ScalarMappable(Normalize(-limit, limit), "RdBu_r")
    plt.colorbar(colors, cax=scale, label=label, ticklocation="left")


def frame(axis: Axes, title: str, color: str) -> None:
    axis.axhline(0, color=color, linewidth=0.8, linestyle=":")
    axis.set_title(title, fontsize=9)
    axis.set_xticks([])
    axis.set_yticks([])
