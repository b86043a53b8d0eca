"""A light as a lat-long picture."""

import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float
from matplotlib.axes import Axes

from .._core.checks import check_size
from ..sphere import reconstruct_lat_long
from ._axes import flat_axes
from ._negative import mark_negative
from ._radiance import read_light
from ._tone import Curve, read_tone


def light(
    light: Float[ArrayLike, "..."],
    *,
    height: int = 128,
    exposure: float | None = None,
    curve: Curve = "clip",
    white: float = math.inf,
    ax: Axes | None = None,
) -> Axes:
    """Draw a light as a lat-long picture, tone-mapped, with negative radiance marked.

    Coefficients that were cut off at a degree ring: beside a bright source the radiance falls below
    zero, which no physical light does and which a tone curve would show as plain black. Directions
    where a channel is negative are hatched and outlined in magenta, and the legend says what share
    of the sphere's solid angle they take and how low the radiance falls.

    **Arguments**

    - `light`: coefficients (K,), (1, K) or (3, K), or a lat-long picture (height, width, 1 or 3),
      linear radiance, as `sphere.project_lat_long` takes it: row 0 touches +z, column 0 starts at
      +x. jax or numpy.
    - `height`: rows of the picture that coefficients are drawn as; it has twice as many columns.
    - `exposure`: factor before the tone curve; by default the one that takes the 99th percentile
      of the pixels to white.
    - `curve`, `white`: see `imaging.tone_map`.
    - `ax`: axes to draw on; by default those of a new figure.

    **Returns**

    The axes, in degrees: φ from 0 to 360 to the right, θ from 0 to 180 downwards. Raises
    `ValueError` for any other shape, for a picture of integers and for values that are not finite.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import plot
    >>> ax = plot.light(np.array([1.0, 0.0, 3.0, 0.0]))  # bright above, negative below
    >>> ax.get_legend().get_texts()[0].get_text()
    'negative: 40 % of the sphere, down to −1.2'
    """
    height = check_size("height", height)
    tone = read_tone(exposure, curve, white)
    picture = _picture(light, height)
    ax = flat_axes(ax, (7.0, 4.0))
    ax.imshow(
        tone.colors(picture),
        extent=(0, 360, 180, 0),
        aspect="equal",
        origin="upper",
        interpolation="nearest",
    )
    _mark_negative(ax, picture)
    ax.set_xticks([0, 90, 180, 270, 360], ["0°\n+x", "90°\n+y", "180°\n−x", "270°\n−y", "360°\n+x"])
    ax.set_yticks([0, 90, 180], ["0° +z", "90°", "180° −z"])
    ax.set_xlabel("φ")
    ax.set_ylabel("θ")
    return ax


def _picture(light: ArrayLike, height: int) -> Float[np.ndarray, "h w c"]:
    values = read_light(light)
    if values.ndim == 3:
        return values
    return np.asarray(reconstruct_lat_long(jnp.asarray(values), height, 2 * height))


def _mark_negative(ax: Axes, picture: Float[np.ndarray, "h w c"]) -> None:
    lowest = picture.min(axis=-1)
    rows, columns = lowest.shape
    phi = (np.arange(-1, columns + 1) + 0.5) * 360 / columns
    theta = np.concatenate([[0], (np.arange(rows) + 0.5) * 180 / rows, [180]])
    # One pixel more on each side, so that the outline reaches the picture's edges.
    around = np.pad(np.pad(lowest, ((1, 1), (0, 0)), mode="edge"), ((0, 0), (1, 1)), mode="wrap")
    bounds = np.cos(np.linspace(0, np.pi, rows + 1))
    share = ((lowest < 0).mean(axis=1) * (bounds[:-1] - bounds[1:])).sum() / 2
    said = f"{100 * share:.2g} % of the sphere"
    mark_negative(ax, phi, theta, around, float(abs(picture).max()), said, below=48.0)
    ax.set(xlim=(0, 360), ylim=(180, 0))
