"""A mesh out of polygons: centered, triangulated, cleaned, split where attributes differ."""

import math
import warnings
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from jaxtyping import Array

from .._core import srgb
from .._core.checks import described
from .._core.host import put
from .._core.words import reason
from ._clean import Clean, clean
from ._files._polygons import Polygons, unit
from ._files._triangulate import triangulate
from ._mesh import Mesh, host_normals
from ._split import smooth_groups, split

# A point given by the caller, and what decides over normals.
Origin = Sequence[float | int] | np.ndarray | Array
Normals = str | float | int

# Coordinates are large where float32 rounds them by more than this share of the median edge.
_LOST = 1e-3
# Sizes of the mesh that they are large beside: below, a center does not help.
_FAR = 8
# What float32 changes in a face, as a share of its size, is said above this.
_MOVED = 0.05
# Letters of a warning that come from a parser.
_SAID = 600
# Faces whose corners are held in float64 at a time.
_BLOCK = 1 << 16


def check_options(normals: Normals, origin: object) -> None:
    """Raise `ValueError` where an option of `read_mesh` or `make_mesh` is none."""
    if isinstance(normals, str):
        known = normals in ("file", "smooth")
    else:
        number = isinstance(normals, int | float | np.number) and not isinstance(normals, bool)
        known = number and 0 <= normals <= 180
    if not known:
        raise ValueError(
            f'normals must be "file", "smooth" or an angle from 0 to 180 degrees, got '
            f"{described(normals)}"
        )
    if origin is not None:
        try:
            point = np.asarray(origin, np.float64)
        except (TypeError, ValueError):
            point = np.zeros(0)
        if point.shape != (3,) or not np.isfinite(point).all():
            raise ValueError(f"origin must be three finite numbers, got {described(origin)}")


def assemble(
    polygons: Polygons,
    *,
    source: str,
    corners: bool,
    normals: Normals = "file",
    encoding: Literal["srgb", "linear"] = "srgb",
    origin: Origin | None = None,
    two_sided: bool = False,
) -> Mesh:
    """Make a mesh of what a parser gives, with one `UserWarning` on behalf of `source`.

    `corners` as in `clean`, `encoding` that of the colors; the rest as in `read_mesh`.
    """
    found = _in_short(polygons.found)
    slots, owner, crossed = triangulate(polygons.positions, polygons.corners, polygons.sizes)
    if crossed:
        found.append(f"{crossed} polygons that cross over themselves cut as well as can be")
    raw = polygons.corners[slots]
    if origin is None:
        origin, phrase = _origin(polygons.positions, raw)
        found += phrase
    center = np.asarray(origin, np.float64)
    with np.errstate(invalid="ignore"):
        positions = polygons.positions - center
    found += _moved(positions, raw)
    split_up = (polygons.normals, polygons.uv, polygons.colors)
    apart = corners or any(attribute is not None for attribute in split_up)
    try:
        whole = clean(positions, raw, corners=apart, two_sided=two_sided)
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from None
    slots, raw = slots[whole.rows], raw[whole.rows]

    attributes, vectors, at_knots = [], None, None
    if normals == "file" and polygons.normals is not None:
        # Where the file's agree they are one vertex, whatever the faces around.
        knots = whole.faces
        vectors, phrase = _from_file(polygons.normals, slots, whole)
        found += phrase
        attributes.append(vectors)
    else:
        knots, at_knots = _knots(whole, normals)
    uv = None if polygons.uv is None else _in_blocks(_uv, polygons.uv, slots)
    colors = None
    if polygons.colors is not None:
        colors = _in_blocks(lambda rows: _linear(rows, encoding), polygons.colors, slots)
    attributes += [a for a in (uv, colors) if a is not None]
    found += whole.found
    if found:
        warnings.warn(f"{source}: {', '.join(found)}", UserWarning, stacklevel=3)

    material = None
    if polygons.polygon_material is not None and polygons.materials:
        material = put(polygons.polygon_material[owner[whole.rows]], np.int32)
    if at_knots is None or attributes or knots is not whole.faces:
        corner, faces = split(whole.faces, knots, raw, attributes)
        vertices = whole.vertices[whole.faces.ravel()[corner]]
        given = np.asarray(at_knots)[knots] if vectors is None else vectors
        normal = given.reshape(-1, 3)[corner]
    else:
        corner, faces, vertices, normal = slice(0), whole.faces, whole.vertices, at_knots
    return Mesh(
        put(vertices),
        put(faces),
        put(normal),
        uv=None if uv is None else put(uv.reshape(-1, 2)[corner]),
        colors=None if colors is None else put(colors.reshape(-1, 4)[corner]),
        face_material=material,
        materials=polygons.materials,
        origin=(float(center[0]), float(center[1]), float(center[2])),
    )


def _in_short(phrases: Sequence[str]) -> list[str]:
    """Cut what a parser found, and say how much more there is: names in a file may be anything."""
    short = [reason(phrase) for phrase in phrases]
    fit = int((np.cumsum([len(phrase) for phrase in short]) <= _SAID).sum())
    return short[:fit] + ([f"{len(short) - fit} findings more"] if fit < len(short) else [])


def _knots(whole: Clean, normals: Normals):
    """Name for each corner the point whose faces share a normal, and give the normals there."""
    knots, vertices = whole.faces, whole.vertices
    if not isinstance(normals, str):
        knots = smooth_groups(vertices, knots, float(normals))
    if whole.backs.any():  # the two sides of a sheet face away from each other
        knots = 2 * knots.astype(np.int64) + whole.backs[:, None]
    if knots is not whole.faces:
        _, at, knots = np.unique(knots, return_index=True, return_inverse=True)
        knots = knots.reshape(-1, 3).astype(np.int32)
        vertices = vertices[whole.faces.ravel()[at]]
    # XLA takes numbers below 1.2e-38 for zero, and a power of two rounds nothing.
    exponent = np.frexp(np.abs(vertices).max())[1]
    if exponent < -60:
        vertices = np.ldexp(vertices, -exponent)
    return knots, host_normals(vertices, knots)


def _in_blocks(
    function: Callable[[np.ndarray], np.ndarray], values: np.ndarray, slots: np.ndarray
) -> np.ndarray:
    """Give what a function makes of the values at the corners of faces, in float32.

    A block of faces at a time: all at once, in float64, they take ten times the memory of a file.
    """
    out = np.empty((*slots.shape, values.shape[1]), np.float32)
    for start in range(0, len(slots), _BLOCK):
        block = slice(start, start + _BLOCK)
        out[block] = function(values[slots[block]])
    return out


def _from_file(given: np.ndarray, slots: np.ndarray, whole: Clean) -> tuple[np.ndarray, list[str]]:
    """Take unit normals (f, 3, 3) from the file, smooth ones where it has none or bad ones."""
    vectors = _in_blocks(lambda rows: unit(rows) + 0.0, given, slots)
    good = np.asarray(np.isfinite(vectors).all(axis=2))
    said = []
    if not good.all():
        missing = int(np.isnan(given[slots[~good]]).all(axis=1).sum())
        said = [
            (int((~good).sum()) - missing, "zero or infinite normals replaced by smooth ones"),
            (missing, "corners without a normal given a smooth one"),
        ]
        knots, smooth = _knots(whole, "smooth")
        vectors = np.where(good[..., None], vectors, smooth[knots])
    behind = 0
    for start in range(0, len(slots), _BLOCK):
        block = slice(start, start + _BLOCK)
        a, b, c = np.moveaxis(whole.vertices[whole.faces[block]].astype(np.float64), 1, 0)
        along = np.einsum("fki,fi->fk", vectors[block], np.cross(b - a, c - a))
        behind += int((along < 0).all(axis=1).sum())
    said.append((behind, "faces whose normals point against the order of their corners"))
    return vectors, [f"{count} {what}" for count, what in said if count]


def _uv(uv: np.ndarray) -> np.ndarray:
    """Fill what the file leaves out with zeros."""
    with np.errstate(over="ignore"):
        uv = uv.astype(np.float32)
    return np.where(np.isfinite(uv).all(axis=2, keepdims=True), uv, np.float32(0)) + np.float32(0)


def _linear(colors: np.ndarray, encoding: str) -> np.ndarray:
    """Decode RGBA (f, 3, 4), white where the file leaves it out."""
    colors = np.where(np.isfinite(colors), colors, 1.0)
    # No picture has such colors, and float32 would not hold their powers.
    colors = np.clip(colors, 0, 1e9)
    rgb = colors[..., :3]
    if encoding == "srgb":
        rgb = srgb.decode(rgb)
    return np.concatenate([rgb, colors[..., 3:]], axis=2).astype(np.float32)


def _moved(positions: np.ndarray, faces: np.ndarray) -> list[str]:
    """Say what share of faces float32 moves: an origin does not help parts that are far apart."""
    some = faces[:: max(len(faces) // _BLOCK, 1)]  # evenly spaced: all take their time
    corners = positions[some]
    with np.errstate(over="ignore", invalid="ignore"):
        error = np.abs(corners.astype(np.float32) - corners).max(axis=(1, 2))
        size = np.abs(corners - np.roll(corners, 1, axis=1)).max(axis=(1, 2))
        # Infinite ones are dropped, and said so.
        moved = (error > _MOVED * size) & (size > 0) & (error < np.inf)
    if not moved.any():
        return []
    return [
        f"float32 moves {100 * moved.mean():.2g} % of the faces by over 1/20 of their size: parts "
        "far from each other want files and an origin of their own"
    ]


def _origin(
    positions: np.ndarray, faces: np.ndarray
) -> tuple[tuple[float, float, float], list[str]]:
    """Choose what to take off the coordinates: nothing, unless float32 would lose their shape."""
    used = np.zeros(len(positions), bool)
    used[faces] = True
    used &= (np.abs(positions) < np.finfo(np.float32).max).all(axis=1)
    points = positions[used]
    zero = (0.0, 0.0, 0.0)
    if not len(points):
        return zero, []
    low, high = points.min(axis=0), points.max(axis=0)
    size, largest = float((high - low).max()), float(max(-low.min(), high.max()))
    if not largest > _FAR * size > 0:
        return zero, []
    edges = np.linalg.norm(positions[faces[:, 0]] - positions[faces[:, 1]], axis=1)
    edges = edges[np.isfinite(edges) & (edges > 0)]
    if not len(edges) or largest * 2.0**-24 <= _LOST * float(np.median(edges)):
        return zero, []
    # A round number, so that files of one scene often share it.
    step = 10.0 ** math.floor(math.log10(size))
    x, y, z = (np.round((low + high) / 2 / step) * step + 0.0).tolist()
    return (x, y, z), [
        f"coordinates up to {largest:.7g} over a size of {size:.3g} are too large for float32, "
        f"origin=({x:.17g}, {y:.17g}, {z:.17g}) taken off"
    ]
