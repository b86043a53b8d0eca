"""Functions on the sphere as balloons, one by one."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import ArrayLike, Float
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb

from .._core import srgb
from .._core.checks import check_flag, check_size, check_type
from ..harmonics import degree_of
from ._arrays import check_labels, read_coefficients
from ._axes import flat_axes, panels
from ._balloon import balloons, draw_balloon, sign_colors, steps_for
from ._colors import MARK, luminance
from ._disc import Toward, frame

_TOWARD = (0.5, -1.0, 0.5)


def lobes(
    coefficients: Float[ArrayLike, "*batch k"],
    *,
    titles: Sequence[str] | None = None,
    same_scale: bool = True,
    unit: str = "",
    toward: Toward = _TOWARD,
    resolution: int = 256,
    ax: Axes | Sequence[Axes] | np.ndarray | None = None,
) -> np.ndarray:
    """Draw functions on the sphere as balloons: the radius is |f|, the color tells the sign.

    Orange is positive, blue negative; lines mark +x, +y, +z, and a bar below says what radius means
    what value. Each function has a panel of its own; functions are laid out in a row up to four,
    and above in a grid near a square.

    **Arguments**

    - `coefficients`: (..., K), jax or numpy. (rows, columns, K) keeps its grid of panels.
    - `titles`: a title per panel.
    - `same_scale`: whether one radius means the same value in all panels; otherwise each balloon
      fills its own.
    - `unit`: of f, after the number at the bar.
    - `toward`: from the balloons to who looks at them, from far away, z upwards.
    - `resolution`: pixels across a panel.
    - `ax`: axes, as many as functions; by default those of a new figure.

    **Returns**

    The axes, a one-dimensional array with one per function. Runs on the host. Raises `ValueError`
    for a K that is not a square, values that are not finite, axes or titles that are not as many as
    functions, and a `toward` that is no direction.

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
    check_type("unit", unit, str)
    viewer = frame(toward)
    resolution = check_size("resolution", resolution)
    axes = panels(ax, values.shape[:-1], (2.6, 3.1))
    shapes = balloons(functions, steps_for(degree_of(values.shape[-1])))
    largest = abs(shapes.values).max(axis=1)
    if same_scale:
        largest = np.broadcast_to(largest.max(), largest.shape)
    for number, panel in enumerate(axes):
        one = shapes.mesh(number, 1 / (float(largest[number]) or 1))
        colors = sign_colors(shapes.values[number])
        draw_balloon(panel, one, colors, viewer, resolution, float(largest[number]), "|f| = ", unit)
        if titles is not None:
            panel.set_title(titles[number])
    return axes


def balloon(
    light: Float[ArrayLike, "*c k"],
    *,
    unit: str = "",
    toward: Toward = _TOWARD,
    resolution: int = 384,
    ax: Axes | None = None,
) -> Axes:
    """Draw a light as one balloon: the radius is the luminance, the color the light's own.

    Colors have their largest channel at full, since the radius tells how bright the light is.
    Where luminance is negative the balloon is magenta. Lines mark +x, +y, +z, and a bar below says
    what radius means what luminance.

    **Arguments**

    - `light`: coefficients (3, K), linear sRGB; or (K,) or (1, K), which give a gray balloon. jax
      or numpy.
    - `unit`: of luminance, after the number at the bar.
    - `toward`: from the balloon to who looks at it, from far away, z upwards.
    - `resolution`: pixels across the picture.
    - `ax`: axes to draw on; by default those of a new figure.

    **Returns**

    The axes, in radii of the largest luminance. Runs on the host. Raises `ValueError` for another
    shape, values that are not finite, and a `toward` that is no direction.

    **Example**

    >>> from jaxsh import imaging, plot, sphere
    >>> light = sphere.project_lat_long(imaging.studio(16, 32), 2)
    >>> ax = plot.balloon(light, resolution=16)
    >>> [text.get_text() for text in ax.texts][:3]
    ['+x', '+y', '+z']
    """
    values = np.atleast_2d(read_coefficients(light, "light"))
    if values.ndim != 2 or len(values) not in (1, 3):
        raise ValueError(f"expected light (K,), (1, K) or (3, K), got shape {values.shape}")
    check_type("unit", unit, str)
    viewer = frame(toward)
    resolution = check_size("resolution", resolution)
    ax = flat_axes(ax, (4.0, 4.5))
    gray = luminance(values.T)
    shapes = balloons(np.concatenate([gray[None], values]), steps_for(degree_of(len(gray))))
    seen = shapes.values[1:].T
    brightest = seen.max(axis=1, keepdims=True)
    own = np.clip(seen / np.where(brightest > 0, brightest, 1), 0, 1)
    mark = srgb.decode(np.array(to_rgb(MARK)))
    colors = np.where(shapes.values[0][:, None] >= 0, own, mark)
    largest = float(abs(shapes.values[0]).max())
    one = shapes.mesh(0, 1 / (largest or 1))
    colors = np.broadcast_to(colors, (len(seen), 3))
    draw_balloon(ax, one, colors, viewer, resolution, largest, "luminance = ", unit)
    return ax
