"""Written mesh files, read by packages that have nothing of ours in them."""

import io
import json
import re
import struct

import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from PIL import Image
from written_meshes import COUNT, FORMATS, by_material, full_mesh, to_y_up, written

from jaxsh.geometry import Mesh, write_mesh


@pytest.fixture
def full(rng):
    return full_mesh(rng)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # trimesh's own, at seams
@pytest.mark.parametrize("suffix", FORMATS)
def test_trimesh_reads_the_same_triangles(tmp_path, full, suffix):
    path = tmp_path / f"full{suffix}"
    written(path, full)
    loaded = trimesh.load(path, process=False, maintain_order=True)
    parts = loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded]
    triangles = np.concatenate([np.asarray(part.vertices)[part.faces] for part in parts])
    vertices = np.asarray(full.vertices)
    if suffix == ".glb":
        vertices = to_y_up(vertices)
    # It groups an OBJ's faces by material in an order of its own.
    expected = vertices[by_material(full, {".glb": [1, -1, 0]}.get(suffix, []))]
    triangles = triangles.astype(np.float32)
    if suffix == ".obj":
        triangles, expected = (np.sort(one.reshape(7, 9), axis=0) for one in (triangles, expected))
    np.testing.assert_array_equal(triangles, expected)


def ply(path):
    """Read a PLY by what its header says, NumPy alone."""
    header, body = path.read_bytes().split(b"end_header\n")
    kinds = {"float": "<f4", "double": "<f8", "uchar": "u1"}
    fields = [
        (name, kinds[kind]) for kind, name in re.findall(r"property (\w+) (\w+)\n", header.decode())
    ]
    rows = np.frombuffer(body, fields, COUNT)
    return {name: rows[name] for name, _ in fields}


def test_ply_holds_each_number_to_the_bit(tmp_path, full):
    path = tmp_path / "full.ply"
    assert written(path, full) == f"{path}: left out, as .ply has none: materials"
    rows = ply(path)
    for names, array in [("x y z", full.vertices), ("nx ny nz", full.normals), ("s t", full.uv)]:
        stored = np.stack([rows[name] for name in names.split()], axis=1)
        assert stored.dtype == np.float32
        np.testing.assert_array_equal(stored, array)
    # Random colors are in no byte: sRGB by its definition, in floats; alpha as it is.
    red, alpha = np.asarray(full.colors, np.float64)[:, [0, 3]].T
    encoded = np.where(red <= 0.0031308, 12.92 * red, 1.055 * red ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(rows["red"], encoded, rtol=0, atol=6e-8)
    np.testing.assert_array_equal(rows["alpha"], alpha.astype(np.float32))


def test_ply_colors_that_came_from_bytes_go_back_into_them(tmp_path, full, rng):
    codes = rng.integers(0, 256, (COUNT, 4), "u1")
    codes[:3] = [[0, 1, 2, 3], [9, 10, 11, 12], [253, 254, 255, 255]]  # both branches of sRGB
    value = codes / 255
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    linear[:, 3] = value[:, 3]
    mesh = Mesh(full.vertices, full.faces, full.normals, colors=jnp.asarray(linear, jnp.float32))
    path = tmp_path / "bytes.ply"
    assert written(path, mesh) == ""
    rows = ply(path)
    stored = np.stack([rows[name] for name in ("red", "green", "blue", "alpha")], axis=1)
    assert stored.dtype == np.uint8
    np.testing.assert_array_equal(stored, codes)


def test_obj_holds_nine_digits_and_shares_positions(tmp_path, full):
    path = tmp_path / "full.obj"
    same = full.colors.at[7].set(full.colors[2])
    full = Mesh(full.vertices, full.faces, full.normals, full.uv, same, None, ())
    assert written(path, full) == f"{path}: left out, as .obj has none: alpha of colors"
    lines = [line.split() for line in path.read_text().splitlines()]
    rows = {key: [line[1:] for line in lines if line[0] == key] for key in ("v", "vt", "vn", "f")}
    assert [len(rows[key]) for key in ("v", "vt", "vn")] == [COUNT - 1, COUNT, COUNT]
    corners = np.array([[word.split("/") for word in face] for face in rows["f"]], int) - 1
    faces = np.asarray(full.faces)
    for key, place, array in [("v", 0, full.vertices), ("vt", 1, full.uv), ("vn", 2, full.normals)]:
        values = np.array(rows[key], float)[:, : array.shape[1]].astype(np.float32)
        np.testing.assert_array_equal(values[corners[..., place]], np.asarray(array)[faces])


def test_obj_materials(tmp_path, full):
    path = tmp_path / "full.obj"
    assert "alpha of colors, double-sided materials" in written(path, full)
    names = re.findall(r"^(?:usemtl (\S+)|f )", path.read_text(), re.M)
    assert names == ["", "", "red_brick_1", "", "", "red_brick", "", "", "red_brick_1", ""]
    assert path.with_suffix(".mtl").read_text() == (
        "newmtl red_brick\nKd 0.5 0.25 0.125\nd 1\nmap_Kd full_0.png\n"
        "newmtl red_brick_1\nKd 1 0.1 0\nd 0.5\n"
    )
    with Image.open(tmp_path / "full_0.png") as picture:
        np.testing.assert_array_equal(picture, full.materials[0].texture)
    assert {file.name for file in tmp_path.iterdir()} == {"full.obj", "full.mtl", "full_0.png"}


def glb(path):
    """Take a GLB apart: its JSON, and each accessor as an array."""
    data = path.read_bytes()
    magic, version, size, length, kind = struct.unpack("<4sIII4s", data[:20])
    assert (magic, version, size, kind) == (b"glTF", 2, len(data), b"JSON")
    content = json.loads(data[20 : 20 + length])
    body = data[28 + length :]
    assert len(body) == content["buffers"][0]["byteLength"]
    parts = [
        body[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        for view in content["bufferViews"]
    ]
    widths = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
    arrays = [
        np.frombuffer(parts[one["bufferView"]], {5126: "<f4", 5125: "<u4"}[one["componentType"]])
        .reshape(one["count"], widths[one["type"]])
        for one in content["accessors"]
    ]  # fmt: skip
    return content, arrays, parts


def test_glb_holds_each_number_to_the_bit(tmp_path, full):
    path = tmp_path / "full.glb"
    assert written(path, full) == ""
    content, arrays, parts = glb(path)
    primitives = content["meshes"][0]["primitives"]
    assert [one.get("material") for one in primitives] == [1, None, 0]
    faces = np.concatenate([arrays[one["indices"]].reshape(-1, 3) for one in primitives])
    np.testing.assert_array_equal(faces, by_material(full, [1, -1, 0]))
    at = primitives[0]["attributes"]
    np.testing.assert_array_equal(arrays[at["POSITION"]], to_y_up(np.asarray(full.vertices)))
    np.testing.assert_array_equal(arrays[at["NORMAL"]], to_y_up(np.asarray(full.normals)))
    np.testing.assert_array_equal(arrays[at["COLOR_0"]], full.colors)
    np.testing.assert_array_equal(arrays[at["TEXCOORD_0"]][:, 0], full.uv[:, 0])
    np.testing.assert_allclose(
        1 - arrays[at["TEXCOORD_0"]][:, 1].astype(float), full.uv[:, 1], rtol=0, atol=3e-8
    )
    bounds = content["accessors"][at["POSITION"]]
    np.testing.assert_array_equal(bounds["min"], arrays[at["POSITION"]].min(axis=0))
    np.testing.assert_array_equal(bounds["max"], arrays[at["POSITION"]].max(axis=0))

    brick, other = content["materials"]
    assert brick["pbrMetallicRoughness"]["baseColorFactor"] == [0.5, 0.25, 0.125, 1]
    assert other["doubleSided"]
    assert other["pbrMetallicRoughness"] == {
        "baseColorFactor": [1, 0.1, 0, 0.5],
        "metallicFactor": 0,
    }
    with Image.open(io.BytesIO(parts[content["images"][0]["bufferView"]])) as picture:
        np.testing.assert_array_equal(picture, full.materials[0].texture)


def test_assimp_reads_normals_uv_and_colors(tmp_path, full):
    assimp_py = pytest.importorskip("assimp_py")
    mesh = Mesh(full.vertices, full.faces, full.normals, full.uv, full.colors)
    for suffix in (".ply", ".obj", ".glb"):
        path = tmp_path / f"full{suffix}"
        written(path, mesh)
        (loaded,) = assimp_py.import_file(str(path), assimp_py.Process_Triangulate).meshes
        corners = np.asarray(loaded.indices)
        faces = np.asarray(mesh.faces).reshape(-1)
        turn = to_y_up if suffix == ".glb" else np.asarray
        for theirs, ours in [
            (loaded.vertices, turn(mesh.vertices)),
            (loaded.normals, turn(mesh.normals)),
            (loaded.texcoords[0], mesh.uv),
        ]:
            theirs = np.asarray(theirs).reshape(loaded.num_vertices, -1)[corners]
            ours = np.asarray(ours)[faces]
            np.testing.assert_allclose(theirs[:, : ours.shape[1]], ours, rtol=1e-6, atol=6e-8)


ORIGIN = (4e5 + 1 / 3, 8e5, -1e-3)


def test_origin_is_added_back(tmp_path, full):
    mesh = Mesh(full.vertices, full.faces, full.normals, origin=ORIGIN)
    expected = np.asarray(full.vertices, np.float64) + ORIGIN
    written(tmp_path / "far.ply", mesh)
    rows = ply(tmp_path / "far.ply")
    np.testing.assert_array_equal(np.stack([rows[axis] for axis in "xyz"], axis=1), expected)
    written(tmp_path / "far.glb", mesh)
    content, arrays, _ = glb(tmp_path / "far.glb")
    assert content["nodes"][0]["translation"] == [ORIGIN[0], ORIGIN[2], -ORIGIN[1]]
    np.testing.assert_array_equal(arrays[0], to_y_up(np.asarray(full.vertices)))
    for suffix, skip in ((".obj", 0), (".off", 2)):
        written(tmp_path / f"far{suffix}", mesh)
        lines = (tmp_path / f"far{suffix}").read_text().splitlines()[skip:]
        rows = [line.split()[-3:] for line in lines[: COUNT - (suffix == ".obj")]]
        kept = np.delete(expected, 7, axis=0) if suffix == ".obj" else expected
        np.testing.assert_array_equal(np.array(rows, float), kept)
    with pytest.raises(ValueError, match=r"far\.stl: \.stl has float32 positions, which cannot"):
        write_mesh(tmp_path / "far.stl", mesh)
