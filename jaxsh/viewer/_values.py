"""Numbers at the vertices, which a page shows in false color."""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np

from .._core.checks import as_finite, described

MOST_LEVELS = 8  # that the shader tells apart
_MOST_CODE = 65535  # of uint16


def packed_values(values: Any, count: int) -> tuple[list[dict[str, Any]], dict[str, np.ndarray]]:
    """Facts for the header and arrays of codes, by name; raises for what does not fit.

    Floats become 16-bit codes between their least and greatest; integers and truth values become
    the numbers of their levels, where these are few.
    """
    if values is None:
        return [], {}
    if not isinstance(values, Mapping):
        raise TypeError(f"expected values by their names, as a dict, got {described(values)}")
    facts, arrays = [], {}
    for i, (name, given) in enumerate(values.items()):
        if not isinstance(name, str):
            raise TypeError(f"expected names of values as str, got {described(name)}")
        fact, codes = _packed(name, given, count)
        facts.append({"name": name, "array": f"values{i}"} | fact)
        arrays[f"values{i}"] = codes
    return facts, arrays


def _packed(name: str, given: Any, count: int) -> tuple[dict[str, Any], np.ndarray]:
    raw = given if isinstance(given, jnp.ndarray) else np.asarray(given)
    if np.shape(raw) != (count,):
        raise ValueError(f"expected values {name!r} ({count},), got shape {np.shape(raw)}")
    if raw.dtype.kind in "biu":
        levels, codes = np.unique(np.asarray(raw), return_inverse=True)
        if len(levels) <= MOST_LEVELS:
            truth = raw.dtype.kind == "b"
            labels = [("no", "yes")[int(x)] if truth else str(x) for x in levels]
            return {"kind": "levels", "labels": labels}, codes.astype("<u2")
    array = np.asarray(as_finite(raw, f"values {name!r}", wait=True), np.float64)
    low, high = float(array.min()), float(array.max())
    codes = np.rint((array - low) / (high - low or 1) * _MOST_CODE).astype("<u2")
    return {"kind": "ramp", "low": low, "high": high}, codes
