"""The built-in environment: a studio under a sunny sky, and no file needed."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

# Lobes exp(κ (cos γ - 1)) around a direction: (direction, κ, linear RGB at the center).
_LOBES = (
    ((-0.55, -0.62, 0.56), 600.0, (900.0, 800.0, 640.0)),  # sun: 2.3° to a standard deviation
    ((0.80, -0.50, 0.32), 14.0, (1.9, 2.2, 2.8)),  # softbox: 15°, cool, opposite the sun
    ((0.25, 0.93, 0.28), 40.0, (6.0, 4.2, 2.6)),  # rim light from behind: 9°, warm
)
_ZENITH, _HORIZON, _GROUND = (0.16, 0.26, 0.48), (0.62, 0.50, 0.38), (0.085, 0.07, 0.055)


def studio(height: int = 256, width: int = 512) -> Float[Array, "height width 3"]:
    """A made-up light probe: linear radiance, lat-long, float32, positive and finite.

    A dim sky, warm towards the horizon, over darker ground, with a small bright sun (peak 900,
    upper left front for a viewer at -y), a softbox to the right and a rim light behind. The sun
    is a smooth lobe 2.3° wide: from 128 rows on, pixels resolve it.
    """
    if height < 1 or width < 1:
        raise ValueError(f"a picture needs pixels, got {width} × {height}")
    theta = (np.arange(height)[:, None] + 0.5) * np.pi / height
    phi = (np.arange(width) + 0.5) * 2 * np.pi / width
    z = np.broadcast_to(np.cos(theta), (height, width))
    directions = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), z], axis=-1)

    elevation = np.clip(z, 0, 1)[..., None]
    sky = _ZENITH + np.exp(-4 * elevation) * np.subtract(_HORIZON, _ZENITH)
    # The horizon is a soft step, so that it rings no more than a real one.
    above = 1 / (1 + np.exp(-z[..., None] / 0.03))
    radiance = above * sky + (1 - above) * np.array(_GROUND)
    for direction, kappa, color in _LOBES:
        cosine = directions @ (np.array(direction) / np.linalg.norm(direction))
        radiance = radiance + np.exp(kappa * (cosine - 1))[..., None] * np.array(color)
    return jnp.asarray(radiance, jnp.float32)
