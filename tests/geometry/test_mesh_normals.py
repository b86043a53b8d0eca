"""Hard edges, file normals, large coordinates, the axis that points up."""

import itertools
import warnings

import numpy as np
import pytest
import shapes
import trimesh

from jaxsh.geometry import make_mesh, read_mesh, topology, vertex_normals

# A cube's corners, its sides counter-clockwise from outside, and their normals.
CORNERS = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
SIDES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
NORMALS = [(0, 0, -1), (0, 0, 1), (0, -1, 0), (0, 1, 0), (-1, 0, 0), (1, 0, 0)]


def write_cube(path, normals=NORMALS, start=(0,) * 6, shift=(0, 0, 0)):
    """An OBJ with normals, whose quads start at any corner: diagonals differ."""
    points = np.array(CORNERS) + shift
    lines = ["v {:.17g} {:.17g} {:.17g}".format(*p) for p in points]
    lines += ["vn {} {} {}".format(*n) for n in normals]
    for i, (side, first) in enumerate(zip(SIDES, start, strict=True)):
        turned = np.roll(side, -first)
        lines.append("f " + " ".join(f"{c + 1}//{i + 1}" for c in turned))
    path.write_text("\n".join(lines) + "\n")


def at_corners(mesh, what="normals"):
    return np.asarray(getattr(mesh, what))[np.asarray(mesh.faces)]


def test_normals_of_the_file_keep_hard_edges(tmp_path):
    path = tmp_path / "cube.obj"
    write_cube(path)
    mesh = read_mesh(path)
    assert mesh.vertices.shape == (24, 3)
    np.testing.assert_array_equal(
        at_corners(mesh), np.repeat([[n] * 3 for n in NORMALS], 2, axis=0)
    )
    assert str(topology(mesh)) == "8 vertices and 12 faces in 1 piece, closed, genus 0"


def test_smooth_normals_do_not_depend_on_diagonals(tmp_path, rng):
    path = tmp_path / "cube.obj"
    for _ in range(4):
        write_cube(path, start=rng.integers(0, 4, 6))
        mesh = read_mesh(path, normals="smooth")
        assert mesh.vertices.shape == (8, 3)
        np.testing.assert_allclose(
            mesh.normals, np.asarray(mesh.vertices) / np.sqrt(3), rtol=0, atol=1e-7
        )


@pytest.mark.parametrize(("angle", "vertices"), [(0, 24), (89.9, 24), (90, 8), (180, 8)])
def test_an_angle_splits_where_faces_meet_at_more(tmp_path, angle, vertices):
    path = tmp_path / "cube.obj"
    write_cube(path)
    read, smooth = read_mesh(path, normals=angle), read_mesh(path, normals="smooth")
    made = make_mesh(smooth.vertices, smooth.faces, normals=angle)
    expected = at_corners(read_mesh(path) if vertices == 24 else smooth)
    for mesh in (read, made):
        assert mesh.vertices.shape == (vertices, 3)
        np.testing.assert_allclose(at_corners(mesh), expected, rtol=0, atol=1e-7)


def test_an_angle_rounds_a_cylinder_and_keeps_its_rims():
    count = 24
    t = np.arange(count) * 2 * np.pi / count
    ring = np.stack([np.cos(t), np.sin(t)], axis=1)
    vertices = np.concatenate([np.c_[ring, 0 * t], np.c_[ring, 0 * t + 1], [[0, 0, 0], [0, 0, 1]]])
    i = np.arange(count)
    j = (i + 1) % count
    bottom, top = np.full(count, 2 * count), np.full(count, 2 * count + 1)
    faces = [
        (i, j, count + j),
        (i, count + j, count + i),
        (bottom, j, i),
        (top, count + i, count + j),
    ]
    mesh = make_mesh(vertices, np.concatenate([np.stack(f, axis=1) for f in faces]), normals=30.0)
    assert mesh.vertices.shape == (4 * count + 2, 3)
    found = at_corners(mesh)
    np.testing.assert_allclose(
        found[2 * count :, :, 2], [[-1] * 3] * count + [[1] * 3] * count, rtol=0, atol=1e-7
    )
    outward = at_corners(mesh, "vertices")[: 2 * count] * [1, 1, 0]
    np.testing.assert_allclose(found[: 2 * count], outward, rtol=0, atol=1e-7)
    assert topology(mesh).closed


def test_bad_normals_become_smooth_ones_and_are_counted(tmp_path):
    path = tmp_path / "cube.obj"
    write_cube(
        path, normals=[("nan", 0, 0), (0, 0, 0), ("-nan(ind)",) * 3, (0, "inf", 0), *NORMALS[4:]]
    )
    with pytest.warns(UserWarning, match="normal") as record:
        mesh = read_mesh(path)
    assert str(record[0].message) == (
        f"{path}: 18 zero or infinite normals replaced by smooth ones, 6 corners without a normal "
        "given a smooth one"
    )
    found, places = at_corners(mesh), at_corners(mesh, "vertices")
    np.testing.assert_allclose(found[:8], places[:8] / np.sqrt(3), rtol=0, atol=1e-7)
    np.testing.assert_array_equal(found[8:], np.repeat([[n] * 3 for n in NORMALS[4:]], 2, axis=0))


def test_normals_against_the_winding_are_said(tmp_path):
    path = tmp_path / "cube.obj"
    write_cube(path, normals=[(-x, -y, -z) for x, y, z in NORMALS])
    with pytest.warns(UserWarning, match="12 faces whose normals point against the order of their"):
        mesh = read_mesh(path)
    np.testing.assert_array_equal(at_corners(mesh)[0, 0], [0, 0, 1])  # as the file says


def test_normals_of_any_length_are_unit(tmp_path):
    path = tmp_path / "cube.obj"
    write_cube(
        path,
        normals=[[f"{1e-30 * c:g}" for c in n] for n in NORMALS[:3]]
        + [[f"{1e300 * c:g}" for c in n] for n in NORMALS[3:]],
    )
    np.testing.assert_allclose(at_corners(read_mesh(path))[::2, 0], NORMALS, rtol=0, atol=1e-7)


@pytest.mark.parametrize("option", ["sharp", -1, 181, np.nan, True])
def test_unknown_normals_are_refused(unchecked, tmp_path, option):
    message = 'normals must be "file", "smooth" or an angle from 0 to 180 degrees'
    with pytest.raises(ValueError, match=message):
        read_mesh(tmp_path / "a.obj", normals=option)
    with pytest.raises(ValueError, match=message):
        make_mesh(*shapes.QUAD, normals=option)
    with pytest.raises(ValueError, match='are "smooth" or an angle in degrees, got "file"'):
        make_mesh(*shapes.QUAD, normals="file")


# -- large coordinates


@pytest.mark.parametrize("far", [(4e5, 8e5, 0), (-1e4, 1e4, 3), (0, 0, 6.4e6)])
def test_a_sphere_far_away_keeps_its_shape(far):
    unit, faces = shapes.sphere(16, 32)
    plain = make_mesh(unit, faces)
    with pytest.warns(UserWarning, match=r"origin=\(.*\) taken off"):
        mesh = make_mesh(unit.astype(float) + far, faces)
    np.testing.assert_array_equal(mesh.faces, plain.faces)
    assert mesh.origin == tuple(map(float, far))
    # In float64 1e-9 is left at 6.4e6, and float32 rounds by 6e-8.
    np.testing.assert_allclose(mesh.vertices, unit, rtol=0, atol=7e-8)
    np.testing.assert_allclose(mesh.normals, plain.normals, rtol=0, atol=1e-7)


def test_an_origin_is_taken_off_only_where_shape_is_lost(tmp_path):
    for far, size in itertools.product((0, 1, 7.9), (1e-6, 1, 1e6)):
        vertices, faces = shapes.sphere(16, 32)
        mesh = make_mesh(size * (vertices.astype(float) + far), faces)
        assert mesh.origin == (0, 0, 0)
    # Chosen: nothing is said.
    vertices, faces = shapes.TETRAHEDRON
    mesh = make_mesh(vertices + 1e6, faces, origin=(1e6, 1e6, 1e6))
    np.testing.assert_array_equal(mesh.vertices, vertices)
    assert mesh.origin == (1e6, 1e6, 1e6)
    path = tmp_path / "cube.obj"
    write_cube(path, shift=(1e9, 0, 0))
    with pytest.warns(UserWarning, match="coordinates up to 1e.09 over a size of 2 .* taken off"):
        mesh = read_mesh(path)
    assert mesh.origin == (1e9, 0, 0)
    np.testing.assert_array_equal(np.unique(np.asarray(mesh.vertices), axis=0), sorted(CORNERS))
    mesh = read_mesh(path, origin=(1e9 - 2, 0, 0), up="y")
    np.testing.assert_array_equal(np.asarray(mesh.vertices)[:, 0] % 2, np.ones(24))


def test_parts_too_far_apart_for_float32_are_said(rng):
    vertices, faces = shapes.TETRAHEDRON
    vertices = vertices @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    both = np.concatenate([faces, faces + len(vertices)])
    for far, moved in ((1e5, False), (1e7, True)):  # float32 rounds by 0.004, 0.5
        apart = np.concatenate([vertices, vertices + np.array([far, 0, 0])])
        for given, expected in ((apart, moved), (apart.astype(np.float32), False)):
            with warnings.catch_warnings(record=True) as record:
                warnings.simplefilter("always")
                mesh = make_mesh(given, both)
            assert mesh.origin == (0, 0, 0)
            said = "".join(str(one.message) for one in record)
            assert ("of the faces by over 1/20 of their size" in said) == expected


@pytest.mark.parametrize("origin", [(1, 2), (np.nan, 0, 0), "here", 3.0])
def test_an_origin_that_is_no_point_is_refused(unchecked, tmp_path, origin):
    for attempt in (
        lambda: make_mesh(*shapes.QUAD, origin=origin),
        lambda: read_mesh(tmp_path / "a.obj", origin=origin),
    ):
        with pytest.raises(ValueError, match="origin must be three finite numbers"):
            attempt()


# -- up


def test_up_is_that_of_the_format_and_normals_turn_too(tmp_path):
    corner = trimesh.Trimesh(*shapes.TETRAHEDRON, process=False)
    corner.export(tmp_path / "a.glb")
    corner.export(tmp_path / "a.ply")
    y_up, z_up = read_mesh(tmp_path / "a.glb"), read_mesh(tmp_path / "a.ply")
    np.testing.assert_array_equal(
        np.sort(z_up.vertices, axis=0), np.sort(shapes.TETRAHEDRON[0], axis=0)
    )
    turned = np.asarray(z_up.vertices) @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    np.testing.assert_array_equal(y_up.vertices, turned)
    np.testing.assert_array_equal(read_mesh(tmp_path / "a.glb", up="z").vertices, z_up.vertices)
    path = tmp_path / "cube.obj"
    write_cube(path)
    mesh = read_mesh(path, up="y")
    for normals in (mesh.normals, read_mesh(path, up="y", normals=30).normals):
        outward = np.cross(*np.moveaxis(np.diff(at_corners(mesh, "vertices"), axis=1), 1, 0))
        found = np.asarray(normals)[mesh.faces]
        np.testing.assert_allclose(
            found, np.repeat(outward[:, None] / 4, 3, axis=1), rtol=0, atol=1e-7
        )


def test_split_vertices_have_the_normals_of_the_whole(tmp_path):
    """Where UV alone differ, normals are computed as if they did not."""
    path = tmp_path / "cube.obj"
    write_cube(path)
    text = path.read_text().replace("//", "/1/", 5) + "vt 1 2\n"
    path.write_text(text)
    mesh = read_mesh(path, normals="smooth")
    assert len(mesh.vertices) > 8
    plain = make_mesh(
        np.array(CORNERS, float),
        np.array([f for a, b, c, d in SIDES for f in ((a, b, c), (a, c, d))]),
    )
    np.testing.assert_array_equal(plain.normals, vertex_normals(plain.vertices, plain.faces))
    expected = np.asarray(mesh.vertices) / np.sqrt(3)
    np.testing.assert_allclose(mesh.normals, expected, rtol=0, atol=1e-7)
