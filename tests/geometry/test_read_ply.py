"""What PLY files hold beside positions and faces, and the odd ways to write them."""

import struct

import numpy as np
import pytest
from mesh_files import LINEAR, POINTS, SQUARE, corners, read
from PIL import Image


def ply(header, body, form="ascii"):
    head = "\n".join(["ply", f"format {form} 1.0", *header, "end_header\n"]).encode()
    return head + (body.encode() if isinstance(body, str) else body)


VERTEX = ["element vertex 4", *(f"property float {c}" for c in "xyz")]
FACE = ["element face 1", "property list uchar int vertex_indices"]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_of_any_order_line_end_and_type(tmp_path, form, end):
    order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[form]
    header = [
        "comment format ascii 1.0 end_header element face 9",
        "obj_info anything",
        "of a comment that goes on",
        "element camera 1",
        *["property list ushort short view", "property double f"],
        "element vertex 4",
        *["property double x", "property uchar red", "property short y", "property uchar green"],
        *["property float z", "property uchar blue", "property uchar alpha"],
        "element face 3",
        *["property uchar flags", "property list ushort uint vertex_index", "property float area"],
    ]
    rows = [("Hhhhd", (3, -1, -2, -3, 0.5))]
    rows += [("dBhBfBB", (x, 51, y, 128, z, 255, 255 * y)) for x, y, z in SQUARE]
    sizes = (3, 4, 3)
    rows += [(f"BH{n}If", (7, n, *range(n), 0.5)) for n in sizes]
    if order:
        body = b"".join(struct.pack(order + kinds, *values) for kinds, values in rows)
    else:
        body = "".join(" ".join(map(str, values)) + end for _, values in rows)
    head = end.join(["ply", f"format {form} 1.0", *header, "end_header", ""]).encode()
    mesh, said = read(tmp_path / "a.ply", head + (body if order else body.encode()))
    assert said == (
        "1 lines of the header ignored, properties of faces ignored (flags area), 1 elements "
        "'camera' ignored, 2 duplicate faces dropped"
    )
    np.testing.assert_array_equal(mesh.vertices, SQUARE)
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    known = [LINEAR[51], LINEAR[128], 1]
    np.testing.assert_allclose(mesh.colors, [[*known, y] for _, y, _ in SQUARE], rtol=0, atol=1e-8)


def test_ply_what_is_too_much_is_left_out_and_said(tmp_path):
    mesh, said = read(tmp_path / "a.ply", ply([*VERTEX, *FACE], POINTS + "3 0 1 2 3\n"))
    assert said == "further values of 1 rows of 'face' ignored, 1 unreferenced vertices dropped"
    assert mesh.faces.shape == (1, 3)


def test_ply_strips(tmp_path):
    header = [*VERTEX, "element tristrips 2", "property list int int vertex_indices"]
    mesh, said = read(tmp_path / "a.ply", ply(header, POINTS + "4 0 1 3 2\n6 2 1 0 -1 0 0\n"))
    assert said == ""
    assert mesh.faces.tolist() == [[0, 1, 3], [3, 1, 2], [2, 1, 0]]


def test_ply_normals_uv_per_corner_and_texture(tmp_path):
    Image.fromarray(np.full((2, 2, 3), 9, np.uint8)).save(tmp_path / "a.png")
    header = [
        *["comment TextureFile a.png", "comment TextureFile b.png", *VERTEX],
        *[f"property float n{c}" for c in "xyz"],
        "element face 2",
        "property list uchar int vertex_indices",
        *["property list uchar float texcoord", "property int texnumber"],
    ]
    points = "".join(f"{x} {y} {z} 0 {-2 * x} 2\n" for x, y, z in SQUARE)
    mesh, said = read(
        tmp_path / "a.ply",
        ply(header, points + "3 0 1 2 6 0 0 1 0 1 1 1\n3 0 2 3 6 .5 0 1 1 0 1 0\n"),
    )
    assert said == "the picture 'b.png' is not there"
    assert mesh.face_material.tolist() == [1, 0]
    np.testing.assert_array_equal(mesh.materials[0].texture, np.full((2, 2, 4), [9, 9, 9, 255]))
    np.testing.assert_array_equal(
        corners(mesh, "uv"), [[[0, 0], [1, 0], [1, 1]], [[0.5, 0], [1, 1], [0, 1]]]
    )
    assert mesh.vertices.shape == (5, 3)  # the corner at the origin twice
    half = np.sqrt(0.5)
    np.testing.assert_allclose(
        corners(mesh, "normals")[0], [[0, 0, 1], *[[0, -half, half]] * 2], rtol=0, atol=1e-7
    )


@pytest.mark.parametrize(
    ("header", "body", "message"),
    [
        ([*VERTEX, *FACE], POINTS + "5 0 1 2 3\n", r"row 0 of its element 'face' has 5 values"),
        (
            [*VERTEX, *FACE],
            POINTS + "3 0 1 9\n",
            r"polygon 0 names vertex 9, but vertices are 0 to 3",
        ),
        ([*VERTEX, *FACE], POINTS + "3 0 1 x\n", r"line 5: 'x' is no number"),
        ([*VERTEX, *FACE], POINTS, r"it announces 5 lines of data, but has 4"),
        (["element vertex 1", "property float x"], "0\n", r"no vertices with x, y and z"),
        (["element vertex many"], "", r"its header has the line 'element vertex many'"),
        (["element vertex 1", "property float128 x"], "", r"the line 'property float128 x'"),
        ([*VERTEX], POINTS, r"it holds no faces"),
    ],
)
def test_ply_damage_is_named(tmp_path, header, body, message):
    with pytest.raises(ValueError, match=rf"a\.ply: .*{message}"):
        read(tmp_path / "a.ply", ply(header, body))
