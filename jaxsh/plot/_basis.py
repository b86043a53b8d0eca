"""The basis functions in their places, degree by order."""

import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes

from .._core.checks import check_degree, check_size
from ..harmonics import degrees, evaluate, orders
from ._axes import color_bar, flat_axes
from ._colors import color_scale
from ._disc import Toward, disc, frame, show_disc

_RADIUS = 0.46  # of a ball, where the next one is a unit away


def basis(
    degree: int,
    *,
    toward: Toward = (0.0, -1.0, 0.3),
    resolution: int = 96,
    ax: Axes | None = None,
) -> Axes:
    """Draw the real spherical harmonics y_lm up to a degree as painted balls.

    Degree l goes downwards and order m to the right. Colors go around zero, blue below and red
    above. All balls are seen from one side, from far away, z upwards.

    **Arguments**

    - `degree`: the largest l.
    - `toward`: from the balls to who looks at them; by default in front (-y) and a little above.
    - `resolution`: pixels across a ball.
    - `ax`: axes to draw on; by default those of a new figure.

    **Returns**

    The axes: x is the order m, y the degree l. Raises `ValueError` for a degree below 0 and for a
    `toward` that is no direction.

    **Example**

    >>> from jaxsh import plot
    >>> ax = plot.basis(2, resolution=8)
    >>> ax.get_xlabel(), ax.get_ylabel(), len(ax.get_images())
    ('order m', 'degree l', 9)
    """
    degree = check_degree(degree)
    resolution = check_size("resolution", resolution)
    viewer = frame(toward)
    ax = flat_axes(ax, (1.6 + 0.9 * (2 * degree + 1), 0.9 + 0.9 * (degree + 1)))
    local, covered = disc(resolution)
    normals = jnp.asarray((local @ np.stack(viewer)).reshape(-1, 3), jnp.float32)
    values = np.asarray(evaluate(normals, degree)).reshape(resolution, resolution, -1)
    scale = color_scale(values[covered > 0], None, False, signed=True)
    for i, (l, m) in enumerate(zip(degrees(degree), orders(degree), strict=True)):
        place = (m - _RADIUS, m + _RADIUS, l + _RADIUS, l - _RADIUS)
        show_disc(ax, scale.colors(values[..., i]), covered, place)
    ax.set(xlim=(-degree - 0.5, degree + 0.5), ylim=(degree + 0.5, -0.5))
    ax.set_xticks(range(-degree, degree + 1))
    ax.set_yticks(range(degree + 1))
    ax.set_xlabel("order m")
    ax.set_ylabel("degree l")
    ax.spines[:].set_visible(False)
    color_bar(ax, scale, "yₗₘ, in 1/√sr")
    return ax
