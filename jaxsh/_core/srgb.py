"""sRGB on NumPy arrays (IEC 61966-2-1), for files; `imaging` has its curve for JAX."""

import numpy as np
from jaxtyping import Float

LUMINANCE = (0.2126, 0.7152, 0.0722)  # of linear R, G, B (Rec. 709)


def encode(linear: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    """Encode linear values, in float64; what is negative keeps its sign."""
    size = np.abs(linear.astype(np.float64))
    curved = 1.055 * np.maximum(size, 0.0031308) ** (1 / 2.4) - 0.055
    return np.copysign(np.where(size <= 0.0031308, 12.92 * size, curved), linear)


def decode(signal: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    """Decode signals of at least 0 to linear values."""
    return np.where(signal <= 0.04045, signal / 12.92, ((signal + 0.055) / 1.055) ** 2.4)
