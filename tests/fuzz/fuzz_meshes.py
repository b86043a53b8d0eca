"""Small valid meshes of every format that is read, as bytes."""

import base64
import json
import struct

import numpy as np
from fuzz_pictures import PNG

# A prism over an L: concave, watertight, a quad or an L a side; all coordinates exact in decimal.
_RING = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 3], [0, 3]]) / 2
POINTS = np.concatenate([np.c_[_RING, np.zeros(6)], np.c_[_RING, np.full(6, 0.75)]])
POLYGONS = [
    [5, 4, 3, 2, 1, 0],
    [6, 7, 8, 9, 10, 11],
    *([i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6] for i in range(6)),
]
# The same as triangles: the L's by hand.
_CAP = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
TRIANGLES = np.array(
    [(c, b, a) for a, b, c in _CAP]
    + [(a + 6, b + 6, c + 6) for a, b, c in _CAP]
    + [t for a, b, c, d in POLYGONS[2:] for t in ((a, b, c), (a, c, d))]
)
_COLORS = np.arange(48).reshape(12, 4) * 5 % 256
_UV = POINTS[:, :2] / 2 + 0.125


def _obj() -> list[bytes]:
    lines = [f"v {x:g} {y:g} {z:g}" for x, y, z in POINTS]
    plain = [*lines, *("f " + " ".join(str(i + 1) for i in p) for p in POLYGONS)]
    rows = zip(lines, _COLORS / 255, strict=True)
    caps = [" ".join(f"{i + 1}/{i + 1}/{n}" for i in p) for n, p in enumerate(POLYGONS[:2], 1)]
    walls = []
    for p in POLYGONS[2:]:  # with normals of their own, and indices that count back; some broken
        x, y = _RING[p[1]] - _RING[p[0]]
        corners = [f"{i - 12}//-1" if i % 2 else f"{i + 1}/{i + 1}/-1" for i in p]
        join = " " if len(walls) < 6 else " \\\n "
        walls += [f"vn {y:g} {-x:g} 0", "f " + join.join(corners)]
    full = [
        *("# an L", "mtllib scene.mtl", "o one"),
        *(f"{line} {r:.6f} {g:.6f} {b:.6f}" for line, (r, g, b, _) in rows),
        *(f"vt {u:g} {v:g}" for u, v in _UV),
        *("vn 0 0 -1", "vn 0 0 1", "s off", "g caps", "usemtl red"),
        *(f"f {cap}" for cap in caps),
        *("g walls", "usemtl blue"),
        *walls,
    ]
    return ["\n".join(text).encode() + b"\n" for text in (plain, full)]


def _mtl() -> list[bytes]:
    plain = b"newmtl red\nKd 1 0.5 0\nmap_Kd red.png\nnewmtl blue\nKd 0 0 1\nd 0.5\n"
    full = (
        b"# made by hand\nnewmtl red\n\tNs 96\nKa 1 1 1\nKd 0.5\nTr 0.25\nillum 2\n"
        b"map_Kd -s 1 1 1 -o 0.5 0 red.png\n\nnewmtl  blue \nKd 0.25 0.5 1e0\nd -halo 1\n"
    )
    return [plain, full]


def _off() -> list[bytes]:
    points = [" ".join(f"{c:g}" for c in p) for p in POINTS]
    faces = [" ".join(map(str, [len(p), *p])) for p in POLYGONS]
    plain = ["OFF", "12 8 18", *points, *faces]
    glued = ["OFF12 8 0", "# a comment", "", *points, *(f"{face} 255 0 0" for face in faces)]
    shares = [" ".join(f"{c:.3f}" for c in row) for row in _COLORS / 255]
    colored = ["COFF", "12 8 0", *map(" ".join, zip(points, shares, strict=True)), *faces]
    head = b"OFF BINARY\n" + struct.pack(">3i", 12, 8, 0)
    body = POINTS.astype(">f4").tobytes()
    body += b"".join(struct.pack(f">{len(p) + 2}i", len(p), *p, 0) for p in POLYGONS)
    return [*("\n".join(text).encode() + b"\n" for text in (plain, glued, colored)), head + body]


def _stl() -> list[bytes]:
    corners = POINTS[TRIANGLES]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    rows = np.concatenate([normals[:, None], corners], axis=1).reshape(-1, 12)
    binary = b"made by hand".ljust(80) + struct.pack("<I", len(rows))
    binary += b"".join(struct.pack("<12fH", *row, 0) for row in rows)
    facets = [
        "facet normal {:g} {:g} {:g}\n outer loop\n"
        "  vertex {:g} {:g} {:g}\n  vertex {:g} {:g} {:g}\n  vertex {:g} {:g} {:g}\n"
        " endloop\nendfacet\n".format(*row)
        for row in rows
    ]
    one = "solid one\n" + "".join(facets) + "endsolid one\n"
    two = "".join(f"solid {i}\n{''.join(facets[i::2])}endsolid\n" for i in range(2))
    return [binary, one.encode(), two.encode()]


def _ply() -> list[bytes]:
    fields = {"x": "float", "y": "float", "z": "float"}
    more = {"nx": "float", "ny": "float", "nz": "double", "s": "float", "t": "float"}
    more |= {"red": "uchar", "green": "uchar", "blue": "uchar", "alpha": "uchar"}
    codes = {"float": "f", "double": "d", "uchar": "B"}

    def header(form, kinds, count="uchar", index="int"):
        return "\n".join([
            "ply", f"format {form} 1.0", "comment made by hand", "element vertex 12",
            *(f"property {kind} {name}" for name, kind in kinds.items()), "element face 8",
            f"property list {count} {index} vertex_indices", "end_header\n",
        ]).encode()  # fmt: skip

    rows = np.c_[POINTS, _outward(POINTS), _UV, _COLORS]
    text = "".join(" ".join(f"{c:g}" for c in row) + "\n" for row in rows)
    text += "".join(" ".join(map(str, [len(p), *p])) + "\n" for p in POLYGONS)
    files = [header("ascii", fields | more) + text.encode()]
    for order, name in (("<", "little"), (">", "big")):
        kinds = fields | more
        form = "".join(codes[kind] for kind in kinds.values())
        body = b"".join(struct.pack(order + form, *row[:8], *map(int, row[8:])) for row in rows)
        body += b"".join(struct.pack(f"{order}B{len(p)}i", len(p), *p) for p in POLYGONS)
        files.append(header(f"binary_{name}_endian", kinds) + body)
    plain = b"".join(struct.pack("<3f", *p) for p in POINTS)
    plain += b"".join(struct.pack(f"<I{len(p)}H", len(p), *p) for p in POLYGONS)
    files.append(header("binary_little_endian", fields, "uint", "ushort") + plain)
    strip = [6, 0, 7, 1, 8, 2, 9, 3, -1, 9, 3, 10, 4, 11, 5, 6, 0]  # the walls
    body = struct.pack(f"<I{len(strip)}i", len(strip), *strip)
    points = b"".join(struct.pack("<3f", *p) for p in POINTS)
    head = header("binary_little_endian", fields).replace(
        b"element face 8\nproperty list uchar int vertex_indices",
        b"element tristrips 1\nproperty list uint int vertex_indices",
    )
    return [*files, head + points + body]


def glb(content: dict, body: bytes) -> bytes:
    """Put JSON and a buffer into the container of glTF."""
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    body += bytes(-len(body) % 4)
    size = 28 + len(text) + len(body)
    head = struct.pack("<4sIII4s", b"glTF", 2, size, len(text), b"JSON")
    return head + text + struct.pack("<I4s", len(body), b"BIN\0") + body


def _outward(points: np.ndarray) -> np.ndarray:
    """Give a unit normal for each point, on the same side as all its faces."""
    corners = points[TRIANGLES]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.zeros_like(points)
    np.add.at(sums, TRIANGLES, (normals / np.linalg.norm(normals, axis=1, keepdims=True))[:, None])
    return sums / np.linalg.norm(sums, axis=1, keepdims=True)


def _glb() -> list[bytes]:
    turned = POINTS[:, [0, 2, 1]] * [1, 1, -1]
    parts = [
        turned.astype("<f4").tobytes(),
        TRIANGLES.astype("<u2").tobytes(),
        _outward(turned).astype("<f4").tobytes(),
        _UV.astype("<f4").tobytes(),
        _COLORS.astype("u1").tobytes(),
        np.array([3], "<u2").tobytes(),
        np.array([[0.5, 0.25, 0.125]], "<f4").tobytes(),
        PNG,
    ]
    views, offset = [], 0
    for part in parts:
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(part)})
        offset += len(part) + -len(part) % 4
    body = b"".join(part + bytes(-len(part) % 4) for part in parts)
    bounds = {"min": turned.min(axis=0).tolist(), "max": turned.max(axis=0).tolist()}
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 12, "type": "VEC3", **bounds},
        {"bufferView": 1, "componentType": 5123, "count": TRIANGLES.size, "type": "SCALAR"},
        {"bufferView": 2, "componentType": 5126, "count": 12, "type": "VEC3"},
        {"bufferView": 3, "componentType": 5126, "count": 12, "type": "VEC2"},
        {"bufferView": 4, "componentType": 5121, "count": 12, "type": "VEC4", "normalized": True},
    ]
    primitive = {"attributes": {"POSITION": 0}, "indices": 1}
    content = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "accessors": accessors[:2],
        "bufferViews": views,
        "buffers": [{"byteLength": len(body)}],
    }
    attributes = {"POSITION": 0, "NORMAL": 2, "TEXCOORD_0": 3, "COLOR_0": 4}
    full = {
        **content,
        "nodes": [
            {"children": [1, 2], "scale": [1, 1, 2]},
            {"mesh": 0, "translation": [0, 5, 0], "rotation": [0, 0.6, 0, 0.8]},
            {"mesh": 0, "matrix": [2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -9, 1]},
        ],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 1, "material": 0}]}],
        "materials": [{
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.5, 0.25, 1, 1], "baseColorTexture": {"index": 0}
            },
            "doubleSided": True,
        }],
        "textures": [{"source": 0}],
        "images": [{"bufferView": 7, "mimeType": "image/png"}],
        "accessors": accessors,
    }  # fmt: skip
    sparse = {
        "count": 1,
        "indices": {"bufferView": 5, "componentType": 5123},
        "values": {"bufferView": 6},
    }
    lifted = {**content, "accessors": [{**accessors[0], "sparse": sparse}, accessors[1]]}
    modes = [{"attributes": {"POSITION": 0}, "mode": mode} for mode in (5, 6)]
    strips = {
        **content,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0}, {"mesh": 1, "translation": [9, 0, 0]}],
        "meshes": [{"primitives": [one]} for one in modes],
    }
    files = [glb(one, body) for one in (content, full, lifted, strips)]
    return files + _packed_glb(turned)


def _packed_glb(points: np.ndarray) -> list[bytes]:
    """Give GLB files compressed by meshoptimizer, and by Draco where it is installed."""
    from gltf_writer import Gltf
    from test_gltf_packed import GRID, accessor, packed

    one = Gltf(extensionsRequired=["EXT_meshopt_compression"])
    view = packed(one, "floats 0", 49, 12, "ATTRIBUTES")
    one.mesh(accessor(one, view, 49, 5126, "VEC3"), np.uint8(GRID))
    one.json["buffers"] = [{"byteLength": len(one.bytes)}, {"byteLength": 10**4}]
    files = [one.glb({})]
    try:
        import DracoPy
    except ImportError:
        return files
    one = Gltf(extensionsRequired=["KHR_draco_mesh_compression"])
    data = DracoPy.encode(points.astype("f4"), TRIANGLES.astype("u4"), quantization_bits=16)
    view = one.view(data)
    points_at = one.entry("accessors", count=12, componentType=5126, type="VEC3")
    corners_at = one.entry("accessors", count=TRIANGLES.size, componentType=5125, type="SCALAR")
    extension = {"bufferView": view, "attributes": {"POSITION": 0}}
    primitive = {
        "attributes": {"POSITION": points_at},
        "indices": corners_at,
        "extensions": {"KHR_draco_mesh_compression": extension},
    }
    one.entry("meshes", primitives=[primitive])
    return [*files, one.glb({})]


def _gltf() -> list[bytes]:
    """Give the first GLB files as JSON, their buffers in it."""
    files = []
    for data in _glb()[:4]:
        size = int.from_bytes(data[12:16], "little")
        content = json.loads(data[20 : 20 + size])
        buffer = base64.b64encode(data[28 + size :]).decode()
        content["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{buffer}"
        files.append(json.dumps(content, indent=1).encode())
    return files


MAKERS = {
    "obj": _obj,
    "mtl": _mtl,
    "ply": _ply,
    "stl": _stl,
    "off": _off,
    "glb": _glb,
    "gltf": _gltf,
}
