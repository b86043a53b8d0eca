"""Meshes from arrays, their cleaning, their normals."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import shapes
from jax.test_util import check_grads

from jaxsh.geometry import Mesh, knot, make_mesh, ray_scene, vertex_normals

# Compiled once for all tests.
JACOBIANS = [jax.jit(jac(vertex_normals)) for jac in (jax.jacfwd, jax.jacrev)]


def test_make_mesh_keeps_a_clean_mesh_as_it_is():
    vertices, faces = shapes.TETRAHEDRON
    mesh = make_mesh(vertices, faces)
    np.testing.assert_array_equal(mesh.vertices, vertices)
    np.testing.assert_array_equal(mesh.faces, faces)
    assert mesh.vertices.dtype == mesh.normals.dtype == jnp.float32
    assert mesh.faces.dtype == jnp.int32


def test_make_mesh_takes_float64_and_jax_arrays():
    vertices, faces = shapes.TETRAHEDRON
    mesh = make_mesh(jnp.asarray(vertices, jnp.float64), jnp.asarray(faces, jnp.int64))
    assert mesh.vertices.dtype == jnp.float32
    assert mesh.faces.dtype == jnp.int32


def test_every_fault_is_dropped_and_counted_in_one_warning():
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    vertices = np.array(
        [
            *square,
            [np.nan, 0, 0],  # 4, used
            [9, 9, 9],  # 5, unused
            [1, 1, 0],  # 6, again 2
            [2, 0, 0],  # 7, used by a face without area alone
            [1e300, 0, 0],  # 8, infinite in float32, unused
        ]
    )
    faces = np.array(
        [
            [0, 1, 2],
            [0, 6, 3],
            [0, 1, 4],  # not finite
            [0, 1, 7],  # on a line
            [0, 2, 6],  # two corners at one place
            [1, 6, 0],  # the first again
        ]
    )
    with pytest.warns(UserWarning, match="dropped") as record:
        mesh = make_mesh(vertices, faces)
    assert len(record) == 1
    assert str(record[0].message) == (
        "mesh: 2 NaN or infinite vertices dropped, 1 faces with NaN or infinite vertices dropped, "
        "1 unreferenced vertices dropped, 1 duplicate vertices merged, 2 degenerate faces "
        "dropped, 1 duplicate faces dropped, 1 vertices of dropped faces alone dropped"
    )
    np.testing.assert_array_equal(mesh.vertices, np.array(square, np.float32))
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [0, 2, 3]])
    np.testing.assert_array_equal(mesh.normals, [[0, 0, 1]] * 4)


def test_negative_zero_is_the_same_place():
    vertices = np.concatenate([shapes.QUAD[0], [[-0.0, -0.0, -0.0]]]).astype(np.float32)
    with pytest.warns(UserWarning, match="1 duplicate vertices merged"):
        mesh = make_mesh(vertices, np.array([[0, 1, 2], [4, 2, 3]]))
    assert mesh.vertices.shape == (4, 3)


def test_of_two_sides_of_a_sheet_the_first_stays():
    vertices, faces = shapes.QUAD
    both = np.concatenate([faces[:1], faces[:, ::-1], np.roll(faces[1:], 1, axis=1)])
    with pytest.warns(UserWarning, match="mesh: 2 faces that are another's back dropped"):
        mesh = make_mesh(vertices, both)
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [3, 2, 0]])


def test_a_sphere_with_its_inside_is_the_plain_sphere(rng):
    vertices, faces = shapes.sphere(6, 8)
    plain = make_mesh(vertices, faces)
    inside = rng.permutation(np.concatenate([faces, faces])[:, ::-1])  # each back twice
    with pytest.warns(UserWarning, match="back") as record:
        mesh = make_mesh(vertices, np.concatenate([faces, inside]))
    assert str(record[0].message) == (
        f"mesh: {len(faces)} duplicate faces dropped, {len(faces)} faces that are another's back "
        "dropped"
    )
    for one, other in zip(_arrays(mesh), _arrays(plain), strict=True):
        np.testing.assert_array_equal(one, other)


def _arrays(mesh):
    return mesh.vertices, mesh.faces, mesh.normals


def test_both_sides_of_a_sheet_have_normals_of_their_own_when_asked():
    vertices, faces = shapes.QUAD
    mesh = make_mesh(vertices, np.concatenate([faces, faces[:, ::-1]]), two_sided=True)
    assert mesh.faces.shape == (4, 3)
    corners = np.asarray(mesh.vertices)[mesh.faces]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_array_equal(sides[:, 2], [1, 1, -1, -1])
    np.testing.assert_array_equal(
        np.asarray(mesh.normals)[mesh.faces], np.broadcast_to(sides[:, None], (4, 3, 3))
    )


@pytest.mark.parametrize("scale", [1e-12, 1e-3, 1e6, 1e12])
def test_cleaning_does_not_depend_on_scale(scale):
    vertices, faces = shapes.sphere(12, 24)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mesh = make_mesh(vertices * np.float32(scale), faces)
    assert mesh.faces.shape == faces.shape


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], r"vertices must have shape \(v, 3\), got \(3, 2\)"),
        (np.zeros((3, 3)), [[0, 1]], r"faces must have shape \(f, 3\), got \(1, 2\)"),
        (np.zeros((3, 3)), np.zeros((0, 3), int), "holds no faces"),
        (np.zeros((3, 3)), [[0.0, 1.0, 2.0]], "expected integers for faces, got .* float64"),
        (np.zeros((3, 3)), [[0, 1, 2], [0, 1, 3]], r"face 1 is \[0, 1, 3\], .* 0 to 2"),
        (np.zeros((3, 3)), [[0, 1, -1]], r"face 0 is \[0, 1, -1\]"),
        (np.zeros((3, 3)), [[0, 1, 2]], r"no face is left \(.*1 degenerate faces dropped\)"),
        (np.full((3, 3), np.nan), [[0, 1, 2]], "no face is left"),
    ],
)
def test_bad_arrays_are_refused(unchecked, vertices, faces, message):
    with pytest.raises(ValueError, match=message):
        make_mesh(vertices, np.asarray(faces))


# Errors measured: 1.64e-2 at 32 × 64, 8.2e-3 at 64 × 128, both on the ring next to a pole.
@pytest.mark.parametrize(("rows", "tolerance"), [(32, 1.7e-2), (64, 8.3e-3)])
def test_normals_of_a_sphere(rows, tolerance):
    vertices, faces = shapes.sphere(rows, 2 * rows)
    normals = vertex_normals(jnp.asarray(vertices), jnp.asarray(faces))
    assert np.abs(normals - vertices).max() < tolerance


def test_normals_are_weighted_by_angle():
    # A corner where a face of angle 30° facing z meets one of angle 90° facing y.
    vertices = jnp.array([[0.0, 0, 0], [1, 0, 0], [np.sqrt(3), 1, 0], [0, 0, 6]])
    normals = vertex_normals(vertices, jnp.array([[0, 1, 2], [0, 3, 1]]))
    np.testing.assert_allclose(normals[0], np.array([0, 3, 1]) / np.sqrt(10), rtol=0, atol=3e-16)
    np.testing.assert_allclose(jnp.linalg.norm(normals, axis=1), 1, rtol=0, atol=3e-16)


def test_normals_of_a_cube_do_not_depend_on_its_diagonals(rng):
    signs = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)])
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    for _ in range(8):
        faces = [
            face
            for side in sides
            for a, b, c, d in [np.roll(side, rng.integers(4))]
            for face in ((a, b, c), (a, c, d))
        ]
        normals = vertex_normals(jnp.asarray(signs, float), jnp.asarray(faces))
        np.testing.assert_allclose(normals, signs / np.sqrt(3), rtol=0, atol=4e-16)


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_normals_keep_dtype_under_jit_and_vmap(rng, dtype):
    vertices, faces = shapes.sphere(6, 8)
    batch = jnp.asarray(vertices + rng.normal(size=(3, *vertices.shape)) * 0.01, dtype)
    faces = jnp.asarray(faces)
    together = jax.jit(jax.vmap(vertex_normals, (0, None)))(batch, faces)
    assert together.dtype == dtype
    for one, normals in zip(batch, together, strict=True):
        # Compiled sums may run in another order: 1e-7 and 2e-16 measured.
        tolerance = 4 * float(jnp.finfo(dtype).eps)
        np.testing.assert_allclose(normals, vertex_normals(one, faces), rtol=0, atol=tolerance)


def test_normals_differentiate_both_ways(rng):
    vertices, faces = shapes.sphere(6, 8)
    faces = jnp.asarray(faces)
    points = jnp.asarray(vertices + rng.normal(size=vertices.shape) * 0.05, jnp.float64)
    # Central differences agree to 1.4e-7.
    check_grads(
        jax.jit(lambda v: vertex_normals(v, faces)),
        (points,),
        1,
        ("fwd", "rev"),
        atol=2e-7,
        rtol=2e-7,
    )
    forward, reverse = (jacobian(points, faces) for jacobian in JACOBIANS)
    np.testing.assert_allclose(reverse, forward, rtol=0, atol=1e-15)
    # Turning with the shape keeps the normal a unit vector.
    normals = vertex_normals(points, faces)
    np.testing.assert_allclose(jnp.einsum("vi,viwj->vwj", normals, forward), 0, rtol=0, atol=1e-15)


@pytest.mark.parametrize("scale", [0.0, 1e-30, 1.0, 1e30])
def test_normals_and_gradients_are_finite_where_there_is_no_normal(scale):
    vertices = scale * jnp.array(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0], [5, 5, 5]], jnp.float32
    )
    # A face, a face on a line, a face with a corner twice, its own back; vertex 4 in none.
    faces = jnp.array([[0, 1, 2], [0, 1, 3], [0, 3, 3], [0, 2, 1]])
    np.testing.assert_array_equal(vertex_normals(vertices, faces), [[0, 0, 1]] * 5)
    for jacobian in JACOBIANS:
        assert np.isfinite(jacobian(vertices, faces)).all()


@pytest.mark.parametrize("scale", [1e-25, 1e25])
def test_normals_do_not_depend_on_scale(scale):
    vertices, faces = shapes.sphere(6, 8)
    normals = vertex_normals(jnp.asarray(vertices * np.float32(scale)), jnp.asarray(faces))
    np.testing.assert_allclose(
        normals, vertex_normals(jnp.asarray(vertices), jnp.asarray(faces)), rtol=0, atol=2e-7
    )


@pytest.mark.parametrize(("asked", "got"), [(300, 300), (10_000, 9_990), (20_000, 20_020)])
def test_knot_is_one_closed_surface_in_the_unit_ball(asked, got):
    mesh = knot(asked)
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces)
    assert len(vertices) == got
    assert len(faces) == 2 * got
    assert 0.999 < np.linalg.norm(vertices, axis=1).max() <= 1
    # Closed and wound alike: each edge once in each direction. Genus 1: V - E + F = 0 then.
    edges = {(a, b) for f in faces.tolist() for a, b in zip(f, f[1:] + f[:1], strict=True)}
    assert len(edges) == 3 * len(faces)
    assert {(b, a) for a, b in edges} == edges
    a, b, c = vertices[faces].transpose(1, 0, 2)
    assert (
        np.einsum("fi,fi", a, np.cross(b, c)) / 6 > 0.69
    )  # outwards: 0.694 at 300, 0.926 at 20,000


def test_knot_does_not_touch_itself():
    mesh = knot(4_000)
    vertices, normals = np.asarray(mesh.vertices), np.asarray(mesh.normals)
    # From every vertex outwards, the next surface along the normal is at least the gap away.
    # The smallest is 0.084 (the pipe is 0.37 thick).
    hit = ray_scene(mesh).closest_hit(vertices + 1e-4 * normals, normals)
    assert hit.distance.min() > 0.08
    # And it shades itself: 41 % of its vertices see it along their normal.
    assert np.isfinite(hit.distance).mean() > 0.4


def test_knot_needs_vertices():
    with pytest.raises(ValueError, match="at least 300 vertices to be one, got 299"):
        knot(299)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        (
            "vertices",
            jnp.ones((4, 2)),
            r"vertices of a mesh as an array \(v, 3\) of floats, .*4, 2",
        ),
        ("vertices", [[0.0, 0.0, 0.0]] * 4, r"vertices .* got a list of 4"),
        ("normals", jnp.ones((3, 3)), r"normals .* got an array of shape \(3, 3\)"),
        ("faces", jnp.zeros((2, 4), int), r"faces of a mesh as an array \(f, 3\) of integers"),
        ("faces", jnp.zeros((2, 3)), "faces .* dtype float64"),
        ("uv", jnp.ones((4, 3)), r"uv of a mesh as an array \(v, 2\)"),
        ("colors", jnp.ones((4, 3)), r"colors of a mesh as an array \(v, 4\)"),
        ("face_material", jnp.zeros(3, int), r"face_material of a mesh as an array \(f,\)"),
    ],
)
def test_a_mesh_by_hand_must_fit(unchecked, field, value, message):
    mesh = make_mesh(*shapes.TETRAHEDRON)
    arrays = {"vertices": mesh.vertices, "faces": mesh.faces, "normals": mesh.normals}
    with pytest.raises(ValueError, match=message):
        Mesh(**arrays | {field: value})


@pytest.mark.parametrize("normals", ["smooth", 30.0])
def test_normals_of_a_mesh_below_the_normal_numbers_of_float32(normals):
    vertices, faces = shapes.TETRAHEDRON
    expected = make_mesh(vertices, faces, normals=normals).normals
    got = make_mesh(np.asarray(vertices) * 2.0**-134, faces, normals=normals).normals
    np.testing.assert_array_equal(got, expected)


def test_mesh_is_a_pytree():
    mesh = make_mesh(*shapes.TETRAHEDRON)
    moved = jax.jit(lambda m: Mesh(m.vertices + 1, m.faces, m.normals))(mesh)
    np.testing.assert_array_equal(moved.vertices, np.asarray(mesh.vertices) + 1)
