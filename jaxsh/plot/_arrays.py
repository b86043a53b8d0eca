"""Argument checks: what is drawn is read to the host, and must be finite."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import ArrayLike, Float

from .._core.checks import as_host_float, check_all, check_coefficients


def read(name: str, values: Any) -> Float[np.ndarray, "..."]:
    """The values as a host array; raises `ValueError` where they are not finite real numbers."""
    array = as_host_float(values, name)
    array = array.astype(array.dtype if array.dtype in (np.float32, np.float64) else np.float32)
    if not np.isfinite(array).all():
        count = np.count_nonzero(~np.isfinite(array))
        raise ValueError(f"{name} must be finite, got {count} of {array.size} values that are not")
    return array


def check_labels(name: str, labels: Sequence[str] | None, count: int) -> None:
    """Raises unless there are none, or one for each function."""
    if labels is None:
        return
    check_all(name, list(labels) if isinstance(labels, str) else labels, str, least=0)
    if len(labels) != count:
        raise ValueError(f"expected {count} {name}, one per function, got {len(labels)}")


def read_coefficients(
    coefficients: ArrayLike, name: str = "coefficients"
) -> Float[np.ndarray, "..."]:
    """The coefficients as a host array, at least (K,), with K a square."""
    array = read(name, coefficients)
    check_coefficients(name, array)
    if array.size == 0:
        raise ValueError(f"there is no function to draw in {name} of shape {array.shape}")
    return array
