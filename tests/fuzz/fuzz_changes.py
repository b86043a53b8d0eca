"""Changes to valid files: to their bytes, their text, and what their format is made of.

Every change draws from a `random.Random`, so that one number names an input, and Hypothesis, which
has such an object too, can shrink it.
"""

import ast
import io
import json
import struct
import zipfile
import zlib
from random import Random

from fuzz_archives import archive, compressed_archive
from fuzz_bytes import OF_BYTES, OF_TEXT, put_number, swap_number

JSON_VALUES = [
    None, True, False, -1, 0, 1, 2, 3, 4, 5, 12, 36, 255, 5120, 5121, 5122, 5123, 5124, 5125, 5126,
    34963, 2**31, 2**32, 2**63, 2**64, 10**400, 0.5, 1.0, -0.0, 1e-40, 1e39, 1e308, float("nan"),
    float("inf"), "", "0", "VEC2", "VEC4", "MAT4", "SCALAR", "POSITION", "../../etc/passwd",
    "data:,x", "a.bin", "data:application/octet-stream;base64,AAAA", "\u0000", "\ud800",
    "é" * 3000, [], {}, [0], [[]], {"a": 0}, [0, 0, 0], [1, 1, 1], [0, 0, 0, 1], [0.0] * 16,
    list(range(16)), [1e39] * 3, [0] * 10000, {"nodes": [0]},
]  # fmt: skip
JSON_KEYS = [
    "byteStride", "byteOffset", "normalized", "sparse", "mode", "indices", "targets", "weights",
    "skin", "children", "matrix", "scale", "rotation", "translation", "extensions", "min", "max",
    "extras", "uri", "camera", "mesh", "NORMAL", "COLOR_0", "TEXCOORD_0", "JOINTS_0", "WEIGHTS_0",
    "_A", "material", "count", "extensionsRequired", "extensionsUsed", "scene", "animations",
    "sh", "intensity", "light", "lights", "name", "irradianceCoefficients", "object", "type",
]  # fmt: skip
_EXTENSIONS = [
    "KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization",
    "UNKNOWN_one", "EXT_mesh_gpu_instancing", "KHR_texture_transform", "KHR_materials_unlit",
    "KHR_node_visibility", "KHR_materials_pbrSpecularGlossiness", "EXT_texture_webp",
]  # fmt: skip
_EXTENSION = {
    "attributes": {"POSITION": 0},
    **{"buffer": 0, "byteLength": 10, "byteStride": 12, "count": 12, "mode": "ATTRIBUTES"},
    **{"offset": [0.5, 0.5], "scale": [2, 2], "diffuseFactor": [1, 0, 0, 1], "visible": False},
}


def _copied(tree):
    """Copy a tree of JSON, so that no change reaches another place, or a later input."""
    return json.loads(json.dumps(tree))


def _inside(tree: object) -> list[tuple]:
    """List each (container, key) of a tree of JSON."""
    places, todo = [], [tree]
    while todo:
        one = todo.pop()
        keys = list(one) if isinstance(one, dict) else range(len(one))
        for key in keys:
            places.append((one, key))
            if isinstance(one[key], dict | list):
                todo.append(one[key])
    return places


def _edit_tree(tree, rng: Random) -> None:
    """Change one place of a tree of JSON."""
    places = _inside(tree)
    if not places:
        return
    where, key = rng.choice(places)
    value = where[key]
    match rng.randrange(9):
        case 0 | 1 | 2:
            where[key] = _copied(rng.choice(JSON_VALUES))
        case 3 if isinstance(value, int | float) and not isinstance(value, bool):
            where[key] = value + rng.choice([-2, -1, 1, 2, 4, 0.5, 1000])
        case 4:
            del where[key]
        case 5:
            where[key] = _copied(rng.choice(places)[0])
        case 6 if isinstance(where, list):
            where.append(_copied(value))
        case 7 if isinstance(where, dict):
            where[rng.choice(JSON_KEYS)] = _copied(rng.choice(JSON_VALUES))
        case 8 if isinstance(where, dict):
            name = rng.choice(_EXTENSIONS)
            where["extensions"] = {name: _copied(_EXTENSION) | {"bufferView": rng.randrange(4)}}
            if rng.random() < 0.5:
                tree["extensionsRequired"] = [name]


def _edit_json(data: bytes, rng: Random, kind: str) -> bytes:
    """Change the JSON of a GLB, and give the container the lengths that it then has."""
    try:
        if not kind.endswith("glb"):
            tree, rest = json.loads(data), b""
        else:
            length = int.from_bytes(data[12:16], "little")
            tree, rest = json.loads(data[20 : 20 + length]), data[20 + length :]
        for _ in range(rng.choice([1, 1, 2, 4])):
            _edit_tree(tree, rng)
        text = json.dumps(tree).encode()
    except (ValueError, TypeError, RecursionError):
        return data
    if rng.random() < 0.01:  # deeper than any parser that calls itself likes
        text = text[:-1] + b', "x": ' + b"[" * 100000 + b"]" * 100000 + b"}"
    if not kind.endswith("glb"):
        return text
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON")
    return head + text + rest


def _edit_chunks(data: bytes, rng: Random, kind: str) -> bytes:
    """Double, drop, swap or rename the chunks of a GLB."""
    chunks, at = [], 12
    while at + 8 <= len(data):
        size = int.from_bytes(data[at : at + 4], "little")
        chunks.append(data[at : at + 8 + size])
        at += 8 + size
    if not chunks:
        return data
    match rng.randrange(4):
        case 0:
            chunks.insert(rng.randrange(len(chunks) + 1), rng.choice(chunks))
        case 1:
            del chunks[rng.randrange(len(chunks))]
        case 2:
            chunks.reverse()
        case 3:
            i = rng.randrange(len(chunks))
            chunks[i] = chunks[i][:4] + rng.choice([b"BIN\0", b"JSON", b"XYZ\0"]) + chunks[i][8:]
    body = b"".join(chunks)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def _edit_png(data: bytes, rng: Random, kind: str) -> bytes:
    """Change the header of a PNG, or what it packs, and give each chunk its right check sum."""
    chunks, at = [], 8
    while at + 12 <= len(data):
        size = int.from_bytes(data[at : at + 4], "big")
        chunks.append([data[at + 4 : at + 8], data[at + 8 : at + 8 + size]])
        at += 12 + size
    if not chunks:
        return data
    one = rng.choice(chunks[:1] * 3 + chunks)
    one[1] = rng.choice(OF_BYTES)(one[1], rng, kind)
    if rng.random() < 0.2:
        chunks.insert(rng.randrange(len(chunks) + 1), rng.choice(chunks))
    parts = [
        struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
        for name, body in chunks
    ]
    return data[:8] + b"".join(parts)


_DTYPES = [
    "<f4", ">f4", "<f8", "<f2", "<i4", "|u1", "<c8", "|O", "<U5", "|b1", "<f16", "|V7", 3, None,
    "x", [("a", "<f4")], "<M8[s]", "<f0",
]  # fmt: skip
_SHAPES = [
    (), (0,), (-1, 16, 3), (8, 16), (8, 16, 3), (16, 8, 3), (2**40, 2**40, 3), (1, 384), (5, 4),
    384, (2**31, 2**31), (True, 4), (8.0, 16), [8, 16, 3], None, (8, 16, 3, 1), (0, 16, 3),
]  # fmt: skip
_HEADERS = {"descr": _DTYPES, "fortran_order": [True, False, 1, None, "x"], "shape": _SHAPES}


def _edit_npy(data: bytes, rng: Random, kind: str = "npy") -> bytes:
    """Change the header of a NumPy file, or its array."""
    try:
        end = 10 + int.from_bytes(data[8:10], "little")
        fields = ast.literal_eval(data[10:end].decode("latin1"))
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return data
    key = rng.choice(list(_HEADERS))
    fields[key] = rng.choice(_HEADERS[key])
    if rng.random() < 0.1:
        fields[rng.choice(["more", "shape ", 3])] = 1
    text = repr(fields) if rng.random() < 0.95 else "(" * rng.choice([50, 3000]) + repr(fields)
    text = (text.encode("latin1") + b" " * 64)[: max(len(text) + 1, end - 11)] + b"\n"
    version = rng.choice([1, 1, 1, 2, 3])
    length = len(text).to_bytes(2 if version == 1 else 4, "little")
    return b"\x93NUMPY" + bytes([version, 0]) + length + text + data[end:]


def _edit_archive(data: bytes, rng: Random, kind: str) -> bytes:
    """Change a member of an archive by what it is, and close the archive properly again."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as file:
            if sum(one.file_size for one in file.infolist()) > 100_000:
                return data
            members = {name: file.read(name) for name in file.namelist()}
    except Exception:  # of a damaged archive
        return data
    if not members:
        return data
    name = rng.choice(list(members))
    match rng.randrange(9):
        case 0 | 1 | 2:
            members[name] = _edit_npy(members[name], rng)
        case 3 | 4:
            members[name] = rng.choice(OF_BYTES)(members[name], rng, kind)
        case 5:
            del members[name]
        case 6:
            members[rng.choice(["more.npy", "version", "../x.npy", "é.npy"])] = members[name]
        case 7:
            members[name] = rng.choice(list(members.values()))
        case 8:
            # A header that asks for much, with zeros that pack into nothing.
            return compressed_archive(members, {name: rng.choice([10**3, 10**5, 5 * 10**6])})
    return compressed_archive(members, {}) if rng.random() < 0.3 else archive(members)


_MIXED = OF_BYTES + OF_TEXT
_CHANGES = {
    "obj": _MIXED + OF_TEXT,
    "off": _MIXED + OF_TEXT,
    "mtl": _MIXED + OF_TEXT,
    "ply": _MIXED + OF_TEXT,
    "stl": _MIXED,
    "glb": [*OF_BYTES, *[_edit_json] * 16, *[_edit_chunks] * 2],
    "gltf": [*OF_BYTES, *OF_TEXT, *[_edit_json] * 16],
    "hdr": _MIXED,
    "exr": [*OF_BYTES, swap_number],
    "pfm": _MIXED,
    "png": [*OF_BYTES, _edit_png],
    "jpg": OF_BYTES,
    "tif": [*OF_BYTES, put_number, put_number],
    "npy": [*OF_BYTES, *[_edit_npy] * 8],
    "npz": [*OF_BYTES, *[_edit_archive] * 12],
    "light.json": [*OF_BYTES, *OF_TEXT, *[_edit_json] * 16],
    "light.txt": _MIXED + OF_TEXT,
    "light.gltf": [*OF_BYTES, *OF_TEXT, *[_edit_json] * 16],
    "light.glb": [*OF_BYTES, *[_edit_json] * 16, *[_edit_chunks] * 2],
    "light.npz": [*OF_BYTES, *[_edit_archive] * 12],
    "light.npy": [*OF_BYTES, *[_edit_npy] * 8],
    "splats.ply": _MIXED + OF_TEXT,
}


def change(kind: str, data: bytes, rng: Random) -> bytes:
    """Change a valid file one to three times."""
    for _ in range(rng.choice([1, 1, 1, 2, 2, 3])):
        data = rng.choice(_CHANGES[kind])(data, rng, kind)
    return data
