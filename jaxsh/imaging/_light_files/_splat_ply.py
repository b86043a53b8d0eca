"""Read and write splats as the PLY files of 3D Gaussian splatting, in the file's own convention."""

import math
import re
from typing import BinaryIO, NamedTuple

import numpy as np
from jaxtyping import Float

from ..._core.ply import Columns, read_elements, read_header

# Rows at a time: as many as stay in the cache while their columns are put in order.
_BLOCK = 2048
_MOST_DEGREE = 4
_KINDS = {"f4": "float", "f8": "double"}


class SplatArrays(NamedTuple):
    """Holds the arrays of `Splats` in NumPy."""

    positions: Float[np.ndarray, "n 3"]
    coefficients: Float[np.ndarray, "n 3 k"]
    opacities: Float[np.ndarray, " n"] | None
    scales: Float[np.ndarray, "n s"] | None
    rotations: Float[np.ndarray, "n 4"] | None


def read_splat_arrays(data: bytes) -> tuple[SplatArrays, str]:
    """Read splats, and say what was left out."""
    header = read_header(data)
    found: list[str] = []
    columns = read_elements(header, found).get("vertex", {})
    names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"]
    if any(not isinstance(columns.get(name), np.ndarray) for name in names):
        raise ValueError("it holds no splats, which are vertices with x, y, z and f_dc_0 to f_dc_2")
    rest = _numbered(columns, "f_rest")
    degree = math.isqrt(1 + len(rest) // 3) - 1
    if len(rest) != 3 * ((degree + 1) ** 2 - 1) or degree > _MOST_DEGREE:
        raise ValueError(
            f"it has {len(rest)} properties f_rest, expected 0, 9, 24, 45 or 72, for degree 0 to 4"
        )
    scales, rotations = _numbered(columns, "scale"), _numbered(columns, "rot")
    if len(scales) not in (0, 2, 3) or len(rotations) not in (0, 4):
        raise ValueError(
            f"it has {len(scales)} properties scale and {len(rotations)} rot, expected 3 and 4"
        )
    opacity = ["opacity"] if isinstance(columns.get("opacity"), np.ndarray) else []
    used = [*names, *rest, *opacity, *scales, *rotations]
    arrays = SplatArrays(
        _stacked(columns, names[:3]),
        _coefficients(columns, names[3:], rest),
        _stacked(columns, opacity)[:, 0] if opacity else None,
        _stacked(columns, scales) if scales else None,
        _stacked(columns, rotations) if rotations else None,
    )
    found += _ignored(columns, used)
    others = [one for one in header.elements if one.name != "vertex" and one.rows]
    found += [f"{one.rows} elements {one.name!r} ignored" for one in others]
    return arrays, ", ".join(found)


def _numbered(columns: Columns, word: str) -> list[str]:
    """List the properties word_0, word_1, … in their order; raises where one is missing."""
    found = {name for name in columns if re.fullmatch(rf"{word}_\d+", name)}
    names = [f"{word}_{i}" for i in range(len(found))]
    for name in names:
        if not isinstance(columns.get(name), np.ndarray):
            raise ValueError(f"it has {len(found)} properties {word}, but no number {name}")
    return names


def _stacked(columns: Columns, names: list[str]) -> Float[np.ndarray, "n c"]:
    """Put columns beside each other, some rows at a time: they lie scattered in the file."""
    chosen = [np.asarray(columns[name]) for name in names]
    single = all(column.dtype.kind == "f" and column.dtype.itemsize == 4 for column in chosen)
    out = np.empty((len(chosen[0]), len(chosen)), np.float32 if single else np.float64)
    _fill(out, chosen)
    return out


def _coefficients(
    columns: Columns, constant: list[str], rest: list[str]
) -> Float[np.ndarray, "n 3 k"]:
    """Give (n, 3, K): a channel's constant, then its own share of the rest."""
    each = len(rest) // 3
    names = [name for c in range(3) for name in (constant[c], *rest[c * each : (c + 1) * each])]
    return _stacked(columns, names).reshape(-1, 3, each + 1)


def _fill(out: Float[np.ndarray, "n c"], columns: list[np.ndarray]) -> None:
    with np.errstate(invalid="ignore"):  # NaN of any kind
        for start in range(0, len(out), _BLOCK):
            rows = slice(start, start + _BLOCK)
            for i, column in enumerate(columns):
                out[rows, i] = column[rows]


def _ignored(columns: Columns, used: list[str]) -> list[str]:
    """Say what was left out, but for normals of zero, which are always written."""
    names = [name for name in columns if name not in used]
    zero = [name for name in names if name in ("nx", "ny", "nz") and not np.any(columns[name])]
    names = [name for name in names if name not in zero]
    return [f"properties ignored ({' '.join(names)})"] if names else []


def _not_finite(arrays: SplatArrays) -> str | None:
    for name, array in arrays._asdict().items():
        if array is None:
            continue
        bad = np.isnan(array) if name == "opacities" else ~np.isfinite(array)
        if count := int(bad.sum()):
            what = "NaN" if name == "opacities" else "NaN or infinite"
            return f"{count} of {array.size} numbers of its {name} are {what}"
    return None


def splats_problem(arrays: SplatArrays) -> str | None:
    """Say why splats cannot be written; None where they can."""
    degree = math.isqrt(arrays.coefficients.shape[2]) - 1
    if degree > _MOST_DEGREE:
        return f"its degree is {degree}, and a file holds {_MOST_DEGREE} at most"
    for name, array in arrays._asdict().items():
        if array is not None and array.dtype not in (np.float32, np.float64):
            return f"its {name} should be float32 or float64, got {array.dtype}"
    return _not_finite(arrays)


def put_splats(file: BinaryIO, arrays: SplatArrays) -> None:
    """Write a binary PLY with the properties of the original `save_ply`, in its order."""
    coefficients = arrays.coefficients
    count = len(coefficients)
    groups = [
        (["x", "y", "z"], arrays.positions),
        (["nx", "ny", "nz"], np.broadcast_to(np.float32(0), (count, 3))),
        ([f"f_dc_{c}" for c in range(3)], coefficients[..., 0]),
    ]
    rest = coefficients[..., 1:].reshape(count, 3 * (coefficients.shape[2] - 1))
    groups.append(([f"f_rest_{i}" for i in range(rest.shape[1])], rest))
    if arrays.opacities is not None:
        groups.append((["opacity"], arrays.opacities[:, None]))
    for array, word in ((arrays.scales, "scale"), (arrays.rotations, "rot")):
        if array is not None:
            groups.append(([f"{word}_{i}" for i in range(array.shape[1])], array))
    fields = [(name, f"<f{array.dtype.itemsize}") for names, array in groups for name in names]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {count}"]
    header += [f"property {_KINDS[kind[1:]]} {name}" for name, kind in fields]
    file.write("\n".join([*header, "end_header\n"]).encode())
    for start in range(0, count, _BLOCK):
        stop = min(start + _BLOCK, count)
        rows = np.empty(stop - start, fields)
        for names, array in groups:
            for i, name in enumerate(names):
                rows[name] = array[start:stop, i]
        file.write(rows.tobytes())
