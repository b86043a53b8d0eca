"""Undo the filters of EXT_meshopt_compression for normals, quaternions, floats and colors."""

import numpy as np
from jaxtyping import Shaped, UInt8

Rows = UInt8[np.ndarray, "n s"]


def _octahedral(rows: Rows) -> Shaped[np.ndarray, "n 4"]:
    values = _of_four(rows, "i")
    most = np.iinfo(values.dtype).max
    with np.errstate(all="ignore"):
        x, y, one, last = values.astype(np.float64).T
        x, y = x / one, y / one
        z = 1 - np.abs(x) - np.abs(y)
        fold = np.maximum(-z, 0)
        x, y = x - np.copysign(fold, x), y - np.copysign(fold, y)
        unit = np.stack([x, y, z]) * (most / np.sqrt(x * x + y * y + z * z))
    return _rounded(np.stack([*unit, last], axis=1), values.dtype)


def _quaternion(rows: Rows) -> Shaped[np.ndarray, "n 4"]:
    if rows.shape[1] != 8:
        raise ValueError(f"quaternions have 8 bytes, not {rows.shape[1]}")
    values = _of_four(rows, "i")
    largest = values[:, 3].astype(np.int64) & 3
    scale = np.sqrt(0.5) / (values[:, 3].astype(np.int64) | 3)
    small = values[:, :3] * scale[:, None]
    rest = np.sqrt(np.maximum(0, 1 - np.sum(small * small, axis=1)))
    out = np.empty((len(rows), 4))
    for place, column in enumerate([rest, *small.T]):
        out[np.arange(len(rows)), (largest + place) % 4] = column
    return _rounded(32767 * out, values.dtype)


def _exponential(rows: Rows) -> Shaped[np.ndarray, "n k"]:
    values = rows.view("<i4")
    with np.errstate(all="ignore"):
        return np.ldexp(((values << 8) >> 8).astype(np.float64), values >> 24).astype("<f4")


def _color(rows: Rows) -> Shaped[np.ndarray, "n 4"]:
    values = _of_four(rows, "u")
    y, alpha = values[:, 0].astype(np.int64), values[:, 3].astype(np.int64)
    orange, green = _of_four(rows, "i")[:, 1:3].astype(np.int64).T
    # The highest bit of alpha tells how many bits there are.
    _, bits = np.frexp(alpha.astype(np.float64))
    most = 2 ** bits.astype(np.int64) - 1
    alpha &= most >> 1
    alpha = alpha << 1 | alpha & 1
    channels = np.stack([y + orange - green, y + green, y - orange - green, alpha], axis=1)
    scale = np.iinfo(values.dtype).max / np.maximum(most, 1)
    return _rounded(channels * scale[:, None], values.dtype)


def _of_four(rows: Rows, kind: str) -> Shaped[np.ndarray, "n 4"]:
    if rows.shape[1] not in (4, 8):
        raise ValueError(f"this filter needs 4 or 8 bytes, not {rows.shape[1]}")
    return rows.view(f"<{kind}{rows.shape[1] // 4}")


def _rounded(values: np.ndarray, dtype: np.dtype) -> np.ndarray:
    """Round halves away from zero; a code that stands for no number gives 0."""
    rounded = np.trunc(np.nan_to_num(values) + np.copysign(0.5, values))
    return np.clip(rounded, np.iinfo(dtype).min, np.iinfo(dtype).max).astype(dtype)


FILTERS = {
    "OCTAHEDRAL": _octahedral,
    "QUATERNION": _quaternion,
    "EXPONENTIAL": _exponential,
    "COLOR": _color,
}
