"""Write PLY, STL and OFF: one file each."""

import numpy as np

from ..._core import srgb
from ._write_arrays import Arrays, digits, rows_of_text

_PLY_TYPES = {"f4": "float", "f8": "double", "u1": "uchar", "i4": "int"}


def ply_files(arrays: Arrays, stem: str) -> dict[str, bytes]:
    """Give a binary PLY with normals, and with UV and colors where there are any."""
    columns = [("x y z", arrays.positions), ("nx ny nz", arrays.normals)]
    if arrays.uv is not None:
        columns.append(("s t", arrays.uv))
    if arrays.colors is not None:
        columns.append(("red green blue alpha", _ply_colors(arrays.colors)))
    fields = [(name, _little(array.dtype)) for names, array in columns for name in names.split()]
    vertices = np.empty(len(arrays.vertices), fields)
    for names, array in columns:
        for name, column in zip(names.split(), array.T, strict=True):
            vertices[name] = column
    faces = np.empty(len(arrays.faces), [("count", "u1"), ("vertices", "<i4", 3)])
    faces["count"], faces["vertices"] = 3, arrays.faces
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(vertices)}",
        *(f"property {_PLY_TYPES[kind[1:]]} {name}" for name, kind in fields),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    return {"": "\n".join(header).encode() + vertices.tobytes() + faces.tobytes()}


def _little(dtype: np.dtype) -> str:
    return "|u1" if dtype == np.uint8 else f"<{dtype.kind}{max(dtype.itemsize, 4)}"


def _ply_colors(linear: np.ndarray) -> np.ndarray:
    """Encode colors in bytes where these give them back, in floats elsewhere; alpha is linear."""
    encoded = np.concatenate([srgb.encode(linear[:, :3]), linear[:, 3:].astype(np.float64)], axis=1)
    codes = np.rint(255 * np.clip(encoded, 0, 1))
    # Bytes decoded to float32 come this near; alike to float32's resolution.
    if np.abs(codes / 255 - encoded).max(initial=0) < 1e-7:
        return codes.astype(np.uint8)
    return encoded.astype(np.float32)


def stl_files(arrays: Arrays, stem: str) -> dict[str, bytes]:
    """Give a binary STL, with the faces' own normals."""
    corners = arrays.vertices.astype(np.float32)[arrays.faces]
    edges = np.diff(corners.astype(np.float64), axis=1)
    normals = np.cross(edges[:, 0], edges[:, 1])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    facets = np.zeros(
        len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")]
    )
    facets["normal"] = normals / np.where(length > 0, length, 1)
    facets["corners"] = corners
    return {"": bytes(80) + np.uint32(len(facets)).tobytes() + facets.tobytes()}


def off_files(arrays: Arrays, stem: str) -> dict[str, bytes]:
    """Give an OFF file in text."""
    positions = arrays.positions
    number = digits(positions)
    text = f"OFF\n{len(positions)} {len(arrays.faces)} 0\n"
    text += rows_of_text(f"{number} {number} {number}\n", positions)
    return {"": (text + rows_of_text("3 %d %d %d\n", arrays.faces)).encode()}
