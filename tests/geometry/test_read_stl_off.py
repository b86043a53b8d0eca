"""What STL and OFF files hold beside positions and faces, and the odd ways to write them."""

import struct

import numpy as np
import pytest
import shapes
from mesh_files import LINEAR, POINTS, SQUARE, corners, read


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
    np.testing.assert_allclose(mesh.normals, [[0, -0.6, 0.8]] * 4, rtol=0, atol=1e-7)
    np.testing.assert_allclose(
        mesh.colors, [[LINEAR[51], LINEAR[128], 1, 1]] * 4, rtol=0, atol=1e-7
    )
    np.testing.assert_array_equal(mesh.uv, np.array(SQUARE)[:, :2])


def test_off_colors_of_faces_split_vertices(tmp_path):
    mesh, said = read(
        tmp_path / "a.off", f"OFF\n4 3 0\n{POINTS}3 0 1 2 0.2 0 1\n3 0 2 3 0 1 0 0.5\n3 0 1 3\n"
    )
    assert said == ""
    expected = [(LINEAR[51], 0, 1, 1), (0, 1, 0, 0.5), (1, 1, 1, 1)]
    np.testing.assert_allclose(
        corners(mesh, "colors"), np.repeat([[c] for c in expected], 3, axis=1), rtol=0, atol=1e-7
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


def test_off_colors_of_faces_are_bytes_without_a_point(tmp_path):
    text = "OFF\n4 4 0\n" + POINTS + "3 0 1 2 51 0 255 128\n3 0 2 3 0.2 0 1.\n3 1 2 3 1 0 0\n"
    mesh, said = read(tmp_path / "a.off", text + "3 0 1 3\n", colors="linear")
    assert said == ""
    expected = [(0.2, 0, 1, 128 / 255), (0.2, 0, 1, 1), (1 / 255, 0, 0, 1), (1, 1, 1, 1)]
    np.testing.assert_allclose(corners(mesh, "colors")[:, 0], expected, rtol=0, atol=1e-7)
    mesh, said = read(tmp_path / "a.off", text + "3 0 1 3 2.5 0 0\n", colors="linear")
    assert said == "colors from 0 to 2.5 taken as they are"
    np.testing.assert_allclose(corners(mesh, "colors")[-1, 0], (2.5, 0, 0, 1), rtol=0, atol=1e-7)
