"""Read the primitives of a glTF mesh: faces, what their vertices carry, morph targets applied."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Integer

from ..._core.gltf import Document
from ..._core.json_fields import Fields, inner, listed, numbers, shown, whole
from ._gltf_accessors import WIDTHS, Accessor, read_accessor, read_indices
from ._gltf_draco import decode_draco
from ._gltf_materials import Materials

_TRIANGLES, _STRIP, _FAN = 4, 5, 6  # modes; below them are points and lines
# Types that each attribute may have; where integers are fractions, whether flagged so or not.
_TYPES = {"POSITION": ("VEC3",), "NORMAL": ("VEC3",), "COLOR_0": ("VEC3", "VEC4")}
_FRACTIONS = ("COLOR_0", "WEIGHTS")


class Part(NamedTuple):
    """Holds the triangles of one primitive in the coordinates of its mesh, and their vertices."""

    positions: Float[np.ndarray, "n 3"]
    faces: Integer[np.ndarray, "t 3"]
    material: int  # row of the table of materials, -1 for none
    normals: Float[np.ndarray, "n 3"] | None = None  # of any length
    uv: Float[np.ndarray, "n 2"] | None = None
    colors: Float[np.ndarray, "n 4"] | None = None
    joints: Integer[np.ndarray, "n j"] | None = None
    weights: Float[np.ndarray, "n j"] | None = None


def read_parts(
    document: Document, materials: Materials, index: int, weights: list[float] | None, owner: str
) -> list[Part]:
    """Read the triangles of a mesh, with its own morph weights where a node gives none."""
    fields, name = document.item("meshes", index, owner), f"mesh {index}"
    if weights is None:
        weights = numbers(fields, "weights", name, None, [])
    parts = []
    primitives = listed(fields, "primitives", name)
    document.spend(64 * len(primitives))  # many nodes may show one mesh
    for number, primitive in enumerate(primitives):
        title = f"primitive {number} of {name}"
        if not isinstance(primitive, dict):
            raise ValueError(f"{title} should be an object, got {shown(primitive)}")
        part = _read_part(document, materials, primitive, weights, title)
        if part is not None:
            parts.append(part)
    return parts


def _read_part(
    document: Document, materials: Materials, primitive: Fields, weights: list[float], owner: str
) -> Part | None:
    mode = whole(primitive, "mode", owner, _TRIANGLES)
    if mode > _FAN:
        raise ValueError(f"{owner} has mode {shown(mode)}, which glTF does not know")
    if mode < _TRIANGLES:
        document.note("primitives of points or lines ignored")
        return None
    attributes = inner(primitive, "attributes", owner)
    if "POSITION" not in attributes:
        document.note("primitives without positions ignored")
        return None
    unpacked, corners = decode_draco(document, primitive, attributes, owner)
    vertices = _Vertices(document, attributes, unpacked, owner)
    if corners is not None:
        mode = _TRIANGLES
    else:
        corners = _corners(document, primitive, mode, vertices.count, owner)
    faces = _faces(corners, mode, owner)
    if mode == _STRIP:
        # Triangles that repeat a vertex only join one strip to the next.
        places = vertices.accessor("POSITION").raw[faces]
        repeats = (places == np.roll(places, 1, axis=1)).all(axis=2).any(axis=1)
        faces = faces[~repeats]
    if len(faces) == 0:
        document.note("primitives without a triangle ignored")
        return None
    document.spend(faces.size)
    used, renumbered = _used(faces, vertices.count)

    number = primitive.get("material")
    row = -1 if number is None else materials.row(whole(primitive, "material", owner), owner)
    names = {"POSITION": "POSITION", "NORMAL": "NORMAL", "COLOR_0": "COLOR_0"}
    names["TEXCOORD"] = f"TEXCOORD_{materials.uv_set(row)}"
    values = {
        key: vertices.accessor(name).rows(used) for key, name in names.items() if name in attributes
    }
    if materials.has_texture(row) and "TEXCOORD" not in values:
        document.note(f"primitives have a texture but no {names['TEXCOORD']}")
    _morph(document, primitive, weights, names, values, used, owner)

    uv, colors = values.get("TEXCOORD"), values.get("COLOR_0")
    if colors is not None:
        opaque = np.ones((len(colors), 4 - colors.shape[1]))
        if (colors > 1 + 1e-6).any():
            document.note("primitives have colors over 1, cut off as glTF says")
        colors = np.clip(np.concatenate([colors, opaque], axis=1), 0, 1)
    joints, shares = _influences(vertices, used)
    return Part(
        values["POSITION"],
        renumbered,
        row,
        values.get("NORMAL"),
        None if uv is None else materials.place_uv(row, uv),
        colors,
        joints,
        shares,
    )


class _Vertices:
    """Finds the attributes of a primitive's vertices, packed by Draco or not."""

    def __init__(
        self, document: Document, attributes: Fields, unpacked: dict[str, Accessor], owner: str
    ):
        self.document = document
        self._unpacked = unpacked
        self.attributes = attributes
        self.owner = owner
        self.count = 0
        self.count = len(self.accessor("POSITION").raw)

    def accessor(self, name: str) -> Accessor:
        title = f"{name} of {self.owner}"
        types = _TYPES.get(name, ("VEC2",) if name.startswith("TEXCOORD") else ("VEC4",))
        found = self._unpacked.get(name)
        if found is None:
            number = whole(self.attributes, name, self.owner)
            found = read_accessor(self.document, number, title, types)
        elif found.raw.shape[1] not in [WIDTHS[kind] for kind in types]:
            raise ValueError(f"{title} should be {' or '.join(types)}, got {found.raw.shape[1]}")
        if len(found.raw) < self.count:
            raise ValueError(f"{title} has {len(found.raw)} elements for {self.count} positions")
        return _as_fractions(name, found)


def _as_fractions(name: str, accessor: Accessor) -> Accessor:
    return accessor._replace(normalized=True) if name.startswith(_FRACTIONS) else accessor


def _corners(
    document: Document, primitive: Fields, mode: int, count: int, owner: str
) -> Integer[np.ndarray, " n"]:
    """Give the vertex of each corner, or of each place in a strip or fan."""
    if primitive.get("indices") is None:
        # Before `arange`: positions that are not stored cost nothing so far.
        document.spend(count)
        return np.arange(count)
    title = f"indices of {owner}"
    stored = read_indices(document, whole(primitive, "indices", owner), title)
    document.spend(len(stored))
    largest = int(stored.max(initial=0))
    restart = largest == np.iinfo(stored.dtype).max
    # In a list of triangles the largest number can only be meant as a vertex, if there is one.
    if restart and (mode != _TRIANGLES or largest >= count):
        raise ValueError(f"{title} hold {largest}, which restarts a primitive and is not allowed")
    if len(stored) and largest >= count:
        raise ValueError(f"{title} name vertex {largest}, but there are {count}")
    return stored.astype(np.int64)


def _faces(corners: Integer[np.ndarray, " n"], mode: int, owner: str) -> Integer[np.ndarray, "t 3"]:
    """Give the triangles of a list, strip or fan, counter-clockwise seen from outside."""
    if mode == _TRIANGLES:
        if len(corners) % 3:
            raise ValueError(f"{owner} has {len(corners)} corners, not three for each triangle")
        return corners.reshape(-1, 3)
    if len(corners) < 3:
        return np.zeros((0, 3), np.int64)
    if mode == _FAN:
        first = np.broadcast_to(corners[:1], len(corners) - 2)
        return np.stack([corners[1:-1], corners[2:], first], axis=1)
    faces = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    faces[1::2, 1:] = faces[1::2, :0:-1]
    return faces


def _used(
    faces: Integer[np.ndarray, "t 3"], count: int
) -> tuple[Integer[np.ndarray, " n"], Integer[np.ndarray, "t 3"]]:
    """Give the vertices that faces use, in order, and the faces in terms of them."""
    if count > 4 * faces.size:  # primitives often share one long list of vertices
        used, renumbered = np.unique(faces, return_inverse=True)
        return used, renumbered.reshape(-1, 3)
    marked = np.zeros(count, bool)
    marked[faces] = True
    return np.flatnonzero(marked), (np.cumsum(marked) - 1)[faces]


def _morph(
    document: Document,
    primitive: Fields,
    weights: list[float],
    names: dict[str, str],
    values: dict[str, np.ndarray],
    used: Integer[np.ndarray, " n"],
    owner: str,
) -> None:
    """Add the displacements of the morph targets that have a weight."""
    targets = listed(primitive, "targets", owner)
    if targets and weights and len(targets) != len(weights):
        raise ValueError(f"{owner} has {len(targets)} morph targets, but {len(weights)} weights")
    document.spend(64 * len(targets))
    for number, (weight, target) in enumerate(zip(weights, targets, strict=False)):
        if weight == 0:
            continue
        if not isinstance(target, dict):
            raise ValueError(f"{owner} should have objects as targets, got {shown(target)}")
        for key, value in values.items():
            if names[key] not in target:
                continue
            title = f"{names[key]} of morph target {number} of {owner}"
            types = _TYPES.get(key, ("VEC2",))
            found = read_accessor(document, whole(target, names[key], title), title, types)
            if len(found.raw) <= used[-1]:
                raise ValueError(f"{title} has {len(found.raw)} elements, too few for its mesh")
            document.spend(len(used))
            move = weight * _as_fractions(key, found).rows(used)[:, : value.shape[1]]
            value[:, : move.shape[1]] += move  # colors may move without their alpha


def _influences(
    vertices: _Vertices, used: Integer[np.ndarray, " n"]
) -> tuple[Integer[np.ndarray, "n j"] | None, Float[np.ndarray, "n j"] | None]:
    """Read the joints that move each vertex, and their weights; None where there are none."""
    joints, weights = [], []
    while {f"JOINTS_{len(joints)}", f"WEIGHTS_{len(joints)}"} <= vertices.attributes.keys():
        stored = vertices.accessor(f"JOINTS_{len(joints)}").raw
        if stored.dtype.kind != "u":
            owner = vertices.owner
            raise ValueError(f"JOINTS_{len(joints)} of {owner} should be of an unsigned type")
        vertices.document.spend(len(used))
        weights.append(vertices.accessor(f"WEIGHTS_{len(joints)}").rows(used))
        joints.append(stored[used])
    if not joints:
        return None, None
    return np.concatenate(joints, axis=1), np.concatenate(weights, axis=1)
