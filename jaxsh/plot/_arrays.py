"""Argument checks: what is drawn is read to the host, and must be finite."""

import numpy as np
from jaxtyping import ArrayLike, Float

from ..harmonics import degree_of

POSITIVE = "#e07b39"
NEGATIVE = "#3b7dd8"
CHANNELS = ("#d62728", "#2ca02c", "#1f77b4")  # R, G, B in matplotlib's own hues


def read(name: str, values: ArrayLike) -> Float[np.ndarray, "..."]:
    """The values as a host array; raises `ValueError` where they are not finite real numbers."""
    array = np.asarray(values)
    if array.dtype.kind not in "fiu" and array.dtype.name != "bfloat16":
        raise ValueError(f"{name} must be real numbers, got dtype {array.dtype}")
    array = array.astype(array.dtype if array.dtype in (np.float32, np.float64) else np.float32)
    if not np.isfinite(array).all():
        count = np.count_nonzero(~np.isfinite(array))
        raise ValueError(f"{name} must be finite, got {count} of {array.size} values that are not")
    return array


def read_coefficients(coefficients: ArrayLike) -> Float[np.ndarray, "..."]:
    """The coefficients as a host array, at least (K,), with K a square."""
    array = read("coefficients", coefficients)
    if array.ndim == 0:
        raise ValueError("coefficients must have shape (..., K), got a number")
    degree_of(array.shape[-1])
    if array.size == 0:
        raise ValueError(f"there is no function to draw in coefficients of shape {array.shape}")
    return array
