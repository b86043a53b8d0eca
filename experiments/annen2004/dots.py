"""Where samples are, in a picture of the object."""

import jax.numpy as jnp
import numpy as np
import trimesh
from jaxtyping import Float

from jaxsh import geometry, imaging

from ..shared.plots import GROUND, View

_RADIUS = 0.045
_YELLOW = (1.0, 0.75, 0.05)


def glass(
    view: View, camera: imaging.Camera, points: Float[np.ndarray, "s 3"], *, samples: int = 1
) -> Float[np.ndarray, "h w 3"]:
    """The object in gray, lit from the camera, and the points as if it were of glass."""
    ball = trimesh.creation.icosphere(subdivisions=2, radius=_RADIUS)
    vertices = np.concatenate([ball.vertices + point for point in points])
    faces = np.concatenate([ball.faces + i * len(ball.vertices) for i in range(len(points))])
    dots = geometry.make_mesh(vertices, faces)
    gray = imaging.interpolate(view.raster, 0.02 + 0.25 * view.facing[:, None] ** 2, GROUND)
    raster = imaging.rasterize(dots, camera, samples=samples)
    color = jnp.broadcast_to(jnp.asarray(_YELLOW, gray.dtype), (len(dots.vertices), 3))
    image = imaging.interpolate(raster, color, jnp.repeat(gray, 3, axis=-1))
    return np.asarray(imaging.tone_map(image))
