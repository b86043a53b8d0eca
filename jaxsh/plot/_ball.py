"""A light as a ball."""

import math
from typing import Literal

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float
from matplotlib.axes import Axes

from .._core.checks import check_choice, check_size
from ..sphere import irradiance, project_lat_long
from ._axes import flat_axes
from ._disc import AXES, Toward, centers, disc, frame, name_axes, show_disc
from ._negative import mark_negative
from ._radiance import along, read_light
from ._tone import Curve, read_tone

_EXACT = 8  # degree at which irradiance of a picture is exact to 0.1 %


def ball(
    light: Float[ArrayLike, "..."],
    *,
    of: Literal["radiance", "mirror", "diffuse"] = "radiance",
    toward: Toward = (0.0, -1.0, 0.2),
    exposure: float | None = None,
    curve: Curve = "clip",
    white: float = math.inf,
    resolution: int = 256,
    ax: Axes | None = None,
) -> Axes:
    """Draw a light as a ball, tone-mapped, with negative radiance marked.

    The ball is seen from far away, z upwards, and names stand where the light of +x, +y, … is
    found. A point of the ball with normal n, seen along v (both unit vectors away from the ball),
    shows

    - "radiance": what comes from n, as if the sphere of directions were painted;
    - "mirror": what comes from 2(n·v)n - v, as a ball of chrome shows it: all directions but the
      one behind the ball;
    - "diffuse": the irradiance at n over π, as a white ball shows it, without shadows.

    Negative radiance, which coefficients cut off at a degree have, is hatched and outlined in
    magenta as in `light`.

    **Arguments**

    - `light`: coefficients (K,), (1, K) or (3, K), or a lat-long picture (height, width, 1 or 3),
      linear radiance. jax or numpy.
    - `of`: what the ball shows.
    - `toward`: from the ball to who looks at it.
    - `exposure`: factor before the tone curve; by default the one that takes the 99th percentile
      of the ball's pixels to white.
    - `curve`, `white`: see `imaging.tone_map`.
    - `resolution`: pixels across the ball.
    - `ax`: axes to draw on; by default those of a new figure.

    **Returns**

    The axes, in radii of the ball. Runs on the host. Raises `ValueError` for a light of another
    shape or that is not finite, and for a `toward` that is no direction.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import imaging, plot
    >>> ax = plot.ball(imaging.studio(16, 32), of="mirror", resolution=32)
    >>> [text.get_text() for text in ax.texts]
    ['+x', '−x', '+y', '−y', '+z', '−z']
    """
    check_choice("of", of, ("radiance", "mirror", "diffuse"))
    tone = read_tone(exposure, curve, white)
    resolution = check_size("resolution", resolution, 2)
    viewer = frame(toward)
    values = read_light(light)
    ax = flat_axes(ax, (4.0, 4.2))
    local, covered = disc(resolution)
    normals = local @ np.stack(viewer)
    if of == "mirror":
        seen = along(values, 2 * local[..., 2:] * normals - viewer.toward)
    elif of == "diffuse":
        seen = _diffuse(values, normals)
    else:
        seen = along(values, normals)
    inside = covered == 1
    show_disc(ax, tone.colors(seen, inside), covered)
    lowest, largest = seen.min(axis=-1), float(abs(seen[inside]).max(initial=0))
    share = (lowest < 0)[inside].sum() / max(inside.sum(), 1)
    across = centers(resolution)
    mark_negative(
        ax,
        across,
        -across,
        np.where(inside, lowest, largest),
        largest,
        f"{100 * share:.2g} % of the disc",
    )
    places = {name: viewer.place(axis) for name, axis in AXES.items()}
    if of == "mirror":
        places = {name: _half_way(place) for name, place in places.items()}
    name_axes(ax, places)
    ax.set(xlim=(-1.15, 1.15), ylim=(-1.15, 1.15))
    ax.set_axis_off()
    return ax


def _half_way(place: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
    """Compute the normal of a mirror that shows a place to one who looks along z."""
    half = place + np.array([0.0, 0.0, 1.0])
    length = np.linalg.norm(half)
    return half / length if length > 1e-3 else np.array([0.0, 0.0, -1.0])


def _diffuse(light, normals: Float[np.ndarray, "n n 3"]) -> Float[np.ndarray, "n n c"]:
    if light.ndim == 3:
        # Of a small picture as far as it has.
        degree = min(_EXACT, (min(light.shape[:2]) - 1) // 2)
        light = np.asarray(project_lat_long(jnp.asarray(light), degree))
    flat = jnp.asarray(normals.reshape(-1, 3).astype(light.dtype))
    values = np.asarray(irradiance(jnp.asarray(light), flat)) / np.pi
    return values.reshape(*normals.shape[:2], -1).astype(light.dtype)
