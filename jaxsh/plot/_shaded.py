"""A mesh with radiance at its vertices."""

import math

import numpy as np
from jaxtyping import ArrayLike, Float
from matplotlib.axes import Axes

from .._core.checks import check_type
from ..geometry import Mesh
from ..imaging import Camera
from ._arrays import read
from ._negative import mark_negative
from ._surface import see
from ._tone import Curve, read_tone


def shaded(
    mesh: Mesh,
    radiance: Float[ArrayLike, "v c"],
    *,
    camera: Camera | None = None,
    exposure: float | None = None,
    curve: Curve = "clip",
    white: float = math.inf,
    length: str = "mesh units",
    ax: Axes | None = None,
) -> Axes:
    """Draw a mesh with radiance at its vertices, tone-mapped, with negative radiance marked.

    Coefficients that were cut off at a degree ring, and shading then falls below zero, which a tone
    curve would show as plain black: there a picture is hatched and outlined in magenta, and the
    legend says how low the radiance falls.

    **Arguments**

    - `mesh`: what is seen.
    - `radiance`: (V, 3) or (V, 1), linear, as `transfer.shade_diffuse` gives it. jax or numpy.
    - `camera`: by default one in front (-y) and a little above, its picture cut to the mesh.
    - `exposure`: factor before the tone curve; by default the one that takes the 99th percentile
      of the mesh's pixels to white. Pictures that are compared want the same.
    - `curve`, `white`: see `imaging.tone_map`.
    - `length`: unit of the mesh's lengths, for the bar below the picture.
    - `ax`: axes to draw on; by default those of a new figure.

    **Returns**

    The axes, in pixels. Runs on the host. Raises `ValueError` for radiance that is not finite or
    not a row per vertex, and for a camera that does not see the mesh.

    **Example**

    >>> from jaxsh import geometry, imaging, plot, sphere
    >>> mesh = geometry.knot(300)
    >>> light = sphere.project_lat_long(imaging.studio(), 2)
    >>> radiance = sphere.irradiance(light, mesh.normals) / 3.14
    >>> camera = imaging.Camera.facing(mesh, width=32, height=32)
    >>> ax = plot.shaded(mesh, radiance, camera=camera)
    >>> ax.get_images()[0].get_array().shape
    (32, 32, 4)
    """
    check_type("mesh", mesh, Mesh)
    check_type("length", length, str)
    tone = read_tone(exposure, curve, white)
    values = read("radiance", radiance)
    if values.ndim != 2 or values.shape[0] != len(mesh.vertices) or values.shape[1] not in (1, 3):
        raise ValueError(
            f"expected radiance ({len(mesh.vertices)}, 3) or ({len(mesh.vertices)}, 1), a row per "
            f"vertex, got shape {values.shape}"
        )
    surface = see(mesh, camera)
    picture = surface.pixels(values)
    shown = tone.colors(picture, np.asarray(surface.raster.mask))
    ax = surface.show(shown, ax, length)
    height, width = surface.alpha.shape
    lowest = np.where(surface.alpha == 1, picture.min(axis=-1), np.inf)
    share = (lowest < 0).sum() / max((surface.alpha == 1).sum(), 1)
    largest = float(abs(picture).max())
    mark_negative(
        ax,
        np.arange(width) + 0.5,
        np.arange(height) + 0.5,
        np.where(np.isfinite(lowest), lowest, largest),
        largest,
        f"{100 * share:.2g} % of the mesh",
        below=32.0,  # below the bar of length
    )
    return ax
