"""Take a mesh apart for the writers: its arrays on the host, checked, and turned."""

from typing import NamedTuple

import numpy as np

from .._base_color import BaseColor
from .._mesh import Mesh


class Arrays(NamedTuple):
    """Holds what `Mesh` holds, as NumPy arrays."""

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    uv: np.ndarray | None
    colors: np.ndarray | None
    face_material: np.ndarray | None
    materials: tuple[BaseColor, ...]
    origin: tuple[float, float, float]

    @property
    def positions(self) -> np.ndarray:
        """Give the vertices where they stand: in float64 where there is an origin to add."""
        return self.vertices + np.array(self.origin) if any(self.origin) else self.vertices


def on_host(mesh: Mesh) -> Arrays:
    """Take the arrays of a mesh out of JAX."""

    def host(array):
        return None if array is None else np.asarray(array)

    return Arrays(
        np.asarray(mesh.vertices),
        np.asarray(mesh.faces),
        np.asarray(mesh.normals),
        host(mesh.uv),
        host(mesh.colors),
        host(mesh.face_material),
        mesh.materials,
        mesh.origin,
    )


def turned_to_y(arrays: Arrays) -> Arrays:
    """Turn space by -90° about x, so that z becomes y: the inverse of reading a y-up file."""

    def turned(vectors):
        return np.stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]], axis=1)

    x, y, z = arrays.origin
    return arrays._replace(
        vertices=turned(arrays.vertices), normals=turned(arrays.normals), origin=(x, z, -y)
    )


def problem(arrays: Arrays) -> str | None:
    """Say why arrays do not make a mesh that a file can hold; None where they do."""
    count = len(arrays.vertices)
    rows = {"vertices": 3, "normals": 3, "uv": 2, "colors": 4}
    for name, width in rows.items():
        array = getattr(arrays, name)
        if array is None:
            continue
        if array.shape != (count, width) or array.dtype.kind != "f":
            return f"{name} must be floats ({count}, {width}), got {array.dtype} {array.shape}"
        if bad := int((~np.isfinite(array)).sum()):
            return f"{bad} values of {name} are NaN or infinite"
        if name == "colors" and (dark := int((array < 0).sum())):
            return f"{dark} values of colors are negative"
    faces, chosen = arrays.faces, arrays.face_material
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu" or not len(faces):
        return f"faces must be whole numbers (f, 3) with f > 0, got {faces.dtype} {faces.shape}"
    if faces.min() < 0 or faces.max() >= count:
        return f"faces name vertices {faces.min()} to {faces.max()}, but there are {count}"
    if chosen is not None and chosen.shape != (len(faces),):
        return f"face_material must be ({len(faces)},), one for each face, got {chosen.shape}"
    if chosen is not None and not -1 <= chosen.min() <= chosen.max() < len(arrays.materials):
        return (
            f"face_material names materials {chosen.min()} to {chosen.max()}, "
            f"but there are {len(arrays.materials)}"
        )
    if not np.isfinite(arrays.origin).all():
        return f"its origin is {arrays.origin}"
    for i, material in enumerate(arrays.materials):
        if np.shape(material.factor) != (4,) or not np.isfinite(np.asarray(material.factor)).all():
            return f"the factor of material {i} must be four finite numbers, got {material.factor}"
        texture = material.texture
        if texture is not None and (texture.ndim != 3 or texture.shape[2] != 4 or not texture.size):
            return f"the texture of material {i} must be (h, w, 4), got {texture.shape}"
        if texture is not None and texture.dtype != np.uint8:
            return f"the texture of material {i} must be uint8, got {texture.dtype}"
    return None


def has(arrays: Arrays, what: str) -> bool:
    """Tell whether a mesh has what some format leaves out."""
    match what:
        case "alpha of colors":
            return arrays.colors is not None and bool((arrays.colors[:, 3] != 1).any())
        case "colors over 1":  # which readers must cut off
            return arrays.colors is not None and bool((arrays.colors > 1).any())
        case "double-sided materials":
            return any(one.double_sided for one in arrays.materials)
        case "unlit materials":
            return any(one.unlit for one in arrays.materials)
        case "textures that do not repeat":
            return any(one.texture is not None and one.wrap != "repeat" for one in arrays.materials)
        case "hard edges":
            return len(np.unique(arrays.vertices, axis=0)) < len(arrays.vertices)
        case "materials":
            return len(arrays.materials) > 0
    return getattr(arrays, what) is not None


def rows_of_text(form: str, rows: np.ndarray) -> str:
    """Print each row of numbers by one form, one a line."""
    return "".join([form % tuple(row) for row in rows.tolist()])


def digits(array: np.ndarray) -> str:
    """Give the form that keeps each number of an array: nine digits for float32, 17 for float64."""
    return "%.9g" if array.dtype == np.float32 else "%.17g"
