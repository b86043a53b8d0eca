"""Write GLB (glTF 2.0, Khronos): one mesh, a primitive for each material, textures inside."""

import json
from typing import Any

import numpy as np

from ..._core.gltf import glb
from .._base_color import BaseColor
from ._gltf_materials import WRAPS
from ._pictures import png
from ._write_arrays import Arrays

_FLOAT, _UINT32 = 5126, 5125
_ARRAY, _ELEMENTS = 34962, 34963  # what a part of the buffer is for
_UNLIT = "KHR_materials_unlit"
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


def glb_files(arrays: Arrays, stem: str) -> dict[str, bytes]:
    """Give a GLB in glTF's axes, faces grouped by material in the order of first use."""
    buffer = _Buffer()
    attributes = {
        "POSITION": buffer.floats(arrays.vertices, bounds=True),
        "NORMAL": buffer.floats(arrays.normals),
    }
    if arrays.uv is not None:
        # glTF's (0, 0) is the upper left of the picture.
        attributes["TEXCOORD_0"] = buffer.floats(arrays.uv * [1, -1] + [0, 1])
    if arrays.colors is not None:
        attributes["COLOR_0"] = buffer.floats(arrays.colors)
    primitives = []
    for row, faces in _by_material(arrays):
        primitive: dict[str, Any] = {"attributes": attributes, "indices": buffer.indices(faces)}
        if row >= 0:
            primitive["material"] = row
        primitives.append(primitive)
    node: dict[str, Any] = {"mesh": 0}
    if any(arrays.origin):
        node["translation"] = list(arrays.origin)
    content: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "jaxsh"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [node],
        "meshes": [{"name": stem, "primitives": primitives}],
        **_materials(arrays.materials, buffer),
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    return {"": glb(json.dumps(content, separators=(",", ":")).encode(), buffer.data)}


class _Buffer:
    """Collects the binary part, its views and its accessors."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def view(self, data: bytes, **more: int) -> int:
        """Append bytes, padded to a multiple of four, and give the index of their view."""
        self.views.append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more}
        )
        self.data += data + bytes(-len(data) % 4)
        return len(self.views) - 1

    def floats(self, rows: np.ndarray, bounds: bool = False) -> int:
        """Append vectors as float32 and give the index of their accessor."""
        rows = rows.astype("<f4")
        view = self.view(rows.tobytes(), target=_ARRAY)
        accessor = {
            "bufferView": view,
            "componentType": _FLOAT,
            "count": len(rows),
            "type": _KINDS[rows.shape[1]],
        }
        if bounds:
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def indices(self, faces: np.ndarray) -> int:
        """Append the corners of triangles and give the index of their accessor."""
        view = self.view(faces.astype("<u4").tobytes(), target=_ELEMENTS)
        self.accessors.append(
            {
                "bufferView": view,
                "componentType": _UINT32,
                "count": faces.size,
                "type": "SCALAR",
            }
        )
        return len(self.accessors) - 1


def _by_material(arrays: Arrays) -> list[tuple[int, np.ndarray]]:
    """Give (row of the material, its faces), -1 where there is none, in the order of first use."""
    if arrays.face_material is None:
        return [(-1, arrays.faces)]
    rows, first = np.unique(arrays.face_material, return_index=True)
    return [
        (int(row), arrays.faces[arrays.face_material == row]) for row in rows[np.argsort(first)]
    ]


def _materials(materials: tuple[BaseColor, ...], buffer: _Buffer) -> dict[str, Any]:
    """Describe materials, and put their textures into the buffer.

    Alpha is kept, but nothing says that it cuts out or blends: a `BaseColor` does not.
    """
    described, images, wraps = [], [], []
    codes = {name: code for code, name in WRAPS.items()}
    for material in materials:
        # Nothing here is metal, which glTF takes a material for that does not say so.
        factor = [float(one) for one in material.factor]
        surface: dict[str, Any] = {"baseColorFactor": factor, "metallicFactor": 0}
        if material.texture is not None:
            surface["baseColorTexture"] = {"index": len(images)}
            view = buffer.view(png(np.asarray(material.texture)))
            images.append({"bufferView": view, "mimeType": "image/png"})
            wraps.append(codes[material.wrap])
        one: dict[str, Any] = {"name": material.name, "pbrMetallicRoughness": surface}
        if material.double_sided:
            one["doubleSided"] = True
        if material.unlit:
            one["extensions"] = {_UNLIT: {}}
        described.append(one)
    parts: dict[str, Any] = {}
    if any(material.unlit for material in materials):
        parts["extensionsUsed"] = [_UNLIT]
    if described:
        parts["materials"] = described
    if images:
        parts["images"] = images
        known = sorted(set(wraps))
        parts["samplers"] = [{"wrapS": wrap, "wrapT": wrap} for wrap in known]
        parts["textures"] = [
            {"source": i, "sampler": known.index(wrap)} for i, wrap in enumerate(wraps)
        ]
    return parts
