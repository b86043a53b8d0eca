"""Changes to valid files: to their bytes, their text, and what their format is made of.

Every change draws from a `random.Random`, so that one number names an input, and Hypothesis, which
has such an object too, can shrink it.
"""

import ast
import io
import json
import re
import struct
import zipfile
import zlib
from random import Random

import numpy as np
from fuzz_files import archive, compressed_archive, seeds

BYTES = [0, 1, 9, 10, 13, 32, 34, 45, 47, 92, 127, 128, 254, 255]
NUMBERS = [
    "nan", "-nan(ind)", "inf", "-inf", "1e39", "-1e308", "1e309", "1e-46", "1e-320", "-0", "00",
    "+1", "1.", ".5", "1e", "1e+", "1.2.3", "--1", "0x10", "1_0", "1,5", "1d3", "", "-1", "0", "1",
    "2", "12", "13", "-12", "-13", "255", "256", "32767", "65535", "65536", "2147483647",
    "2147483648", "4294967295", "4294967296", "9223372036854775807", "9223372036854775808",
    "1" * 400, "9" * 5000, "0." + "3" * 300, "٣", "１", "²", "∞", "1\u00a0", "a", "true", "null",
    "1e9", "3.5", "16777217",
]  # fmt: skip
WORDS = [
    b"#", b"\\", b"\\\n", b"\0", b"\xef\xbb\xbf", b"\xff\xfe", b"\xc2\xa0", b"\xe2\x80\xa8",
    b"\x85", b"\x0b", b"\x0c", b"\x1c", b"\x1a", b"\xf0\x9f\x92\xa1", b"\xc3", b"\xed\xa0\x80",
    b"\t", b" ", b"\n", b"\r", b"\r\n", b"\n\n", b"/", b"//", b"%s", b"{}", b"\x1b[31m",
    b"\xe2\x80\xae", b"A" * 5000,
]  # fmt: skip
WHOLE = [
    0,
    1,
    2,
    3,
    127,
    128,
    255,
    256,
    32767,
    32768,
    65535,
    65536,
    2**24,
    2**31 - 1,
    2**31,
    2**32 - 1,
]
_NUMBER = re.compile(rb"(?<![\w.])[-+]?\d[\w.+-]*")


def change(kind: str, data: bytes, rng: Random) -> bytes:
    """Change a valid file one to three times."""
    for _ in range(rng.choice([1, 1, 1, 2, 2, 3])):
        data = rng.choice(_CHANGES[kind])(data, rng, kind)
    return data


def _place(data: bytes, rng: Random) -> int:
    """Draw a place in a file; half of the time near its start, where headers are."""
    end = len(data) if rng.random() < 0.5 else min(len(data), 200)
    return rng.randrange(end + 1)


def _put_byte(data: bytes, rng: Random, kind: str) -> bytes:
    at = _place(data, rng)
    return data[:at] + bytes([rng.choice(BYTES)]) + data[at + 1 :]


def _flip_bit(data: bytes, rng: Random, kind: str) -> bytes:
    if not data:
        return data
    at = min(_place(data, rng), len(data) - 1)
    return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]


def _put_number(data: bytes, rng: Random, kind: str) -> bytes:
    """Overwrite by a whole number in binary, in either order of bytes."""
    at = _place(data, rng)
    size = rng.choice([1, 2, 4, 4, 8])
    value = rng.choice([rng.choice(WHOLE), -rng.choice(WHOLE), rng.getrandbits(64)]) % 256**size
    return data[:at] + value.to_bytes(size, rng.choice(["little", "big"])) + data[at + size :]


def _put_float(data: bytes, rng: Random, kind: str) -> bytes:
    at = _place(data, rng)
    at -= at % 4 if rng.random() < 0.5 else 0
    value = rng.choice([np.nan, np.inf, -np.inf, 3e38, 1e-45, -0.0, -1.0, 1e9, 0.5])
    new = struct.pack(rng.choice(["<f", ">f", "<d"]), value)
    return data[:at] + new + data[at + len(new) :]


def _truncate(data: bytes, rng: Random, kind: str) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _insert(data: bytes, rng: Random, kind: str) -> bytes:
    at = _place(data, rng)
    new = rng.choice(
        [rng.choice(WORDS), bytes(rng.randrange(256) for _ in range(rng.randrange(9)))]
    )
    return data[:at] + new + data[at:]


def _cut(data: bytes, rng: Random, kind: str) -> bytes:
    at = _place(data, rng)
    return data[:at] + data[at + rng.choice([1, 1, 2, 4, 12, 50]) :]


def _copy(data: bytes, rng: Random, kind: str) -> bytes:
    """Put a part of the file, or all of it, somewhere else."""
    start = rng.randrange(len(data) + 1)
    part = data[start : start + rng.choice([1, 4, 12, 80, len(data)])]
    at = _place(data, rng)
    return data[:at] + part + data[at:]


def _splice(data: bytes, rng: Random, kind: str) -> bytes:
    """Go on as another file of the format does."""
    other = rng.choice(seeds(kind))
    return data[: rng.randrange(len(data) + 1)] + other[rng.randrange(len(other) + 1) :]


_BYTES = [_put_byte, _flip_bit, _put_number, _put_float, _truncate, _insert, _cut, _copy, _splice]


def _swap_number(data: bytes, rng: Random, kind: str) -> bytes:
    """Replace one number in the text by an odd one, or by one nearby."""
    found = list(_NUMBER.finditer(data[:20000]))
    if not found:
        return data
    # The first numbers are the header's counts.
    one = rng.choice(found[:4] if rng.random() < 0.4 else found)
    new = rng.choice(NUMBERS).encode()
    if rng.random() < 0.3 and one[0].isdigit() and len(one[0]) < 10:
        new = str(int(one[0]) + rng.choice([-2, -1, 1, 2])).encode()
    return data[: one.start()] + new + data[one.end() :]


def _swap_ends(data: bytes, rng: Random, kind: str) -> bytes:
    ends = [b"\n", b"\r\n", b"\r", b"\n\r", b"\n\n", b" \n", b"\x0b", b"\xc2\x85", b"\xe2\x80\xa8"]
    return data.replace(b"\n", rng.choice(ends), rng.choice([-1, -1, 1, 5]))


def _move_line(data: bytes, rng: Random, kind: str) -> bytes:
    """Drop, double, swap, join, lengthen or comment out a line."""
    lines = data.split(b"\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(7):
        case 0:
            del lines[i]
        case 1:
            lines.insert(j, lines[i])
        case 2:
            lines[i], lines[j] = lines[j], lines[i]
        case 3:
            lines[i : i + 2] = [b" ".join(lines[i : i + 2])]
        case 4:
            lines[i] += b" " + rng.choice(lines)
        case 5:
            lines[i] = b"#" + lines[i]
        case 6:
            lines.insert(i, rng.choice([b"", b"# \xc3\xa9 comment", b"comment format ascii 1.0"]))
    return b"\n".join(lines)


def _move_word(data: bytes, rng: Random, kind: str) -> bytes:
    """Drop, double, swap or change the case of a word."""
    words = re.split(rb"(\s+)", data)
    i, j = rng.randrange(0, len(words), 2), rng.randrange(0, len(words), 2)
    match rng.randrange(5):
        case 0:
            words[i] = b""
        case 1:
            words[i] += b" " + words[i]
        case 2:
            words[i], words[j] = words[j], words[i]
        case 3:
            words[i] = words[i].swapcase()
        case 4:
            words[i] = rng.choice(WORDS)
    return b"".join(words)


_TEXT = [_swap_number, _swap_number, _swap_number, _swap_ends, _move_line, _move_line, _move_word]

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
        if kind == "gltf":
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
    if kind == "gltf":
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
    one[1] = rng.choice(_BYTES)(one[1], rng, kind)
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
            members[name] = rng.choice(_BYTES)(members[name], rng, kind)
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


_MIXED = _BYTES + _TEXT
_CHANGES = {
    "obj": _MIXED + _TEXT,
    "off": _MIXED + _TEXT,
    "mtl": _MIXED + _TEXT,
    "ply": _MIXED + _TEXT,
    "stl": _MIXED,
    "glb": [*_BYTES, *[_edit_json] * 16, *[_edit_chunks] * 2],
    "gltf": [*_BYTES, *_TEXT, *[_edit_json] * 16],
    "hdr": _MIXED,
    "exr": [*_BYTES, _swap_number],
    "pfm": _MIXED,
    "png": [*_BYTES, _edit_png],
    "jpg": _BYTES,
    "tif": [*_BYTES, _put_number, _put_number],
    "npy": [*_BYTES, *[_edit_npy] * 8],
    "npz": [*_BYTES, *[_edit_archive] * 12],
}
