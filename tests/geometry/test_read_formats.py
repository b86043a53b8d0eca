"""What files of each format hold beside positions and faces, and the odd ways to write them."""

import re
import struct
import warnings

import numpy as np
import pytest
import shapes
import trimesh
from PIL import Image

from jaxsh.geometry import read_mesh

SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
LINEAR = {0: 0.0, 51: 0.033104767, 128: 0.21586050, 255: 1.0}  # IEC 61966-2-1


def read(path, data, **options):
    """Read bytes or text with a warning or none, and give it without the file's name."""
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    with warnings.catch_warnings(record=True) as record:
        warnings.simplefilter("always")
        mesh = read_mesh(path, **options)
    assert len(record) <= 1
    said = [str(one.message).removeprefix(f"{path}: ") for one in record]
    return mesh, said[0] if said else ""


def corners(mesh, what="vertices"):
    return np.asarray(getattr(mesh, what))[np.asarray(mesh.faces)]


def ply(header, body, form="ascii"):
    head = "\n".join(["ply", f"format {form} 1.0", *header, "end_header\n"]).encode()
    return head + (body.encode() if isinstance(body, str) else body)


VERTEX = ["element vertex 4", *(f"property float {c}" for c in "xyz")]
FACE = ["element face 1", "property list uchar int vertex_indices"]
POINTS = "".join(f"{x} {y} {z}\n" for x, y, z in SQUARE)


# -- OBJ


def test_obj_corners_differ_in_normal_and_uv_and_share_what_they_can(tmp_path):
    text = (
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\n"
        "vt 0 0\nvt 1 0 0\nvt .5\nvn 0 0 2\nvn 0 -3 0\n"
        "f 1/1/1 2/2/1 3/3/1 4/1/1\nf 1//2 2//2 5//2\n"
    )
    mesh, said = read(tmp_path / "a.obj", text)
    assert said == ""
    assert mesh.vertices.shape == (7, 3)  # the edge 1-2 twice
    np.testing.assert_array_equal(corners(mesh, "normals")[0], [[0, 0, 1]] * 3)
    np.testing.assert_array_equal(corners(mesh, "normals")[-1], [[0, -1, 0]] * 3)
    np.testing.assert_array_equal(corners(mesh, "uv")[0], [[0, 0], [1, 0], [0.5, 0]])
    smooth, _ = read(
        tmp_path / "a.obj", text.replace("/1/1", "//").replace("/2/1", "//"), normals="smooth"
    )
    np.testing.assert_allclose(smooth.normals[0], np.array([0, -1, 1]) / np.sqrt(2), atol=1e-7)


def test_obj_relative_indices_count_from_where_they_stand(tmp_path):
    text = (
        TRIANGLE
        + "vn 0 0 1\nf -3//-1 -2//-1 -1//-1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nvn 0 0 -1\n"
        + "f -3//-1 -1//-1 -2//-1\n"
    )
    mesh, said = read(tmp_path / "a.obj", text)
    assert said == ""
    np.testing.assert_array_equal(corners(mesh)[:, :, 0], [[0, 1, 0], [5, 5, 6]])
    np.testing.assert_array_equal(corners(mesh, "normals")[:, 0, 2], [1, -1])


@pytest.mark.parametrize(
    "change",
    [
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: ("\ufeff" + text).encode("utf-16-le"),
        lambda text: text.replace("f 1 2 3", "f 1 \\\n 2 \\\r\n3"),
        lambda text: "# a folder C:\\\n" + text.replace("f 1", "f  \t1") + "# no line end",
        lambda text: text.replace("f 1 2 3", "f 1// 2/ 3").encode() + b"# \xff\xfe caf\xe9\n",
    ],
)
def test_obj_of_any_hand_is_the_same(tmp_path, change):
    mesh, said = read(tmp_path / "a.obj", change(TRIANGLE + "f 1 2 3\n"))
    assert said == ""
    np.testing.assert_array_equal(corners(mesh), [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("v 0 0 zero", r"line 4: 'zero' is no number"),
        ("v 0 0-1 0", r"line 4: '0-1' is no number"),
        ("v 0 0,5 0", r"line 4: '0,5' is no number"),
        ("f 1 2 3.0", r"line 4: '3.0' is no corner of a face"),
        ("f 1 2 3/a", r"line 4: '3/a' is no corner"),
        ("f 1 2 3/1/1/1", r"line 4: '3/1/1/1' is no corner"),
        ("f 0 1 2", r"line 4 names v 0, but there are 3"),
        ("f 1 2 99999999999999999999", r"but there are 3"),
        ("v 1 2", r"line 4 has 2 values after 'v'"),
        ("vn 1 2\nf 1//1 2//1 3//1", r"line 4 has 2 values after 'vn'"),
        ("# \\\nv 1 \\\n2", r"line 5 has 2 values after 'v'"),
    ],
)
def test_obj_damage_is_named_with_its_line(tmp_path, line, message):
    with pytest.raises(ValueError, match=rf"a\.obj: damaged or not a \.obj file: .*{message}"):
        read(tmp_path / "a.obj", TRIANGLE + line + "\nf 1 2 3\n")


def test_obj_materials_and_pictures_are_those_beside_the_file(tmp_path):
    picture = np.arange(24, dtype=np.uint8).reshape(2, 3, 4)
    Image.fromarray(picture).save(tmp_path / "brick wall.png")
    (tmp_path / "all of them.mtl").write_text(
        "newmtl red paint\nKd 0.5 0.25 0\nd 0.75\nmap_Bump b.png\n"
        "newmtl wall\nKa 1 1 1\nmap_Kd -s 2 2 -o 0 0 0 -clamp on brick wall.png\nTr 0.25\n"
        "newmtl lost\nmap_Kd C:\\textures\\none.png # gone\n"
    )
    text = (
        "mtllib none.mtl all\\ of\\ them.mtl\n"
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n"
        "usemtl wall\nf 1 3 4\nusemtl red paint # twice\nf 1 2 4\nusemtl lost\nf 2 3 4\n"
        "usemtl nowhere\nf 1 2 5\nusemtl wall\nf 1 3 5\n"
        "s 1\ns off\nl 1 2\np 1\nt crease 2/1/0 1 2 4.7\nv 0 0 0 2\nv 0 0 0 1.0\n"
    )
    mesh, said = read(tmp_path / "a.obj", text)
    assert mesh.face_material.tolist() == [-1, 0, 1, 2, 3, 0]
    wall, red, lost, nowhere = mesh.materials
    assert [m.name for m in mesh.materials] == ["wall", "red paint", "lost", "nowhere"]
    assert red.factor == (0.5, 0.25, 0, 0.75)
    assert wall.factor == (1, 1, 1, 0.75)
    np.testing.assert_array_equal(wall.texture, picture)
    assert red.texture is lost.texture is nowhere.texture is None
    for phrase in (
        r"the picture 'C:\\textures\\none.png' is not there",
        "materials in no file are white (nowhere)",
        "of materials ignored (map_bump map_kd -o map_kd -s)",
        "2 smoothing groups ignored",
        "1 lines ignored",
        "the materials 'none.mtl' are not there",
        "1 points ignored",
        "1 tags of subdivision ignored",
        "weights w of 1 vertices ignored",
    ):
        assert phrase in said


def test_off_colors_of_faces_are_bytes_without_a_point(tmp_path):
    text = "OFF\n4 4 0\n" + POINTS + "3 0 1 2 51 0 255 128\n3 0 2 3 0.2 0 1.\n3 1 2 3 1 0 0\n"
    mesh, said = read(tmp_path / "a.off", text + "3 0 1 3\n", colors="linear")
    assert said == ""
    expected = [(0.2, 0, 1, 128 / 255), (0.2, 0, 1, 1), (1 / 255, 0, 0, 1), (1, 1, 1, 1)]
    np.testing.assert_allclose(corners(mesh, "colors")[:, 0], expected, atol=1e-7)
    mesh, said = read(tmp_path / "a.off", text + "3 0 1 3 2.5 0 0\n", colors="linear")
    assert said == "colors from 0 to 2.5 taken as they are"
    np.testing.assert_allclose(corners(mesh, "colors")[-1, 0], (2.5, 0, 0, 1), atol=1e-7)


@pytest.mark.parametrize(
    ("lines", "factor", "phrase"),
    [
        ("Kd 255 128 0", (255, 128, 0, 1), "Kd '255 128 0' of the material 'a' is over 1"),
        ("Kd -1 0 0", (1, 1, 1, 1), "Kd '-1 0 0' of the material 'a' ignored"),
        ("Kd 0 1e400 0", (1, 1, 1, 1), "Kd '0 1e400 0' of the material 'a' ignored"),
        ("d 255\nTr 0.25", (1, 1, 1, 0.75), "d '255' of the material 'a' ignored"),
        ("Tr -1", (1, 1, 1, 1), "tr '-1' of the material 'a' ignored"),
        ("Kd 0 0 0\nKe 0 2 0\nnorm a.png", (0, 0, 0, 1), "of materials ignored (ke norm)"),
        ("Ke 0 0 0\nPr 0.5", (1, 1, 1, 1), ""),
    ],
)
def test_mtl_numbers_out_of_range(tmp_path, lines, factor, phrase):
    (tmp_path / "a.mtl").write_text(f"newmtl a\n{lines}\n")
    mesh, said = read(tmp_path / "a.obj", f"mtllib a.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\n")
    assert mesh.materials[0].factor == factor
    assert said == phrase


def test_long_names_hide_no_counts(tmp_path):
    libraries = "".join(f"mtllib {name * 150}.mtl\n" for name in "abcdefg")
    _, said = read(tmp_path / "a.obj", f"{libraries}{TRIANGLE}usemtl a\nf 1 2 3\nf 1 1 2\n")
    assert "'{}.mtl' are not there".format("a" * 150) in said
    assert said.endswith(", 5 findings more, 1 degenerate faces dropped")
    assert len(said) < 700


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
@pytest.mark.parametrize("names", [("Müller", "Möller"), ("#1", "#2"), ("a#b", "a#c")])
def test_obj_names_stay_apart(tmp_path, names, encoding):
    one, two = names
    library = f"# lib\n newmtl {one}\nKd 1 0 0 # red\nnewmtl {two} # second\nKd 0 1 0\n#end"
    for place in ("gr\xfcn #1.mtl", "#2.mtl", "c.mtl"):
        (tmp_path / place).write_bytes(library.encode(encoding))
        text = f"mtllib {place}\n{TRIANGLE}v 1 1 0\nusemtl {one} # red\nf 1 2 3\n"
        text += f"usemtl {two}\nf 4 3 2\n"
        mesh, said = read(tmp_path / "a.obj", text.encode(encoding))
        assert said == ""
        assert [(m.name, m.factor[:3]) for m in mesh.materials] == [
            (one, (1, 0, 0)),
            (two, (0, 1, 0)),
        ]
        assert mesh.face_material.tolist() == [0, 1]


@pytest.mark.parametrize("line", ["1.#IND 0 0", "0 -1.#QNAN00 1.#INF # 1.#IND", "0 1.#ind 1.#Inf"])
def test_obj_odd_nan_is_no_comment(tmp_path, line):
    mesh, said = read(tmp_path / "a.obj", f"{TRIANGLE}v {line}\nv 1 1 1.#x\nf 1 2 3\nfo 2 5 3")
    assert said == "1 NaN or infinite vertices dropped"
    assert corners(mesh)[1].tolist() == [[1, 0, 0], [1, 1, 1], [0, 1, 0]]


def test_obj_a_bare_s_is_no_group(tmp_path):
    mesh, said = read(tmp_path / "a.obj", f"s 1\n{TRIANGLE}s\nf 1 2 3\ns")
    assert said == ""
    assert mesh.faces.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize(
    ("values", "encoding", "expected"),
    [
        ("0.2 0 1", None, (LINEAR[51], 0, 1, 1)),
        ("51 0 255", None, (LINEAR[51], 0, 1, 1)),
        ("0.2 0 1", "linear", (0.2, 0, 1, 1)),
        ("2.5 -1 1", "linear", (2.5, 0, 1, 1)),
        ("0.2 0 1 0.5", "srgb", (LINEAR[51], 0, 1, 0.5)),
    ],
)
def test_obj_colors_are_decoded(tmp_path, values, encoding, expected):
    phrase = "colors up to 255 taken for bytes" if "255" in values else ""
    if "2.5" in values:
        phrase = "colors from -1 to 2.5 taken as they are but for negative ones, which become 0"
    text = f"v 0 0 0 {values}\nv 1 0 0 {values}\nv 0 1 0\nf 1 2 3\n"
    mesh, said = read(tmp_path / "a.obj", text, colors=encoding)
    assert said == phrase
    np.testing.assert_allclose(mesh.colors, [expected, expected, (1, 1, 1, 1)], atol=1e-7)


# -- PLY


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
    np.testing.assert_allclose(mesh.colors, [[*known, y] for _, y, _ in SQUARE], atol=1e-8)


def test_what_is_too_much_or_points_nowhere_is_left_out_and_said(tmp_path):
    mesh, said = read(tmp_path / "a.ply", ply([*VERTEX, *FACE], POINTS + "3 0 1 2 3\n"))
    assert said == "further values of 1 rows of 'face' ignored, 1 unreferenced vertices dropped"
    assert mesh.faces.shape == (1, 3)
    mesh, said = read(tmp_path / "a.obj", TRIANGLE + "vn 0 0 1\nf 1/1/1 2/-1/1 3//9\n")
    assert said == (
        "2 corners name texture coordinates that are not there, 1 corners name normals that are "
        "not there, 1 corners without a normal given a smooth one"
    )
    assert mesh.uv is None
    np.testing.assert_array_equal(mesh.normals, [[0, 0, 1]] * 3)


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
        corners(mesh, "normals")[0], [[0, 0, 1], *[[0, -half, half]] * 2], atol=1e-7
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


# -- STL


def text_stl(triangles, normal="0 0 0", name="a"):
    facets = [
        f"facet normal {normal}\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*p) for p in triangle)
        + "endloop\nendfacet\n"
        for triangle in triangles
    ]
    return f"solid {name}\n{''.join(facets)}endsolid {name}\n"


def binary_stl(triangles, header=b"", normal=(0, 0, 0), more=0):
    facets = [struct.pack("<12fH", *normal, *np.ravel(t), more) for t in triangles]
    return header.ljust(80, b" ") + struct.pack("<I", len(facets)) + b"".join(facets)


TETRAHEDRON = shapes.TETRAHEDRON[0][shapes.TETRAHEDRON[1]]


def test_stl_of_any_hand_is_the_same(tmp_path):
    one, two = (
        text_stl(TETRAHEDRON[:1], "-nan(ind) nan 1.#QNAN", ""),
        text_stl(TETRAHEDRON[1:], name="facet"),
    )
    nan = struct.unpack("<f", b"\0\0\xa0\x7f")[0]
    files = {
        "several solids": one + two,
        "upper case, blanks": "\ufeff\n\n" + (one + two).upper().replace("\n", " \r\n\t"),
        "end solid": (one + two).replace("endsolid", "end solid"),
        "binary": binary_stl(TETRAHEDRON),
        "binary named solid": binary_stl(TETRAHEDRON, b"solid facet\n", (nan,) * 3),
    }
    for name, data in files.items():
        mesh, said = read(tmp_path / "a.stl", data)
        assert said == "", name
        np.testing.assert_array_equal(corners(mesh), TETRAHEDRON, err_msg=name)
        assert mesh.vertices.shape == (4, 3)
    data = binary_stl(TETRAHEDRON, b"solid", more=5) + b"\n"
    mesh, said = read(tmp_path / "a.stl", data)
    assert said == "attribute bytes of 4 facets ignored, 1 bytes after the last facet ignored"
    np.testing.assert_array_equal(corners(mesh), TETRAHEDRON)


def test_stl_damage_is_named(tmp_path):
    good = text_stl(TETRAHEDRON)
    for data, message in (
        (good.replace("vertex 0.0", "vertex O.0", 1), "line 4: 'o.0' is no number"),
        (good.replace("endloop", "endlop", 1), "facets are damaged, first that of line 2"),
        (good + text_stl(TETRAHEDRON)[:-20], "breaks off before endsolid"),
        (binary_stl(TETRAHEDRON)[:-1], "4 of them take 284 bytes, but it has 283"),
    ):
        with pytest.raises(ValueError, match=rf"a\.stl: .*{message}"):
            read(tmp_path / "a.stl", data)


# -- OFF


def test_off_of_any_hand_is_the_same(tmp_path):
    points = POINTS
    binary = b"".join(
        [
            *(struct.pack(">3i", 4, 2, 0), np.array(SQUARE, ">f4").tobytes()),
            *(struct.pack(">5i", 3, 0, 1, 2, 0), struct.pack(">6i", 4, 0, 1, 2, 3, 0)),
        ]
    )
    faces = "3 0 1 2\n4 0 1 2 3\n"
    files = {
        "plain": f"OFF\n4 2 0\n{points}{faces}",
        "on one line": f"OFF4 2 0\n{points}{faces}",
        "with comments": f"# made by\nOFF # here\n\n4 2 # two\n{points}\n# faces\r\n{faces}",
        "no header": f"4 2 0\n{points}{faces}",
        "mark and CR": ("\ufeff" + f"OFF\n4 2 5\n{points}{faces}").replace("\n", "\r"),
        "binary": b"OFF BINARY\n" + binary,
    }
    for name, data in files.items():
        mesh, said = read(tmp_path / "a.off", data)
        assert said == "1 duplicate faces dropped", name
        np.testing.assert_array_equal(mesh.vertices, SQUARE, err_msg=name)
        assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]], name


def test_off_normals_colors_and_uv(tmp_path):
    rows = "".join(f"{x} {y} {z} 0 -3 4 51 128 255 255 {x} {y}\n" for x, y, z in SQUARE)
    mesh, said = read(tmp_path / "a.off", f"STCNOFF\n4 1 0\n{rows}4 0 1 2 3 7\n")
    assert said == ("colors up to 255 taken for bytes, indices into a color map at 1 faces ignored")
    np.testing.assert_allclose(mesh.normals, [[0, -0.6, 0.8]] * 4, atol=1e-7)
    np.testing.assert_allclose(mesh.colors, [[LINEAR[51], LINEAR[128], 1, 1]] * 4, atol=1e-7)
    np.testing.assert_array_equal(mesh.uv, np.array(SQUARE)[:, :2])


def test_off_colors_of_faces_split_vertices(tmp_path):
    mesh, said = read(
        tmp_path / "a.off", f"OFF\n4 3 0\n{POINTS}3 0 1 2 0.2 0 1\n3 0 2 3 0 1 0 0.5\n3 0 1 3\n"
    )
    assert said == ""
    expected = [(LINEAR[51], 0, 1, 1), (0, 1, 0, 0.5), (1, 1, 1, 1)]
    np.testing.assert_allclose(
        corners(mesh, "colors"), np.repeat([[c] for c in expected], 3, axis=1), atol=1e-7
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("4OFF\n3 1 0\n", "4OFF has points of other than 3 dimensions"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1\n3 0 1 2\n", "line 5 has 2 values for a vertex"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n", "line 6 announces 4 corners, but has 3"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "polygon 0 names vertex 3"),
        ("OFF\n3000000000 9 0\n0 0 0\n", "announces 3000000010 lines of data, but has 2"),
        ("OFF BINARY\n" + "\x7f" * 40, "announces 2139062143 vertices"),
        ("CNOFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "3 values, too few for its header"),
    ],
)
def test_off_damage_is_named(tmp_path, text, message):
    with pytest.raises(ValueError, match=rf"a\.off: .*{message}"):
        read(tmp_path / "a.off", text)


# -- beside trimesh


def test_trimesh_reads_the_same_triangles(tmp_path, rng):
    """A surface with normals and colors, as trimesh writes and reads it."""
    known = trimesh.Trimesh(*shapes.sphere(5, 7), process=False)
    colors = rng.integers(0, 256, (len(known.vertices), 4)).astype(np.uint8)
    known.visual.vertex_colors = colors
    linear = (colors / 255) ** 2.2
    for name, options in {
        "a.ply": {"vertex_normal": True},
        "b.ply": {"vertex_normal": True, "encoding": "ascii"},
        "a.obj": {"include_normals": True, "include_color": True},
    }.items():
        known.export(tmp_path / name, **options)
        mesh = read_mesh(tmp_path / name)
        np.testing.assert_allclose(corners(mesh), known.triangles, atol=1e-7)
        np.testing.assert_allclose(
            corners(mesh, "normals"), known.vertex_normals[known.faces], atol=1e-6
        )
        # The curve is not quite a power.
        channels = slice(0, 3 if name.endswith("obj") else 4)
        found, expected = corners(mesh, "colors"), linear[known.faces]
        expected[..., 3] = colors[known.faces][..., 3] / 255
        np.testing.assert_allclose(found[..., channels], expected[..., channels], atol=0.01)
    assert re.search("vn", (tmp_path / "a.obj").read_text())
