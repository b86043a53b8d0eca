"""Point clouds from PLY files."""

import struct

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import geometry, imaging


def ply(rows, names="x y z nx ny nz", kind="float"):
    """A file in text, one row for each point."""
    properties = [f"property {kind} {name}" for name in names.split()]
    head = ["ply", "format ascii 1.0", f"element vertex {len(rows)}", *properties, "end_header"]
    return "\n".join([*head, *(" ".join(map(str, row)) for row in rows), ""])


def test_points_and_normals_are_read_and_turned(tmp_path):
    (tmp_path / "a.ply").write_text(ply([(1, 2, 3, 0, 0, 2), (4, 5, 6, 3, 0, 4)]))
    points = geometry.read_points(tmp_path / "a.ply")
    np.testing.assert_array_equal(points.positions, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_allclose(points.normals, [[0, 0, 1], [0.6, 0, 0.8]], rtol=0, atol=6e-8)
    assert points.positions.dtype == points.normals.dtype == np.float32
    up = geometry.read_points(tmp_path / "a.ply", up="y", origin=(1.0, 0.0, 0.0))
    np.testing.assert_array_equal(up.positions, [[0, -3, 2], [3, -6, 5]])
    np.testing.assert_allclose(up.normals, [[0, -1, 0], [0.6, -0.8, 0]], rtol=0, atol=6e-8)
    down = geometry.read_points(tmp_path / "a.ply", up="-y")
    np.testing.assert_array_equal(down.positions, [[1, 3, -2], [4, 6, -5]])


def test_the_vertices_of_a_written_mesh_come_back(tmp_path):
    mesh = geometry.knot(300)
    geometry.write_mesh(tmp_path / "knot.ply", mesh)
    points = geometry.read_points(tmp_path / "knot.ply")
    np.testing.assert_array_equal(points.positions, mesh.vertices)
    np.testing.assert_allclose(points.normals, mesh.normals, rtol=0, atol=2e-7)


def test_a_binary_file_far_from_zero_keeps_its_shape(tmp_path):
    head = "ply\nformat binary_big_endian 1.0\nelement vertex 2\n"
    head += "".join(f"property double {name}\n" for name in "xyz") + "end_header\n"
    body = struct.pack(">6d", 5e6, 0, 0, 5e6 + 0.125, 0, 0)
    (tmp_path / "a.ply").write_bytes(head.encode() + body)
    points = geometry.read_points(tmp_path / "a.ply", origin=(5e6, 0.0, 0.0))
    np.testing.assert_array_equal(points.positions, [[0, 0, 0], [0.125, 0, 0]])
    assert points.normals is None


def test_splats_give_their_centers(tmp_path, rng):
    splats = imaging.Splats(jnp.asarray(rng.normal(size=(5, 3)), jnp.float32), jnp.ones((5, 3, 4)))
    imaging.write_splats(tmp_path / "a.ply", splats)
    points = geometry.read_points(tmp_path / "a.ply")
    np.testing.assert_array_equal(points.positions, splats.positions)
    assert points.normals is None


def test_points_without_place_or_normal_are_dropped_and_counted(tmp_path):
    rows = [(0, 0, 0, 0, 0, 1), ("nan", 0, 0, 0, 0, 1), (1, 0, 0, 0, 0, 0), (1e39, 0, 0, 0, 1, 0)]
    path = tmp_path / "a.ply"
    path.write_text(ply(rows))
    with pytest.warns(
        UserWarning, match="2 points that are not finite dropped, 1 points that have"
    ):
        points = geometry.read_points(path)
    np.testing.assert_array_equal(points.positions, [[0, 0, 0]])


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.xyz", "0 0 0", r"a\.xyz: cannot read \.xyz, only \.ply"),
        ("a.ply", "0 0 0", r"a\.ply: damaged or not a \.ply file: it does not begin with 'ply'"),
        ("a.ply", ply([(1, 2)], "x y"), "its header has no vertices with x, y and z"),
        ("a.ply", ply([], "x y z"), r"a\.ply: it holds no points$"),
        ("a.ply", ply([("nan", 0, 0)], "x y z"), "it holds no points that are known"),
        ("a.ply", ply([(1, 2, 3), (4,)], "x y z"), "row 1 of its element 'vertex' has 1 values"),
    ],
)
def test_a_bad_file_is_named(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=message):
        geometry.read_points(tmp_path / name)


def test_other_mistakes_are_named(tmp_path, unchecked):
    with pytest.raises(FileNotFoundError, match="there is no such file of points"):
        geometry.read_points(tmp_path / "none.ply")
    with pytest.raises(ValueError, match="origin must be three finite numbers, got None"):
        geometry.read_points(tmp_path / "none.ply", origin=None)
    with pytest.raises(ValueError, match="up must be one of z, y, -y, got 'x'"):
        geometry.read_points(tmp_path / "none.ply", up="x")


def test_a_mesh_reader_points_to_it(tmp_path):
    (tmp_path / "a.ply").write_text(ply([(1, 2, 3)], "x y z"))
    with pytest.raises(ValueError, match="holds no faces, but 1 points: those are for read_points"):
        geometry.read_mesh(tmp_path / "a.ply")
