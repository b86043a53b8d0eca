"""A glTF file put together by hand, so that each test holds one feature of the format."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from jaxsh.geometry._files._gltf import read_gltf

# A tetrahedron seen from outside, of volume 1/6.
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.uint16)
_CODES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Gltf:
    """JSON and one buffer; `add` stores an array and gives the number of its accessor."""

    def __init__(self, **fields: Any):
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}, **fields}
        self.bytes = bytearray()

    def entry(self, kind: str, **fields: Any) -> int:
        self.json.setdefault(kind, []).append(fields)
        return len(self.json[kind]) - 1

    def view(self, data: bytes, **fields: Any) -> int:
        self.bytes += bytes(-len(self.bytes) % 4)
        start = len(self.bytes)
        self.bytes += data
        return self.entry("bufferViews", buffer=0, byteOffset=start, byteLength=len(data), **fields)

    def add(self, array: Any, **fields: Any) -> int:
        array = np.asarray(array)
        width = array.shape[1] if array.ndim > 1 else 1
        about = {"componentType": _CODES[array.dtype.str[1:]], "type": _KINDS[width]}
        view = self.view(array.tobytes())
        return self.entry("accessors", bufferView=view, count=len(array), **about, **fields)

    def mesh(self, corners: Any = CORNERS, faces: Any = FACES, **fields: Any) -> int:
        """A mesh of one primitive; `corners` may be the number of an accessor."""
        position = corners if isinstance(corners, int) else self.add(corners)
        attributes = {"POSITION": position, **fields.pop("attributes", {})}
        if faces is not None:
            fields["indices"] = self.add(np.asarray(faces).reshape(-1))
        return self.entry("meshes", primitives=[{"attributes": attributes, **fields}])

    def glb(self, node: dict[str, Any] | None = None, tail: bytes = b"") -> bytes:
        """The binary form; with `node`, a node that shows mesh 0 is added."""
        if node is not None:
            self.entry("nodes", mesh=0, **node)
        if self.bytes and "buffers" not in self.json:
            self.entry("buffers", byteLength=len(self.bytes))
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        content = struct.pack("<2I", len(text), 0x4E4F534A) + text
        if self.bytes:
            data = bytes(self.bytes) + bytes(-len(self.bytes) % 4)
            content += struct.pack("<2I", len(data), 0x004E4942) + data
        return b"glTF" + struct.pack("<2I", 2, 12 + len(content)) + content + tail


def read(gltf: Gltf, node: dict | None = None):
    return read_gltf(Path("a.glb"), gltf.glb(node))


def triangles(polygons) -> np.ndarray:
    assert (polygons.sizes == 3).all()
    return polygons.positions[polygons.corners].reshape(-1, 3, 3)


def volume(polygons) -> float:
    """Signed: positive where faces are counter-clockwise seen from outside."""
    return float(np.linalg.det(triangles(polygons)).sum() / 6)
