"""Point clouds from files."""

import os
import warnings
from typing import Literal

import numpy as np

from .._core.checks import as_path, check_choice
from .._core.host import put
from .._core.ply import Columns, read_elements, read_header
from .._core.words import reason
from ._assemble import Origin, check_options
from ._points import Points

_NORMALS = [("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z")]


def read_points(
    path: str | os.PathLike[str],
    *,
    up: Literal["z", "y", "-y"] = "z",
    origin: Origin = (0.0, 0.0, 0.0),
) -> Points:
    """Read the points of a PLY file, with their normals where it has any: a scan, or splats.

    Takes x y z and nx ny nz (or normal_x …) of its vertices; faces and all else are left out. The
    normals are made of length 1. Splats have zeros there, and give points without normals. Points
    that are NaN or infinite, and those of a scan whose normal is or is zero, are dropped, with one
    `UserWarning` that counts them: the rest keeps its order.

    - `up`: the axis of the file that points up, which it does not say: "z" takes points as they
      are, "y" turns them as `read_mesh` does, (x, y, z) → (x, -z, y), and "-y" as `read_splats`
      does, (x, y, z) → (x, z, -y).
    - `origin`: what to take off the coordinates (after `up`), in float64, before they become
      float32: a mesh's `origin`, so that points stand where the mesh does.

    **Returns** `Points` in float32.

    Raises `FileNotFoundError` for a missing file, and `ValueError`, naming the file and the
    problem, for another extension, a damaged file, and one without points.

    **Example**

    >>> import pathlib, tempfile
    >>> from jaxsh import geometry
    >>> header = "ply\\nformat ascii 1.0\\nelement vertex 2\\nproperty float x\\n"
    >>> header += "property float y\\nproperty float z\\nend_header\\n"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "scan.ply"
    ...     _ = path.write_text(header + "0 0 0\\n1 2 3\\n")
    ...     geometry.read_points(path).positions.tolist()
    [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]
    """
    path = as_path(path)
    check_choice("up", up, ("z", "y", "-y"))
    if origin is None:
        raise ValueError("origin must be three finite numbers, got None")
    check_options("file", origin)
    if path.suffix.lower() != ".ply":
        raise ValueError(f"{path}: cannot read {path.suffix or 'no extension'}, only .ply")
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such file of points")
    data = path.read_bytes()
    try:
        vertex = read_elements(read_header(data), []).get("vertex", {})
        positions = _stacked(vertex, ("x", "y", "z"))
        if positions is None:
            raise ValueError("its header has no vertices with x, y and z")
        normals = next((n for n in (_stacked(vertex, c) for c in _NORMALS) if n is not None), None)
    except Exception as error:  # a parser may raise anything when a file is damaged
        if isinstance(error, MemoryError):
            raise
        raise ValueError(f"{path}: damaged or not a .ply file: {reason(error)}") from error
    with np.errstate(over="ignore"):  # beyond float32 they are infinite, and dropped
        positions = (_turned(positions, up) - np.asarray(origin, np.float64)).astype(np.float32)
    kept = np.asarray(np.isfinite(positions).all(axis=1))
    found = [(int((~kept).sum()), "are not finite")]
    if normals is not None and normals.any():
        normals = _turned(normals, up)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            length = np.linalg.norm(normals, axis=1, keepdims=True)
            usable = np.isfinite(length[:, 0]) & (length[:, 0] > 0)
            normals = normals / length
        found.append((int((kept & ~usable).sum()), "have no normal"))
        kept &= usable
    else:
        normals = None
    if not kept.any():
        known = " that are known" if len(positions) else ""
        raise ValueError(f"{path}: it holds no points{known}")
    if said := ", ".join(f"{n:,} points that {what} dropped" for n, what in found if n):
        warnings.warn(f"{path}: {said}", stacklevel=2)
    return Points(
        put(positions[kept]),
        None if normals is None else put(normals[kept], np.float32),
    )


def _stacked(columns: Columns, names: tuple[str, ...]) -> np.ndarray | None:
    """Put columns beside each other in float64, where they are all there."""
    if not all(isinstance(columns.get(name), np.ndarray) for name in names):
        return None
    with np.errstate(invalid="ignore"):  # NaN of any kind
        return np.stack([np.asarray(columns[name], np.float64) for name in names], axis=1)


def _turned(vectors: np.ndarray, up: str) -> np.ndarray:
    """Turn by 90° about x, so that the axis that points up becomes z."""
    x, y, z = vectors.T
    return vectors if up == "z" else np.stack([x, -z, y] if up == "y" else [x, z, -y], axis=1)
