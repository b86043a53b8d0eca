"""What OBJ and MTL files hold beside positions and faces, and the odd ways to write them."""

import numpy as np
import pytest
from mesh_files import LINEAR, TRIANGLE, corners, read
from PIL import Image


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
    np.testing.assert_allclose(
        smooth.normals[0], np.array([0, -1, 1]) / np.sqrt(2), rtol=0, atol=1e-7
    )


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


def test_obj_what_points_nowhere_is_left_out_and_said(tmp_path):
    mesh, said = read(tmp_path / "a.obj", TRIANGLE + "vn 0 0 1\nf 1/1/1 2/-1/1 3//9\n")
    assert said == (
        "2 corners name texture coordinates that are not there, 1 corners name normals that are "
        "not there, 1 corners without a normal given a smooth one"
    )
    assert mesh.uv is None
    np.testing.assert_array_equal(mesh.normals, [[0, 0, 1]] * 3)


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
    np.testing.assert_allclose(mesh.colors, [expected, expected, (1, 1, 1, 1)], rtol=0, atol=1e-7)
