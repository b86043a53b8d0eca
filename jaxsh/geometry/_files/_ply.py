"""Read PLY: text or binary of either byte order, faces or triangle strips."""

from pathlib import Path

import numpy as np

from ..._core.ply import Columns, Lists, read_elements, read_header
from ..._core.ranges import ranges
from .._base_color import BaseColor
from ._pictures import read_picture
from ._polygons import Polygons, at_corners, unit_colors, without_points_and_lines

_NORMALS = [("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z")]
_UV = [("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t")]
_COLORS = [
    ("red", "green", "blue"),
    ("r", "g", "b"),
    ("diffuse_red", "diffuse_green", "diffuse_blue"),
]
_ALPHA = ["alpha", "a", "diffuse_alpha"]
_CORNERS = ["vertex_indices", "vertex_index", "vertex_indexes", "vertex_list"]
_TEXTURE = "texturefile"


def read_ply(path: Path, data: bytes) -> Polygons:
    """Read the faces and triangle strips of a PLY file.

    Vertices may have normals (nx ny nz), UV (s t, u v, texture_u texture_v) and colors (red green
    blue alpha), faces UV for each corner (texcoord), colors, and the number of a picture
    (texnumber) that a comment names (TextureFile). Whole numbers are colors in parts of the largest
    of their type.
    """
    header = read_header(data)
    found = [f"{header.ignored} lines of the header ignored"] if header.ignored else []
    elements = read_elements(header, found)
    vertex = elements.get("vertex", {})
    used: set[str] = set()
    positions = _columns(vertex, [("x", "y", "z")], used)
    if positions is None:
        raise ValueError("its header has no vertices with x, y and z")
    normals = _columns(vertex, _NORMALS, used)
    uv = _columns(vertex, _UV, used)
    colors = _colors(vertex, used, found)
    _say_ignored("vertices", vertex, used, found)

    face, used = elements.get("face", {}), set()
    polygons = _faces(face, used, found)
    strips = _strips(elements.get("tristrips", {}), found)
    corners = np.concatenate([polygons.values, strips.values])
    sizes = np.concatenate([polygons.sizes, strips.sizes])
    normals, uv, colors = (at_corners(values, corners) for values in (normals, uv, colors))
    face_uv = _face_uv(face, used, found)
    if face_uv is not None:
        uv = np.full((len(corners), 2), np.nan)
        uv[: len(face_uv)] = face_uv
    face_colors = _colors(face, used, found)
    if face_colors is not None and len(face_colors) != len(polygons.sizes):
        face_colors = None  # of faces without corners
    if face_colors is not None and colors is None:
        colors = np.full((len(corners), 4), np.nan)
        colors[: len(polygons.values)] = np.repeat(face_colors, polygons.sizes, axis=0)
    elif face_colors is not None:
        found.append("colors of faces ignored, since vertices have some")
    materials, material = _materials(path, header.comments, face, used, len(sizes), found)
    _say_ignored("faces", face, used, found)
    for element in header.elements:
        if element.name not in ("vertex", "face", "tristrips") and element.rows:
            found.append(f"{element.rows} elements {element.name!r} ignored")

    return without_points_and_lines(
        Polygons(positions, corners, sizes, normals, uv, colors, material, materials, tuple(found))
    )


def _columns(columns: Columns, names: list[tuple[str, ...]], used: set[str]) -> np.ndarray | None:
    """Stack the first set of columns that is there in float64."""
    for choice in names:
        if all(isinstance(columns.get(name), np.ndarray) for name in choice):
            used.update(choice)
            with np.errstate(invalid="ignore"):  # NaN of any kind
                return np.stack([np.asarray(columns[name], np.float64) for name in choice], axis=1)
    return None


def _colors(columns: Columns, used: set[str], found: list[str]) -> np.ndarray | None:
    """Give RGBA, whole numbers as parts of the largest of their type."""
    for names, alpha in zip(_COLORS, _ALPHA, strict=True):
        stack = _columns(columns, [(*names, alpha), names], used)
        if stack is None:
            continue
        for i, name in enumerate((*names, alpha)[: stack.shape[1]]):
            kind = np.asarray(columns[name]).dtype
            if kind.kind in "iu":
                stack[:, i] /= 255 if kind.itemsize == 4 else np.iinfo(kind).max
        stack, phrase = unit_colors(stack)
        found += [phrase] if phrase else []
        return stack
    return None


def _faces(face: Columns, used: set[str], found: list[str]) -> Lists:
    for name in _CORNERS:
        lists = face.get(name)
        if isinstance(lists, Lists):
            used.add(name)
            return Lists(lists.sizes.astype(np.int64), _whole(lists.values))
    return Lists(np.zeros(0, np.int64), np.zeros(0, np.int64))


def _whole(values: np.ndarray) -> np.ndarray:
    """Take indices of any type; one that is none becomes -1, which is refused later."""
    if values.dtype.kind == "f":
        values = np.where((values == np.rint(values)) & (np.abs(values) < 2**53), values, -1)
    return values.astype(np.int64)


def _strips(columns: Columns, found: list[str]) -> Lists:
    """Cut strips, in which -1 begins the next, into triangles; every second one is turned."""
    used: set[str] = set()
    lists = _faces(columns, used, found)
    values = lists.values
    place = np.arange(len(values))
    breaks = values < 0
    begins = np.concatenate([place[breaks] + 1, np.cumsum(lists.sizes) - lists.sizes])
    begin = np.zeros(len(values) + 1, np.int64)
    begin[begins] = begins
    begin = np.maximum.accumulate(begin)[:-1]
    third = np.flatnonzero((place - begin >= 2) & ~breaks)
    turned = (third - begin[third]) % 2 == 1
    a, b = np.where(turned, third - 1, third - 2), np.where(turned, third - 2, third - 1)
    triangles = values[np.stack([a, b, third], axis=1)]
    # A corner twice is how strips are joined.
    triangles = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]
    return Lists(np.full(len(triangles), 3), triangles.reshape(-1))


def _face_uv(face: Columns, used: set[str], found: list[str]) -> np.ndarray | None:
    """Give two coordinates for each corner of each face, from lists of them."""
    lists = face.get("texcoord")
    corners = next((face[name] for name in _CORNERS if name in face), None)
    if not isinstance(lists, Lists) or not isinstance(corners, Lists):
        return None
    used.add("texcoord")
    sizes = corners.sizes.astype(np.int64)
    fits = lists.sizes == 2 * sizes
    if not lists.sizes.any():
        return None
    if not fits.all():
        found.append(f"texture coordinates of {int((~fits).sum())} faces ignored")
    uv = np.full((int(sizes.sum()), 2), np.nan)
    first = np.cumsum(lists.sizes) - lists.sizes
    with np.errstate(invalid="ignore"):
        values = np.asarray(lists.values, np.float64)
    at = ranges(first[fits], lists.sizes[fits].astype(np.int64))
    uv[np.repeat(fits, sizes)] = values[at].reshape(-1, 2)
    return uv


def _materials(
    path: Path,
    comments: list[str],
    face: Columns,
    used: set[str],
    count: int,
    found: list[str],
) -> tuple[tuple[BaseColor, ...], np.ndarray | None]:
    """Read the pictures that comments name, and which of them each polygon has."""
    names = [c[len(_TEXTURE) :].strip() for c in comments if c.lower().startswith(_TEXTURE)]
    if not names:
        return (), None
    materials = tuple(BaseColor(name, texture=read_picture(path, name, found)) for name in names)
    rows = np.zeros(count, np.int64)
    numbers = face.get("texnumber")
    if isinstance(numbers, np.ndarray):
        used.add("texnumber")
        numbers = _whole(numbers)[:count]
        rows[: len(numbers)] = numbers
    return materials, np.where((rows >= 0) & (rows < len(names)), rows, -1)


def _say_ignored(what: str, columns: Columns, used: set[str], found: list[str]) -> None:
    if ignored := [name for name in columns if name not in used]:
        found.append(f"properties of {what} ignored ({' '.join(ignored)})")
