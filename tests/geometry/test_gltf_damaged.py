"""glTF files that are damaged, unsafe or beyond what is read: one sentence each, and no memory."""

import base64
import json
import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from gltf_writer import CORNERS, FACES, Gltf

from jaxsh.geometry._files._gltf import read_gltf


def read(data: bytes, folder: Path = Path(".")):
    return read_gltf(folder / "a.gltf", data)


def tetrahedron(**fields) -> Gltf:
    """Accessor 0 holds positions, 1 indices; one node."""
    gltf = Gltf(**fields)
    gltf.mesh()
    gltf.entry("nodes", mesh=0)
    return gltf


def refuses(gltf: Gltf, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read(gltf.glb())


def test_bytes_after_the_end_and_unknown_chunks():
    gltf = tetrahedron()
    polygons = read(gltf.glb(tail=b"\0\0abc"))
    assert len(polygons.sizes) == 4
    assert polygons.found == ("5 bytes after its end ignored",)
    data = gltf.glb() + struct.pack("<2I", 4, 0x12345678) + b"abcd"
    data = data[:8] + struct.pack("<I", len(data)) + data[12:]
    assert read(data).found == ()


@pytest.mark.parametrize("length", [0, 3, 4, 11, 12, 19, 20, 50, 300, 500])
def test_cut_off(length):
    data = tetrahedron().glb()
    assert length < len(data)
    with pytest.raises(ValueError, match=r"begins with|breaks off|announces \d+ bytes, but"):
        read(data[:length])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ((4, 1), "it is glTF 1 in binary form"),
        ((12, 10**6), "chunk 0 announces 1000000 bytes, but"),
        ((16, 7), "its first chunk is not JSON"),
    ],
)
def test_headers(change, message):
    data = bytearray(tetrahedron().glb())
    struct.pack_into("<I", data, *change)
    with pytest.raises(ValueError, match=message):
        read(bytes(data))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"[1]", "JSON should be an object, got a list of 1"),
        (b'{"asset": {"version": "2.0"}, "a": NaN}', "NaN is no number"),
        (b'{"asset": \xff}', "not UTF-8 at byte 10"),
        (b"[" * 10**5, "nested too deeply"),
        (b"{}", "names no version of glTF"),
        (b'{"asset": {"version": "1.0"}}', "glTF '1.0', and only glTF 2"),
        (b'{"asset": {"version": "2.1", "minVersion": "2.1"}}', "asks for glTF '2.1'"),
        (b'{"asset": {"version": 1}}', "glTF '1', and only glTF 2"),
        (b'{"asset": {"version": 2.0}}', "holds no faces .no mesh in its scene"),
        (b"solid a", "begins with b'soli': neither the mark glTF nor JSON"),
        ('{"asset": 1}'.encode("utf-16"), "neither the mark glTF nor JSON"),
        (b'{"asset": {"version": "2.0"}, "meshes": {}}', "a list as 'meshes', got an object of 0"),
    ],
)
def test_json(text, message):
    with pytest.raises(ValueError, match=message):
        read(text)


def test_required_extensions_are_known_or_refused():
    refuses(
        tetrahedron(extensionsRequired=["KHR_mesh_quantization", "ACME_b", "ACME_a"]),
        "it requires 'ACME_a', 'ACME_b', which cannot be read here",
    )
    polygons = read(tetrahedron(extensionsUsed=["ACME_a"], extensions={"ACME_a": {}}).glb())
    assert len(polygons.sizes) == 4


def test_views_past_their_buffers_are_said_with_numbers():
    gltf = tetrahedron()
    gltf.json["bufferViews"][0]["byteLength"] = 10**12
    refuses(gltf, "bufferView 0 needs bytes 0 to 1000000000000 of buffer 0, which has 72")
    gltf = tetrahedron()
    gltf.json["accessors"][0]["count"] = 2**40
    refuses(gltf, r"accessor 0 needs 13194139533312 bytes of bufferView 0, which has 48")
    gltf = tetrahedron(buffers=[{"byteLength": 100}])
    refuses(gltf, "buffer 0 should have 100 bytes, but 72 are there")
    gltf = tetrahedron()
    gltf.json["bufferViews"][0]["byteStride"] = 8
    refuses(gltf, "elements of 12 bytes, but the stride of bufferView 0 is 8")


@pytest.mark.parametrize(
    ("where", "change", "message"),
    [
        ("accessors", {"componentType": 5130}, "components of type 5130"),
        ("accessors", {"type": "VEC2"}, "POSITION of primitive 0 of mesh 0 should be VEC3"),
        ("accessors", {"count": -1}, "a whole number as 'count', got -1"),
        ("accessors", {"count": True}, "got True"),
        ("accessors", {"count": 4.5}, "got 4.5"),
        ("accessors", {"bufferView": 9}, "accessor 0 names bufferViews 9, but the file has 2"),
        ("accessors", {"normalized": 1}, "true or false as 'normalized', got 1"),
        ("meshes", {"primitives": [3]}, "primitive 0 of mesh 0 should be an object, got 3"),
        ("meshes", {"weights": "a"}, "numbers as 'weights', got 'a'"),
        ("nodes", {"mesh": 1}, "node 0 names meshes 1, but the file has 1"),
        ("nodes", {"translation": [1, 2]}, "3 numbers as 'translation', got a list of 2"),
        ("nodes", {"translation": [1, 2, 10**400]}, "finite numbers"),
        ("nodes", {"rotation": [0, 0, 0, 0]}, "node 0 has a rotation of length 0.0"),
        ("nodes", {"matrix": [1.0] * 16}, "last row is not 0, 0, 0, 1"),
        ("nodes", {"children": [0]}, "nested in a circle"),
        ("nodes", {"children": [4]}, "node 0 names node 4, but there are 1"),
        ("nodes", {"skin": 0}, "node 0 names skins 0, but the file has 0"),
    ],
)
def test_wrong_values(where, change, message):
    gltf = tetrahedron()
    gltf.json[where][0].update(change)
    refuses(gltf, message)


@pytest.mark.parametrize(
    ("primitive", "indices", "message"),
    [
        ({}, [0, 1, 4], "indices of primitive 0 of mesh 0 name vertex 4, but there are 4"),
        ({}, [0, 1, 65535], "hold 65535, which restarts a primitive"),
        ({"mode": 5}, [0, 1, 2, 65535], "hold 65535, which restarts a primitive"),
        ({}, [0, 1, 2, 3], "has 4 corners, not three for each triangle"),
        ({"mode": 7}, [0, 1, 2], "mode 7"),
        ({"material": 0}, [0, 1, 2], "names materials 0, but the file has 0"),
        ({"targets": [{}]}, [0, 1, 2], "1 morph targets, but 2 weights"),
    ],
)
def test_wrong_primitives(primitive, indices, message):
    gltf = Gltf()
    gltf.mesh(faces=np.uint16(indices), **primitive)
    with pytest.raises(ValueError, match=message):
        read(gltf.glb({"weights": [0, 0]}))


def test_the_largest_index_may_name_a_vertex_of_a_list():
    gltf = Gltf()
    gltf.mesh(np.float32(np.eye(3).repeat(90, axis=0)), np.uint8([0, 100, 255]))
    np.testing.assert_array_equal(read(gltf.glb({})).positions, np.eye(3))


def test_attributes_of_other_lengths():
    gltf = Gltf()
    gltf.mesh(attributes={"NORMAL": gltf.add(np.float32(CORNERS[:3]))})
    gltf.entry("nodes", mesh=0)
    refuses(gltf, "NORMAL of primitive 0 of mesh 0 has 3 elements for 4 positions")
    gltf = Gltf()
    gltf.mesh(targets=[{"POSITION": gltf.add(np.float32(CORNERS[:3]))}])
    gltf.entry("nodes", mesh=0, weights=[1])
    refuses(gltf, "POSITION of morph target 0 of primitive 0 of mesh 0 has 3 elements")


def test_nodes_are_trees():
    gltf = tetrahedron()
    gltf.json["nodes"] = [{"children": [1, 2]}, {"children": [3]}, {"children": [3]}, {"mesh": 0}]
    refuses(gltf, "node 3 is a child of both 1 and 2")
    gltf.json["nodes"] = [{"mesh": 0}, {"children": [2]}, {"children": [1]}]
    refuses(gltf, "nested in a circle")
    gltf.json["nodes"] = [{"children": [1]}, {"mesh": 0}]
    gltf.json["scenes"] = [{"nodes": [1]}]
    refuses(gltf, "scene 0 names node 1, which is a child of another")
    # A chain as deep as this is none of Python's business.
    gltf = tetrahedron()
    gltf.json["nodes"] = [{"children": [i + 1]} for i in range(1500)] + [{"mesh": 0}]
    assert len(read(gltf.glb()).sizes) == 4


def test_skins_are_checked():
    def skin(joint: int, weight: float) -> Gltf:
        gltf = Gltf(skins=[{"joints": [1]}])
        attributes = {
            "JOINTS_0": gltf.add(np.uint8([[0, joint, 0, 0]] * 4)),
            "WEIGHTS_0": gltf.add(np.float32([[1, weight, 0, 0]] * 4)),
        }
        gltf.mesh(attributes=attributes)
        gltf.json["nodes"] = [{"mesh": 0, "skin": 0}, {}]
        return gltf

    refuses(skin(3, 0.5), "follows joint 3 of the skin of node 0, which has 1")
    np.testing.assert_array_equal(read(skin(3, 0).glb()).positions, CORNERS)
    gltf = skin(0, 0)
    gltf.json["skins"][0]["joints"] = [7]
    refuses(gltf, "skin 0 names node 7, but there are 2")
    gltf = skin(0, 0)
    gltf.json["skins"][0]["inverseBindMatrices"] = 0
    refuses(gltf, "inverseBindMatrices of skin 0 should be MAT4")


def test_instances_are_checked():
    gltf = tetrahedron()
    attributes = {
        "TRANSLATION": gltf.add(np.float32([[1, 2, 3]] * 2)),
        "SCALE": gltf.add(np.float32([[1, 2, 3]] * 3)),
    }
    gltf.json["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    refuses(gltf, r"attributes of one length, got \[2, 3\]")


def many_instances() -> Gltf:
    gltf = tetrahedron()
    million = gltf.entry("accessors", componentType=5126, type="VEC3", count=10**6)
    gltf.json["nodes"][0]["extensions"] = {
        "EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": million}}
    }
    return gltf


def many_zeros(count: int, indexed: bool) -> Gltf:
    gltf = tetrahedron()
    del gltf.json["accessors"][0]["bufferView"]
    gltf.json["accessors"][0]["count"] = count
    if not indexed:
        del gltf.json["meshes"][0]["primitives"][0]["indices"]
    return gltf


def many_primitives() -> Gltf:
    gltf = Gltf()
    gltf.mesh(faces=np.zeros(30000, np.uint8))
    gltf.json["meshes"][0]["primitives"] *= 500
    gltf.entry("nodes", mesh=0)
    return gltf


@pytest.mark.parametrize(
    "gltf",
    [many_instances(), many_zeros(10**12, True), many_zeros(10**6, False), many_primitives()],
    ids=["instances", "zeros", "unindexed zeros", "primitives"],
)
def test_few_bytes_cannot_ask_for_much_memory(gltf):
    data = gltf.glb()
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match=r"out of proportion|has 1000000 corners"):
            read(data)
        assert tracemalloc.get_traced_memory()[1] < 2e8 + 10 * len(data)
    finally:
        tracemalloc.stop()


def beside(tmp_path: Path, uri: str) -> Gltf:
    gltf = tetrahedron()
    gltf.json["buffers"] = [{"byteLength": len(gltf.bytes), "uri": uri}]
    return gltf


@pytest.mark.parametrize(
    ("uri", "name"),
    [
        ("a.bin", "a.bin"),
        ("a%20b%C3%A9.bin", "a bé.bin"),
        ("sub/../sub/./a.bin", "sub/a.bin"),
        ("sub\\a.bin", "sub/a.bin"),
    ],
)
@pytest.mark.parametrize("head", [b"", b"\xef\xbb\xbf"])
def test_buffers_in_files_of_their_own(tmp_path, uri, name, head):
    gltf = beside(tmp_path, uri)
    (tmp_path / "sub").mkdir()
    (tmp_path / name).write_bytes(gltf.bytes)
    polygons = read(head + json.dumps(gltf.json).encode(), tmp_path)
    np.testing.assert_array_equal(polygons.positions[polygons.corners], CORNERS[FACES.ravel()])


@pytest.mark.parametrize(
    "uri",
    [
        *("../a.bin", "sub/../../a.bin", "%2e%2e/a.bin", "/etc/hostname", "..\\a.bin", "c:\\a.bin"),
        *("http://example.org/a.bin", "file:///etc/hostname", "..", "", "//host/a.bin"),
    ],
)
def test_buffers_outside_the_folder_are_refused(tmp_path, uri):
    (tmp_path / "a.bin").write_bytes(bytes(1000))
    (tmp_path / "sub").mkdir()
    text = json.dumps(beside(tmp_path, uri).json).encode()
    with pytest.raises(ValueError, match="only files in the folder of the glTF file or below"):
        read(text, tmp_path / "sub")


@pytest.mark.parametrize("uri", ["none.bin", "a\0b", "\ud800", "x" * 5000, "sub"])
def test_buffers_that_are_not_there(tmp_path, uri):
    (tmp_path / "sub").mkdir()
    text = json.dumps(beside(tmp_path, uri).json).encode()
    with pytest.raises(ValueError, match=r"buffer 0 (is in .* not there|cannot be read from)"):
        read(text, tmp_path)


@pytest.mark.parametrize(
    "head", ["data:application/octet-stream;base64,", "DATA:;BASE64,", "data:x/y;a=b;base64,"]
)
def test_buffers_in_the_json(head):
    gltf = tetrahedron()
    body = base64.b64encode(gltf.bytes).decode()
    for form in (body, body.rstrip("="), body.replace("+", "%2B"), body[:8] + "\n" + body[8:]):
        gltf.json["buffers"] = [{"byteLength": len(gltf.bytes), "uri": head + form}]
        assert len(read(json.dumps(gltf.json).encode()).sizes) == 4
    gltf.json["buffers"][0]["uri"] = head + "####"
    with pytest.raises(ValueError, match="buffer 0 has a damaged data URI"):
        read(json.dumps(gltf.json).encode())


def test_buffers_without_bytes():
    gltf = tetrahedron()
    gltf.entry("buffers", byteLength=72)
    with pytest.raises(ValueError, match="needs buffer 0, which has neither a uri nor a binary"):
        read(json.dumps(gltf.json).encode())


def test_many_references_to_one_thing_do_not_take_long():
    # Each node would read its mesh, skin or targets anew.
    for skin, target, primitive in ((5000, 1, 1), (1, 5000, 1), (1, 1, 3000)):
        gltf = Gltf(skins=[{"joints": [0] * skin}])
        gltf.mesh(targets=[{}] * target)
        gltf.json["meshes"][0]["primitives"] += [{"mode": 0, "attributes": {}}] * primitive
        gltf.json["nodes"] = [{"mesh": 0, "skin": 0}] * 100
        refuses(gltf, "out of proportion")


def test_compressed_bytes_are_not_packed_twice():
    gltf = tetrahedron()
    packed = gltf.json["bufferViews"].pop(gltf.view(b"\xa0" + bytes(800)))  # 4096 times 0, 0, 0
    packed.update(byteStride=12, count=4096, mode="ATTRIBUTES")
    for copy in range(20):
        view = gltf.entry("bufferViews", extensions={"EXT_meshopt_compression": packed})
        about = {"componentType": 5126, "type": "VEC3", "count": 4096}
        gltf.mesh(gltf.entry("accessors", bufferView=view, **about))
        if copy == 0:
            gltf.json["nodes"][0]["mesh"] = 1
            assert len(read(gltf.glb()).sizes) == 4
            del gltf.json["buffers"]  # which grow
        gltf.entry("nodes", mesh=copy + 1)
    refuses(gltf, "packs bytes that another bufferView packs as well")


def test_a_skin_has_no_instances():
    gltf = Gltf(skins=[{"joints": [0]}])
    gltf.mesh()
    copies = {"attributes": {"TRANSLATION": gltf.add(np.float32([[1, 2, 3]]))}}
    gltf.entry("nodes", mesh=0, skin=0, extensions={"EXT_mesh_gpu_instancing": copies})
    refuses(gltf, "node 0 has both a skin and EXT_mesh_gpu_instancing")
