"""Where tests put the sun."""

import numpy as np


def sun_at(elevation, azimuth=0.0):
    """Unit vectors from degrees."""
    elevation, azimuth = np.radians(elevation), np.radians(azimuth)
    ground = np.cos(elevation)
    return np.stack(
        np.broadcast_arrays(ground * np.cos(azimuth), ground * np.sin(azimuth), np.sin(elevation)),
        axis=-1,
    )


def upper_directions(rng, count):
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    directions[:, 2] = np.abs(directions[:, 2])
    return directions
