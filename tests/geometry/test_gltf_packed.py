"""glTF files compressed by Draco and by meshoptimizer, against what was packed."""

import base64
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_writer import CORNERS, FACES, Gltf

from jaxsh.geometry._files._gltf import read_gltf

# A 7 × 7 height field, packed by the encoder of meshoptimizer 1.3.
I, J = (k.ravel() for k in np.meshgrid(np.arange(7), np.arange(7), indexing="ij"))
FLOATS = np.stack([I / 4, J / 4, I * J % 5 / 8], axis=1)
SHORTS = np.stack([I * 1000, J * 999, I * J * 37 % 1009, 0 * I], axis=1)
NORMALS = np.stack([I - 3, J - 3, I * J % 5 - 1.5], axis=1)
NORMALS = NORMALS / np.linalg.norm(NORMALS, axis=1, keepdims=True)
COLORS = np.stack([I / 6, J / 6, I * J % 5 / 4, 0 * I + 1], axis=1)
QUATERNIONS = [[0, 0, 0, 1], [0.5] * 4, [0.6, 0, 0.8, 0], [-0.6, 0, 0, 0.8], [0, -0.28, 0, -0.96]]
K = np.arange(49).reshape(7, 7)[:-1, :-1].ravel()
GRID = np.stack([K, K + 7, K + 1, K + 1, K + 7, K + 8], axis=1).reshape(-1, 3)
FAR = [[0, 1, 2], [40, 30, 20], [2, 1, 3], [48, 47, 46], [40, 30, 25], [25, 30, 24], [5, 40, 6]]
PACKED = {
    "floats 0": (
        "oAAAFQADAAz//wAwAMCAgAMADABAQAEAAwAIfAAAfwD//4CAQECA//+AgEBAgP//gIBAQID//4CAQECA//+A"
        "gEBAgP//gIBAQID//4CAQMAAAABAFTgD4A98fXx9fIA+APh9fH18A+APgH18fXwAAB0AAD8D/4CA//8Af4D/"
        "/3+AAP//f4AAf3/AAAD8//+AgFUAAML/fH18e3yT/J/0e3x7fHt8e34/AAMLe359fH3AAAAAfAAAAAAAAAAA"
        "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"
    ),
    "shorts 0": (
        "oBUAAwAMLy8AMADALy8DAAwALy8VAAMADAYIADAAwAgIAwAMAAgIfwAxMTExMTHTMTExMTEx0zExMTExMdMx"
        "MTExMTHTMTExMTEx0zExMTExMdMxMTExMcAAAAAxagaIiI9oiIj2LS2IiI9oiIj2iC0tiI9oiIj2iIgtLcAA"
        "AAAIfQAA//9KSkpKSkpElJSUlJSUiN7e3t7e3szX19fX19fvjY2NjY1vyUNDQ0MlwAAAAENUCBCIyAOLKLCr"
        "BQUFgAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA="
    ),
    "floats 1": (
        "oQpoahQgEICACARAQAGAQH0BKhABQAUAFABQAUAFACoPwmE//CYT//T+9P70wmE//CYT/8L+9P70YT/8JhP/"
        "wmH+9P70AQADHAD/+AIBB/z4+PoGBAP7+vr7AwQG+vv7/AcBvwADn/j8/PgH/AEA+AAAAAAAAAAAAAAAAAAA"
        "AAAAAAAAAAEyIg=="
    ),
    "shorts 1": (
        "oXChFYBALy8gEC8vCAQvLxWAQAYIIBAICAgECAgAMTExMTEx0zExMTExMdMxMTExMTHTMTExMTEx0zExMTEx"
        "MdMxMTExMTHTMTExMTExKgaIiI9oiIj2LS2IiI9oiIj2iC0tiI9oiIj2iIgtLQEACDwA/0pKSkpKSkSUlJSU"
        "lJSI3t7e3t7ezNfX19fX1++NjY2NjW/JQ0NDQyUBAENoCBCIyAOLKLCrBQUFAQACAAAAAAAAAAAAAAAAAAAA"
        "AAAAAAAAAAAA"
    ),
    "normals 4": (
        "oH8AFx8tLiAYEAUDADZFLgAsEMW2RVaMU1RTAGxrdEUaYhEJZWAaJDg3IxkQCggAMzrAAAAAJz8AEBTIIBQQ"
        "uCJGSC50AI4+WowLfhtYbGv+qlRThnQUSJguT9oOFPoiFA64JDw4KGAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"
        "AAAAAAAAAAC0tH8A"
    ),
    "normals 8": (
        "oXeqAOcNoaIO6PAXAwBMcaIAzhDFtkVWjFNUUwBsaxZzpmJD17WeQg44Nw1B8FLyACHG1y4Fi7hTEQ37ChEE"
        "MS0RFSMVFRUAGxsdEQYYQv9p7pYyEN4ZGAEACQDwYGrCYPCzwEZIohYAE8pajAt+G6dsa/6qVFMFFv5IZmA9"
        "1ZYq+iIqlrNQ3jjYngAuA191P4/78P8yUhESHV0PFiMDHwdqGxs/KhUVXx0EEvv/NfhT+e6fJhRJPlIYAAAA"
        "AAAAAAAAAAAAAAAAAM3szez/HwAAAQA="
    ),
    "exponents": (
        "oAAVAAMzDEAfDzAMMDDAH0AvEAMADAAQEAAFOIMiBMYDCBAgAAB/AEAAIB8QEF9AACAfEBBfICAgHxAQXyAg"
        "IB8QEF8QEBAQEBBfEBAQEBAQXxAQEBAQwAAAABAABTiDIgTGAwgQIAAAbQAAz/8gEA8fCAcgIC8IFxAPMB8w"
        "Lw8YFyAHB3f/AAAACIiPIB8fwAAAAAgABTiDIgTGAwgQIAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAI4AAACO"
        "AAAAjg=="
    ),
    "colors": (
        "obcAKiosKioq50xKSEpTSvZsajVqNWzWjBWKFRWKuKoKDAgMqpYsKioqKirnSkpMSlVKDID/Kj0/Pz/+PWh9"
        "f759vn2qvX69foC96P1APg/8QED91yo/Pz0//gEAPwAqKiwqKiruCgoKCqwI8RUTihWKFdMzajVqajWxVUpM"
        "SExVkywqKioqKu4KCgwKqgoAAAAAAAAAAAAAAAAAAAAAAAAAAAAA/wA="
    ),
    "quaternions": (
        "oAE/wAAAv8BLTAE/wAAALCs3OAE/wAAAv/NLqQE/wAAALAo1GAE8AAAAv8ABPAAAACwrAT4AAAAFBAAAAAAA"
        "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAD/Hw=="
    ),
    "grid": (
        "4f4eAB4AHgAeAB4AHv4eCx4KHgkeCB4HHv8eBx4HHgceBx4HHv8eBx4HHgceBx4HHv8eBx4HHgceBx4HHv8e"
        "Bx4HHgceBx4HHvAO+wL2Cw72Cw72Cw72Cw4AdodWZ3iphmWJaJgBaQAA"
    ),
    "sequence": (
        "0QAcFgAYBBocFgAYBBocFgAYBBocFgAYBBocFgAYBBocFgAYBBYcFgAYBBocFgAYBBocFgAYBBocFgAYBBoc"
        "FgAYBBocFgAYBBYcFgAYBBocFgAYBBocFgAYBBocFgAYBBocFgAYBBocFgAYBBYcFgAYBBocFgAYBBocFgAY"
        "BBocFgAYBBocFgAYBBocFgAYBBYcFgAYBBocFgAYBBocFgAYBBocFgAYBBocFgAYBBocFgAYBBYcFgAYBBoc"
        "FgAYBBocFgAYBBocFgAYBBocFgAYBBocFgAYBAAAAAA="
    ),
    "far": "4fD/QP//Hf//UBMT/zgBAW8LHT8lAgB2h1ZneKmGZYlomAFpAAA=",
}


def packed(gltf: Gltf, name: str, count: int, stride: int, mode: str, **fields: Any) -> int:
    """A bufferView compressed by meshoptimizer; what it says of itself is for other readers."""
    inner = gltf.view(base64.b64decode(PACKED[name]))
    about = {**gltf.json["bufferViews"].pop(inner), "mode": mode, **fields}
    version = "KHR" if base64.b64decode(PACKED[name])[0] == 0xA1 else "EXT"
    fallback = 1  # a buffer without bytes
    return gltf.entry(
        "bufferViews",
        buffer=fallback,
        byteLength=count * stride,
        **({"byteStride": stride} if mode == "ATTRIBUTES" else {}),
        extensions={
            f"{version}_meshopt_compression": {**about, "count": count, "byteStride": stride}
        },
    )


def accessor(gltf: Gltf, view: int, count: int, code: int, kind: str, **fields: Any) -> int:
    return gltf.entry(
        "accessors", bufferView=view, count=count, componentType=code, type=kind, **fields
    )


def read(gltf: Gltf):
    size = len(gltf.bytes)
    gltf.json["buffers"] = [{"byteLength": size}, {"byteLength": 10**6}]
    return read_gltf(Path("a.glb"), gltf.glb({}))


@pytest.mark.parametrize(
    ("name", "stride", "code", "expected", "error", "filter"),
    [
        ("floats 0", 12, 5126, FLOATS, 0, {}),
        ("floats 1", 12, 5126, FLOATS, 0, {}),
        ("shorts 0", 8, 5123, SHORTS[:, :3], 0, {}),
        ("shorts 1", 8, 5123, SHORTS[:, :3], 0, {"filter": "NONE"}),
        ("normals 4", 4, 5120, 127 * NORMALS, 1.9, {"filter": "OCTAHEDRAL"}),
        ("normals 8", 8, 5122, 32767 * NORMALS, 7.1, {"filter": "OCTAHEDRAL"}),
        ("exponents", 12, 5126, FLOATS, 0, {"filter": "EXPONENTIAL"}),
    ],
)
def test_vertices_by_meshoptimizer(name, stride, code, expected, error, filter):
    gltf = Gltf(extensionsRequired=["EXT_meshopt_compression", "KHR_meshopt_compression"])
    view = packed(gltf, name, 49, stride, "ATTRIBUTES", **filter)
    gltf.mesh(accessor(gltf, view, 49, code, "VEC3"), np.uint8(GRID))
    positions = read(gltf).positions
    np.testing.assert_allclose(positions, expected, rtol=0, atol=error)


def test_colors_by_meshoptimizer():
    gltf = Gltf()
    view = packed(gltf, "colors", 49, 4, "ATTRIBUTES", filter="COLOR")
    colors = accessor(gltf, view, 49, 5121, "VEC4", normalized=True)
    gltf.mesh(np.float32(FLOATS), np.uint8(GRID), attributes={"COLOR_0": colors})
    polygons = read(gltf)
    np.testing.assert_allclose(polygons.colors, COLORS[polygons.corners], rtol=0, atol=0.009)


def test_quaternions_by_meshoptimizer():
    gltf = Gltf()
    gltf.mesh()
    view = packed(gltf, "quaternions", 5, 8, "ATTRIBUTES", filter="QUATERNION")
    turns = accessor(gltf, view, 5, 5122, "VEC4", normalized=True)
    extensions = {"EXT_mesh_gpu_instancing": {"attributes": {"ROTATION": turns}}}
    gltf.json["buffers"] = [{"byteLength": len(gltf.bytes)}, {"byteLength": 10**6}]
    got = read_gltf(Path("a.glb"), gltf.glb({"extensions": extensions})).positions
    from scipy.spatial.transform import Rotation

    expected = [Rotation.from_quat(turn).apply(CORNERS) for turn in QUATERNIONS]
    np.testing.assert_allclose(got, np.concatenate(expected), rtol=0, atol=4e-4)


@pytest.mark.parametrize(
    ("name", "mode", "expected"),
    [("grid", "TRIANGLES", GRID), ("far", "TRIANGLES", FAR), ("sequence", "INDICES", GRID)],
)
@pytest.mark.parametrize(("stride", "code"), [(2, 5123), (4, 5125)])
def test_indices_by_meshoptimizer(name, mode, expected, stride, code):
    expected = np.array(expected)
    gltf = Gltf()
    view = packed(gltf, name, expected.size, stride, mode)
    gltf.mesh(np.float32(FLOATS), None, indices=accessor(gltf, view, expected.size, code, "SCALAR"))
    polygons = read(gltf)
    got = polygons.positions[polygons.corners].reshape(-1, 3, 3)
    # A triangle may start at any of its corners.
    start = [
        next(k for k in range(3) if (np.roll(triangle, k, axis=0) == face).all())
        for triangle, face in zip(got, FLOATS[expected], strict=True)
    ]
    assert len(start) == len(expected)


@pytest.mark.parametrize("name", sorted(PACKED))
def test_damaged_bytes_of_meshoptimizer(name):
    mode, stride = "ATTRIBUTES", 12 if "floats" in name or name == "exponents" else 8
    if name in ("grid", "far", "sequence"):
        mode, stride = ("INDICES" if name == "sequence" else "TRIANGLES"), 4
    if name in ("colors", "normals 4"):
        stride = 4
    data = base64.b64decode(PACKED[name])
    sizes = {"quaternions": 5, "far": 21, "grid": 216, "sequence": 216}
    rng = np.random.default_rng(2)
    outcomes = []
    for attempt in range(8):
        broken = bytearray(data)
        if attempt % 2:
            broken = broken[: rng.integers(len(data))] + bytes(attempt % 3)
        else:
            broken[rng.integers(len(data))] = rng.integers(256)
        gltf = Gltf()
        view = packed(gltf, name, sizes.get(name, 49), stride, mode)
        start = gltf.json["bufferViews"][view]["extensions"]
        (about,) = start.values()
        gltf.bytes[:] = broken
        about.update(byteOffset=0, byteLength=len(broken))
        kind = "SCALAR" if mode != "ATTRIBUTES" else "VEC3"
        code = 5125 if kind == "SCALAR" else {4: 5120, 8: 5123, 12: 5126}[stride]
        number = accessor(gltf, view, sizes.get(name, 49), code, kind)
        if kind == "SCALAR":
            gltf.mesh(np.float32(FLOATS), None, indices=number)
        else:
            gltf.mesh(number, np.uint8(FACES))
        try:
            outcomes.append(str(len(read(gltf).sizes)))
        except ValueError as error:
            outcomes.append(str(error))
    # A changed byte may well give other vertices; what breaks off is always seen.
    assert all(re.search(r"^\d+$|meshopt|name vertex|restart", one) for one in outcomes)
    assert all("meshopt" in one for one in outcomes[1::2])


def test_what_meshoptimizer_cannot_have_packed():
    for change, message in [
        ({"count": 10**12}, "out of proportion"),
        ({"byteStride": 6}, "stride of vertices is 6"),
        ({"mode": "OTHER"}, "it has the mode 'OTHER'"),
        ({"filter": "OTHER"}, "the filter 'OTHER'"),
        ({"filter": "QUATERNION"}, "quaternions have 8 bytes"),
        ({"filter": "COLOR"}, "needs 4 or 8 bytes"),
    ]:
        gltf = Gltf()
        view = packed(gltf, "floats 0", 49, 12, "ATTRIBUTES")
        gltf.json["bufferViews"][view]["extensions"]["EXT_meshopt_compression"].update(change)
        gltf.mesh(accessor(gltf, view, 49, 5126, "VEC3"), np.uint8(GRID))
        with pytest.raises(ValueError, match=message):
            read(gltf)


def draco(**changes: Any) -> Gltf:
    """A tetrahedron with normals and colors, packed by Draco."""
    import DracoPy

    rng = np.random.default_rng(3)
    colors = rng.integers(0, 256, (4, 4), np.uint8)
    normals = np.array([[0, 0, 1], [0, 1, 0], [1, 0, 0], [0.6, 0, 0.8]])
    uv = np.array([[0, 0], [1, 0], [0, 1], [0.25, 0.5]])
    data = DracoPy.encode(  # which wants float64
        CORNERS,
        FACES.astype(np.uint32),
        colors=colors,
        normals=normals.astype(float),
        tex_coord=uv.astype(float),
    )
    kinds = {2: "COLOR_0", 0: "POSITION", 1: "NORMAL", 3: "TEXCOORD_0"}
    numbers = {
        kinds[attribute["attribute_type"]]: attribute["unique_id"]
        for attribute in DracoPy.decode(data).attributes
    }
    gltf = Gltf(extensionsRequired=["KHR_draco_mesh_compression"])
    about = {
        "POSITION": {"componentType": 5126, "type": "VEC3"},
        "NORMAL": {"componentType": 5126, "type": "VEC3"},
        "TEXCOORD_0": {"componentType": 5126, "type": "VEC2"},
        "COLOR_0": {"componentType": 5121, "type": "VEC4", "normalized": True},
    }
    attributes = {
        name: gltf.entry("accessors", **{"count": 4, **fields, **changes})
        for name, fields in about.items()
    }
    gltf.entry("accessors", componentType=5123, type="SCALAR", count=12)
    packing = {"bufferView": gltf.view(data), "attributes": numbers}
    extensions = {"KHR_draco_mesh_compression": packing}
    gltf.entry(
        "meshes", primitives=[{"attributes": attributes, "indices": 4, "extensions": extensions}]
    )
    gltf.json["expected"] = [colors.tolist(), normals.tolist(), uv.tolist()]
    return gltf


def test_draco():
    pytest.importorskip("DracoPy")
    gltf = draco()
    polygons = read_gltf(Path("a.glb"), gltf.glb({}))
    colors, normals, uv = map(np.array, gltf.json["expected"])
    found = polygons.positions[polygons.corners]
    # Draco orders vertices and faces as it likes: corners are known by their positions.
    known = np.array([np.abs(CORNERS - corner).sum(axis=1).argmin() for corner in found])
    np.testing.assert_allclose(found, CORNERS[known], rtol=0, atol=1e-7)
    assert {tuple(np.roll(f, -f.argmin())) for f in known.reshape(-1, 3)} == {
        tuple(np.roll(f, -f.argmin())) for f in FACES
    }
    np.testing.assert_allclose(polygons.colors, colors[known] / 255, rtol=0, atol=1e-15)
    np.testing.assert_allclose(polygons.normals, normals[known], rtol=0, atol=1e-7)
    np.testing.assert_allclose(polygons.uv, (uv * [1, -1] + [0, 1])[known], rtol=0, atol=1e-7)


def test_draco_without_positions():
    decode = pytest.importorskip("DracoPy").decode
    gltf = draco()
    (primitive,) = gltf.json["meshes"][0]["primitives"]
    view = primitive["extensions"]["KHR_draco_mesh_compression"]["bufferView"]
    start, size = (gltf.json["bufferViews"][view][key] for key in ("byteOffset", "byteLength"))
    plain = bytes(gltf.bytes[start : start + size])

    def changed(at: int) -> bytes:  # a position, 0, becomes a normal, 1
        return plain[:at] + b"\1" + plain[at + 1 :]

    def has_none(data: bytes) -> bool:
        try:
            return decode(data).points is None
        except Exception:  # which the library raises as it likes
            return False

    at = next(at for at in range(size) if has_none(changed(at)))
    gltf.bytes[start : start + size] = changed(at)
    with pytest.raises(ValueError, match=r"damaged bytes of KHR_draco.*: no attribute is a pos"):
        read_gltf(Path("a.glb"), gltf.glb({}))


def test_draco_is_named_where_it_cannot_be_decoded(monkeypatch):
    pytest.importorskip("DracoPy")
    with pytest.raises(ValueError, match=r"announces 5 vertices, but KHR_draco.* packs 4"):
        read_gltf(Path("a.glb"), draco(count=5).glb({}))
    with pytest.raises(ValueError, match=r"should be 'VEC3', but KHR_draco.* packs 4 components"):
        read_gltf(Path("a.glb"), draco(type="VEC3").glb({}))
    gltf = draco()
    gltf.bytes[30:60] = bytes(30)
    with pytest.raises(ValueError, match=r"damaged bytes of KHR_draco_mesh_compression"):
        read_gltf(Path("a.glb"), gltf.glb({}))
    gltf, plain = draco(), draco()
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    with pytest.raises(
        ValueError,
        match=r"by KHR_draco_mesh_compression, .* DracoPy \(pip install jaxsh\[draco\]\)",
    ):
        read_gltf(Path("a.glb"), gltf.glb({}))
    # Where the file has the plain form as well, that serves.
    primitive = plain.json["meshes"][0]["primitives"][0]
    primitive["attributes"] = {"POSITION": plain.add(CORNERS)}
    primitive["indices"] = plain.add(FACES.ravel())
    polygons = read_gltf(Path("a.glb"), plain.glb({}))
    np.testing.assert_array_equal(polygons.positions, CORNERS)
