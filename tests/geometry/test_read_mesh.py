"""Mesh files: whole ones, odd ones, damaged ones."""

import re
import struct
import warnings

import numpy as np
import pytest
import shapes
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mesh_files import corners

from jaxsh.geometry import read_mesh

FILES = {
    "binary.ply": {"file_type": "ply"},
    "ascii.ply": {"file_type": "ply", "encoding": "ascii"},
    "plain.obj": {"file_type": "obj"},
    "plain.off": {"file_type": "off"},
    "binary.stl": {"file_type": "stl"},
    "ascii.stl": {"file_type": "stl_ascii"},
    "binary.glb": {"file_type": "glb"},
}


def encoded(name: str) -> bytes:
    data = trimesh.Trimesh(*shapes.sphere(5, 7), process=False).export(**FILES[name])
    return data.encode() if isinstance(data, str) else data


@pytest.mark.parametrize("name", FILES)
def test_every_format_gives_the_same_mesh(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(encoded(name))
    mesh = read_mesh(path, up="z")
    vertices, faces = shapes.sphere(5, 7)
    assert mesh.vertices.shape == vertices.shape
    # Text has 8 digits after the point.
    np.testing.assert_allclose(mesh.vertices[mesh.faces], vertices[faces], rtol=0, atol=1e-8)
    if not name.endswith("stl"):  # where vertices are met face by face
        np.testing.assert_array_equal(mesh.faces, faces)
    assert mesh.vertices.dtype == mesh.normals.dtype == np.float32
    assert mesh.faces.dtype == np.int32
    np.testing.assert_array_equal(read_mesh(str(path), up="z").vertices, mesh.vertices)


def test_trimesh_reads_the_same_triangles(tmp_path, rng):
    """A surface with normals and colors, as trimesh writes and reads it."""
    known = trimesh.Trimesh(*shapes.sphere(5, 7), process=False)
    colors = rng.integers(0, 256, (len(known.vertices), 4)).astype(np.uint8)
    known.visual.vertex_colors = colors
    value = colors / 255
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    linear[:, 3] = value[:, 3]
    for name, options in {
        "a.ply": {"vertex_normal": True},
        "b.ply": {"vertex_normal": True, "encoding": "ascii"},
        "a.obj": {"include_normals": True, "include_color": True},
    }.items():
        known.export(tmp_path / name, **options)
        mesh = read_mesh(tmp_path / name)
        np.testing.assert_allclose(corners(mesh), known.triangles, rtol=0, atol=1e-7)
        np.testing.assert_allclose(
            corners(mesh, "normals"), known.vertex_normals[known.faces], rtol=0, atol=1e-6
        )
        channels = slice(0, 3 if name.endswith("obj") else 4)
        found, expected = corners(mesh, "colors"), linear[known.faces]
        np.testing.assert_allclose(found[..., channels], expected[..., channels], rtol=0, atol=1e-7)
    assert re.search("vn", (tmp_path / "a.obj").read_text())


def test_suffix_may_be_upper_case(tmp_path):
    path = tmp_path / "A.PLY"
    path.write_bytes(encoded("binary.ply"))
    assert read_mesh(path).vertices.shape == (30, 3)


def test_up_turns_only_when_asked(tmp_path):
    path = tmp_path / "corner.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\n")
    as_it_is = np.asarray(read_mesh(path).vertices)
    np.testing.assert_array_equal(as_it_is[1:], np.eye(3))
    turned = np.asarray(read_mesh(path, up="y").vertices)
    np.testing.assert_array_equal(turned[1:], [[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    assert np.linalg.det(turned[1:]) == 1  # a rotation, no mirror


def test_obj_with_seams_polygons_groups_and_relative_indices(tmp_path):
    path = tmp_path / "odd.obj"
    path.write_text(
        "# a comment\nmtllib missing.mtl\no one\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 1 1 0 1 0 0\n"
        "v 0 1 0 1 0 0\nvt 0 0\nvt 1 1\nvn 0 0 1\nvn 1 0 0\nusemtl a\n"
        "f 1/1/1 2/2/1 3/1/2 4/2/2\no two\nusemtl b\nv 0 0 1\nf 1//1 \\\n 2//1 -1//2 # end\n"
    )
    with pytest.warns(UserWarning, match="missing") as record:
        mesh = read_mesh(path)
    assert str(record[0].message) == (
        f"{path}: the materials 'missing.mtl' are not there, materials in no file are white (a b)"
    )
    corners = np.asarray(mesh.vertices)[mesh.faces]
    np.testing.assert_array_equal(corners[:, 0], [[0, 0, 0]] * 3)
    np.testing.assert_array_equal(corners[:, 1], [[1, 0, 0], [1, 1, 0], [1, 0, 0]])
    np.testing.assert_array_equal(corners[:, 2], [[1, 1, 0], [0, 1, 0], [0, 0, 1]])
    normals, uv = np.asarray(mesh.normals)[mesh.faces], np.asarray(mesh.uv)[mesh.faces]
    z, x = [0, 0, 1], [1, 0, 0]
    np.testing.assert_array_equal(normals, [[z, z, x], [z, x, x], [z, z, x]])
    np.testing.assert_array_equal(uv[..., 0], [[0, 1, 0], [0, 0, 1], [0, 0, 0]])
    np.testing.assert_array_equal(mesh.colors[:4], [[1, 0, 0, 1]] * 4)
    np.testing.assert_array_equal(mesh.face_material, [0, 0, 1])
    assert [material.name for material in mesh.materials] == ["a", "b"]
    # Two corners of one position, normal and UV are one vertex; in the order of the lines "v".
    assert len(mesh.vertices) == 6


def test_scene_parts_stand_where_the_scene_puts_them(tmp_path):
    part = trimesh.Trimesh(*shapes.TETRAHEDRON, process=False)
    scene = trimesh.Scene()
    scene.add_geometry(part, transform=trimesh.transformations.translation_matrix([0, 0, 5]))
    scene.add_geometry(part, transform=np.diag([-1.0, 1, 1, 1]))  # mirrored: winding turns too
    path = tmp_path / "scene.glb"
    path.write_bytes(scene.export(file_type="glb"))
    mesh = read_mesh(path, up="z")
    corners = np.asarray(mesh.vertices, np.float64)[np.asarray(mesh.faces)]
    assert corners.shape == (8, 3, 3)
    assert corners[..., 2].max() == 6
    assert corners[..., 0].min() == -1
    volumes = np.linalg.det(corners - [0, 0, 0]).reshape(2, 4).sum(axis=1) / 6
    np.testing.assert_allclose(volumes, 1 / 6, rtol=1e-14)


def test_faults_are_counted_with_the_name_of_the_file(tmp_path):
    path = tmp_path / "faults.off"
    path.write_text("OFF\n6 3 0\n0 0 0\n1 0 0\n0 1 0\nnan 0 0\n7 7 7\n0 1 0\n")
    with path.open("a") as file:
        file.write("3 0 1 2\n3 0 1 3\n3 1 2 5\n")
    with pytest.warns(UserWarning, match="dropped") as record:
        mesh = read_mesh(path)
    assert len(record) == 1
    assert str(record[0].message) == (
        f"{path}: 1 NaN or infinite vertices dropped, 1 faces with NaN or infinite vertices "
        "dropped, 1 unreferenced vertices dropped, 1 duplicate vertices merged, 1 degenerate "
        "faces dropped"
    )
    assert mesh.vertices.shape == (3, 3)
    assert mesh.faces.shape == (1, 3)


def test_missing_file(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.ply: there is no such mesh file"):
        read_mesh(tmp_path / "none.ply")


@pytest.mark.parametrize("name", ["a.fbx", "a", "a.gltf.bin"])
def test_unknown_extension(tmp_path, name):
    (tmp_path / name).write_bytes(b"anything")
    with pytest.raises(ValueError, match=r"cannot read .*only \('\.ply', '\.obj'"):
        read_mesh(tmp_path / name)


def test_unknown_up(unchecked, tmp_path):
    with pytest.raises(ValueError, match="up must be one of z, y, got 'x'"):
        read_mesh(tmp_path / "a.ply", up="x")  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "it holds no faces"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "line 4 has 2 values after 'f'"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "line 4 names v -4, but there are 3"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "damaged"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nF 3 2 1\n", "line 5 begins with 'F'"),
        ("a.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "announces 6 lines .* has 5"),
        ("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\n", "breaks off before endsolid"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", "its header is not whole"),
        ("a.glb", "", "it is empty"),
    ],
)
def test_damage_is_named(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=rf"{name}: .*{message}"):
        read_mesh(tmp_path / name)


def test_polygons_cut_off_in_ascii(tmp_path):
    # Half the quads make as many triangles as there were quads announced.
    path = tmp_path / "quads.ply"
    corners = [(x, y, 0) for y in range(3) for x in range(3)]
    quads = [(i, i + 1, i + 4, i + 3) for i in (0, 1, 3, 4)]
    lines = [
        *["ply", "format ascii 1.0", "element vertex 9", "property float x", "property float y"],
        *["property float z", "element face 4", "property list uchar int vertex_indices"],
        "end_header",
        *(" ".join(map(str, corner)) for corner in corners),
        *(" ".join(map(str, (4, *quad))) for quad in quads),
    ]
    path.write_text("\n".join(lines) + "\n")
    assert read_mesh(path).faces.shape == (8, 3)
    path.write_text("\n".join(lines[:-2]) + "\n")
    with pytest.raises(ValueError, match="announces 13 lines of data, but has 11"):
        read_mesh(path)


def test_numbers_that_shift_in_a_text_stl(tmp_path):
    """One number too many and a later one too few keep the count, and would move all between."""
    path = tmp_path / "shift.stl"
    lines = encoded("ascii.stl").decode().splitlines()
    vertices = [i for i, line in enumerate(lines) if line.strip().startswith("vertex")]
    for change in ("append", "prefix"):
        shifted = list(lines)
        shifted[vertices[1]] += " 0.5"
        words = shifted[vertices[7]].split()
        shifted[vertices[7]] = " ".join(
            words[:-1] if change == "append" else [words[0], *words[2:]]
        )
        path.write_text("\n".join(shifted))
        with pytest.raises(
            ValueError, match=r"shift\.stl: .*facets are damaged, first that of line 2"
        ):
            read_mesh(path)


@pytest.mark.parametrize("name", [n for n in FILES if n != "plain.obj"])
def test_no_truncated_file_is_taken_for_a_whole(tmp_path, name):
    data = encoded(name)
    path = tmp_path / name
    # Text may lose blanks at its end, and the last number some digits, and still be whole.
    whole = len(data.rstrip()) - 2 if b"binary" not in name.encode() else len(data)
    for length in range(0, whole, max(1, whole // 60)):
        path.write_bytes(data[:length])
        with pytest.raises(ValueError, match=name):
            read_mesh(path)


def read_or_refuse(path, data):
    """Any bytes end in a mesh that holds together, or in a ValueError that names the file."""
    path.write_bytes(data)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", category=UserWarning, message=str(path))
        try:
            mesh = read_mesh(path)
        except ValueError as error:
            message = str(error)
            mesh = None
    if mesh is None:
        assert str(path) in message
        return
    assert np.isfinite(mesh.vertices).all()
    assert np.isfinite(mesh.normals).all()
    assert 0 <= int(mesh.faces.min()) <= int(mesh.faces.max()) < len(mesh.vertices)


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".off", ".stl", ".glb"])
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=400))
def test_random_bytes_never_crash(tmp_path, suffix, data):
    read_or_refuse(tmp_path / f"random{suffix}", data)


@pytest.mark.parametrize("name", FILES)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    edits=st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.binary(max_size=8)), max_size=4)
)
def test_changed_bytes_never_crash(tmp_path, name, edits):
    data = bytearray(encoded(name))
    for where, new in edits:
        at = int(where * len(data))
        data[at : at + len(new)] = new
    read_or_refuse(tmp_path / name, bytes(data))


def test_huge_announcement_does_not_allocate(tmp_path):
    path = tmp_path / "huge.ply"
    data = encoded("binary.ply").replace(b"vertex 30", b"vertex 3000000000000")
    path.write_bytes(data)
    with pytest.raises(ValueError, match=r"huge\.ply"):
        read_mesh(path)
    path = tmp_path / "huge.stl"
    path.write_bytes(b"\0" * 80 + struct.pack("<I", 2**32 - 1))
    with pytest.raises(ValueError, match=r"huge\.stl"):
        read_mesh(path)
