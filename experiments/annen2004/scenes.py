"""What the experiments on Annen et al. 2004 share: baked meshes, area lights, light at vertices.

The meshes have a bounding sphere of radius 1 around the origin, +z up, and look along -y.
Distances are in that radius.
"""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxsh import imaging, midrange

from ..shared.lights import Vector, rectangle

RED, GREEN, BLUE = (1.0, 0.18, 0.12), (0.2, 0.9, 0.25), (0.15, 0.3, 1.0)

# Of the three lights of figures 1 and 5, as the camera sees them: left, right, and above behind.
_TOWARDS = (-0.85, -0.55, 0.2), (0.8, -0.45, 0.35), (0.15, 0.35, 0.95)


def three_lights(
    distance: float, size: float, *, center: Vector = (0.0, 0.0, 0.0)
) -> tuple[midrange.Polygon, ...]:
    """Squares in red, green and blue around a center, which they face; none hides another."""
    center = np.asarray(center, np.float64)
    lights = []
    for towards, color in zip(_TOWARDS, (RED, GREEN, BLUE), strict=True):
        away = distance * np.array(towards) / np.linalg.norm(towards)
        lights.append(rectangle(center + away, center, (size, size), color))
    return tuple(lights)


def exact_expansion(
    lights: Sequence[midrange.Polygon], points: Float[ArrayLike, "*batch 3"], degree: int
) -> midrange.Expansion:
    """Coefficients and gradient without sampling, of lights that do not hide each other."""
    parts = [midrange.polygon_harmonics_with_gradient(light, points, degree) for light in lights]
    light, gradient = (sum(part[1:], part[0]) for part in zip(*parts, strict=True))
    return midrange.make_expansion(jnp.asarray(points), light, gradient)


def psnr(values: Float[Array, "v 3"], reference: Float[Array, "v 3"], exposure: float) -> float:
    """Of radiance at vertices, linear, not clipped; the peak is what the exposure takes to 1."""
    error = exposure * (values - reference)[None]
    return float(imaging.psnr(error, jnp.zeros_like(error)))
