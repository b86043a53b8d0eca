"""The bake of meshes of any size, anywhere, and near other surfaces, against closed forms."""

import warnings

import bodies
import jax.numpy as jnp
import numpy as np
import pytest
from bodies import box, joined, moved, rotation, unshadowed

from jaxsh.geometry import (
    EmbreeRayScene,
    JaxRayScene,
    Mesh,
    knot,
    make_mesh,
    ray_scene,
    vertex_normals,
)
from jaxsh.transfer import bake
from jaxsh.transfer._bake import _origins
from jaxsh.transfer._bake._receivers import unit_normals

DEGREE, RAYS = 4, 256  # of all bakes here: each other pair compiles anew


def baked(mesh, **options):
    options = {"directions": RAYS, "progress": False} | options
    return np.asarray(bake(mesh, DEGREE, **options).coefficients)


def irradiance(mesh, **options):
    """Under a uniform sky, as a share of π."""
    return baked(mesh, **options)[:, 0] * np.sqrt(4 * np.pi) / np.pi


def ground(half: float) -> Mesh:
    """A square in z = 0 of four triangles, whose last vertex is in the middle."""
    corners = float(half) * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0, 0, 0]])
    return make_mesh(corners, np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]))


@pytest.fixture(scope="module")
def sphere():
    vertices, faces = bodies.sphere(24, 36, 0.999 * np.pi)
    return bodies.by_hand(vertices, faces, vertices)


@pytest.mark.parametrize("distance", [0, 1e4, 1e5, 1e6])
def test_a_sphere_far_away_sees_everything(sphere, distance):
    """Also where float32 leaves little of its shape."""
    mesh = moved(sphere, [distance, distance, 0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        # 1.3e-7 measured.
        np.testing.assert_allclose(baked(mesh), unshadowed(mesh, DEGREE), rtol=0, atol=3e-7)


def test_poles_that_stand_there_once_for_each_uv_hide_no_light():
    """As exporters write a sphere: around a pole fans close in space alone."""
    rows, columns = 12, 24
    theta, phi = np.meshgrid(
        np.linspace(np.pi, 0, rows + 1), np.linspace(0, 2 * np.pi, columns + 1), indexing="ij"
    )
    vertices = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    ).reshape(-1, 3)
    number = np.arange(len(vertices)).reshape(theta.shape)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    upper = np.stack([a, b, c], axis=-1)[1:].reshape(-1, 3)
    lower = np.stack([a, c, d], axis=-1)[:-1].reshape(-1, 3)
    mesh = bodies.by_hand(vertices, np.concatenate([upper, lower]), vertices)
    # 1e-7 measured; a start within the surface sees nothing.
    np.testing.assert_allclose(irradiance(mesh), 1, rtol=0, atol=3e-7)


@pytest.mark.parametrize("scale", [1e-40, 1e-30, 1e-18, 1e18, 1e30])
def test_a_sphere_of_any_size_sees_everything(sphere, scale):
    mesh = Mesh(sphere.vertices * np.float32(scale), sphere.faces, sphere.normals)
    np.testing.assert_allclose(baked(mesh), unshadowed(mesh, DEGREE), rtol=0, atol=3e-7)


@pytest.mark.parametrize(
    "kind", [EmbreeRayScene, pytest.param(JaxRayScene, marks=pytest.mark.slow)]
)
def test_a_body_with_shadows_has_the_same_anywhere(kind):
    """Powers of two change no bit; in float64, neither a shift nor a scale more than rounding."""
    mesh = knot(300)
    expected = baked(mesh, scene=kind(mesh))
    for scale in (2.0**-80, 2.0**80):
        other = Mesh(mesh.vertices * np.float32(scale), mesh.faces, mesh.normals)
        np.testing.assert_array_equal(baked(other, scene=kind(other)), expected)
    vertices, normals = np.asarray(mesh.vertices, float), jnp.asarray(mesh.normals, float)
    for scale, shift in ((1e-18, 0.0), (1e-100, 0.0), (1e100, 0.0), (1.0, 1e7)):
        other = Mesh(jnp.asarray(vertices * scale + shift), mesh.faces, normals)
        got = baked(other, scene=kind(other))
        error = np.linalg.norm(got - expected, axis=1) / np.linalg.norm(expected, axis=1).mean()
        # 1e-3 measured: one ray of about 80 that a vertex casts hits or misses.
        assert (error > 2e-5).mean() < 0.1
        assert error.max() < 0.05


def test_a_sphere_in_doubles_sees_everything_anywhere(sphere):
    vertices, normals = (jnp.asarray(x, float) for x in (sphere.vertices, sphere.normals))
    mesh = Mesh(1e-3 * vertices + 1e7, sphere.faces, normals)
    np.testing.assert_allclose(baked(mesh), unshadowed(mesh, DEGREE), rtol=0, atol=3e-7)


@pytest.mark.parametrize("scale", [1e-310, 1e-200, 1e200, 4e307])
def test_a_sphere_in_doubles_of_any_size_sees_everything(sphere, scale):
    vertices, normals = (jnp.asarray(x, float) for x in (sphere.vertices, sphere.normals))
    mesh = Mesh(jnp.asarray(np.asarray(vertices) * scale), sphere.faces, normals)
    np.testing.assert_allclose(baked(mesh), unshadowed(mesh, DEGREE), rtol=0, atol=3e-7)


def test_what_coordinates_lose_is_said():
    mesh = moved(knot(300), [1e5, 1e5, 1e5])
    message = (
        r"rays start 0\.048 off the surface, 0\.\d+ of a vertex's shortest edge \(the median\), "
        r".*: coordinates up to 1e\+05 are rounded to 0\.012: take an origin off them"
    )
    with pytest.warns(UserWarning, match=message):
        baked(mesh)
    # Doubles have what singles lose.
    vertices, normals = np.asarray(knot(300).vertices, float), jnp.asarray(mesh.normals, float)
    baked(Mesh(jnp.asarray(vertices + 1e5), mesh.faces, normals))


@pytest.mark.filterwarnings("ignore:bake. 1 of 9 vertices see nothing")
@pytest.mark.parametrize("half", [50, 100, 4000])
def test_a_sheet_above_a_ground_of_any_size_shades_it(half):
    """8 mm above the middle; a default offset of 1e-4 half-extents gave E = 0, π and π."""
    mesh = joined(bodies.rectangle([-0.5, -0.5, 8e-3], [1, 0, 0], [0, 1, 0]), ground(half))
    got = irradiance(mesh)
    # What is seen past the sheet is at most 8/500 above the horizon: less than 1e-3 of π.
    np.testing.assert_allclose(got, [1] * 8 + [0], rtol=0, atol=1e-3)


@pytest.mark.filterwarnings("ignore:bake. 1 of 9 vertices see nothing")
def test_a_chosen_offset_may_be_too_large_and_is_said():
    """In the unit of the vertices, or as a share of the half extent."""
    mesh = joined(bodies.rectangle([-0.5, -0.5, 8e-3], [1, 0, 0], [0, 1, 0]), ground(50))
    for options, middle in (
        ({"offset": 7e-3}, 0),
        ({"offset": 9e-3}, 1),
        ({"ray_bias": 7e-3 / 50}, 0),
        ({"ray_bias": 9e-3 / 50}, 1),
    ):
        assert irradiance(mesh, **options)[-1] == pytest.approx(middle, abs=1e-3)
    with pytest.warns(UserWarning, match="0.3 off the surface, 0.3 of .*: give a smaller ray_bias"):
        irradiance(bodies.rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0]), offset=0.3)
    below = joined(ground(10), box([-1, -1, 1e-3], [1, 1, 2]))
    message = (
        "1 of 29 vertices see nothing .1 with rays that start beyond the next surface, up to 0.002"
    )
    with pytest.warns(UserWarning, match=message):
        baked(below, offset=2e-3)


def test_an_offset_below_rounding_is_raised_to_it():
    """Alone on a surface, tilted, with an offset of nothing: not shadowed by the surface itself."""
    turn = rotation(0)
    sheet = moved(ground(1), [30, 20, 10], turn)
    np.testing.assert_allclose(irradiance(sheet, offset=1e-12), 1, rtol=0, atol=1e-6)
    one = bodies.points(np.asarray(sheet.vertices)[4:], np.asarray(sheet.normals)[4:])
    np.testing.assert_allclose(irradiance(one, scene=ray_scene(sheet)), 1, rtol=0, atol=1e-6)


def test_small_parts_of_a_large_mesh_keep_their_shadows():
    """A knot of a centimeter beside a ground of a kilometer bakes as it does alone."""
    small = Mesh(knot(300).vertices * np.float32(0.01), knot(300).faces, knot(300).normals)
    mesh = joined(small, moved(ground(1000), [0, 0, -1000]))
    got, alone = (baked(m, scene=ray_scene(small)) for m in (mesh, small))
    error = np.linalg.norm(got[: len(alone)] - alone) / np.linalg.norm(alone)
    assert error < 2e-3


def test_cubes_with_hard_edges_see_the_whole_sky():
    turn = rotation(1)
    for cube in (box([-1] * 3, [1] * 3), moved(box([-1] * 3, [1] * 3), [3, 2, 1], turn)):
        np.testing.assert_allclose(baked(cube), unshadowed(cube, DEGREE), rtol=0, atol=3e-7)


def test_rooms_with_hard_edges_let_no_light_through():
    """In a corner of three walls each wall's own vertex sees an octant: π/4."""
    walls = [
        bodies.rectangle([0, 0, 0], *sides)
        for sides in (np.eye(3)[[0, 1]], np.eye(3)[[1, 2]], np.eye(3)[[2, 0]])
    ]
    turn = rotation(2)
    for room in (joined(*walls), moved(joined(*walls), [0.3, 0.2, 0.1], turn)):
        got = irradiance(room).reshape(3, 4)[:, 0]
        np.testing.assert_allclose(got, 1 / 4, rtol=0, atol=5e-3)  # 3e-3 measured


def test_a_box_that_stands_on_a_ground():
    """Its sides see half of the sky, also at their feet, and the ground beneath it nothing."""
    mesh = joined(box([-1, -1, 0], [1, 1, 2]), ground(1e4))
    with pytest.warns(UserWarning, match="1 of 29 .* see nothing .1 behind faces of another"):
        got = irradiance(mesh)
    sides = np.abs(np.asarray(mesh.normals)[:24, 2]) < 0.5
    np.testing.assert_allclose(got[:24][sides], 0.5, rtol=0, atol=1.5e-2)  # 1.1e-2 measured


@pytest.mark.filterwarnings("ignore:bake. 2 of 2 vertices see nothing")
def test_two_plates_take_what_lies_between_them():
    """A plate sees another of half sides a and b, c above its middle (Howell's C-14): F of the
    parts of its sky, 4 (A/√(1+A²) atan(B/√(1+A²)) + B/√(1+B²) atan(A/√(1+B²))) / 2π.
    """
    lower = bodies.points([[0, 0, 0], [0, 0, 0]], [[0, 0, 1]] * 2)
    for a, b, c in ((1.0, 2.0, 0.5), (3.0, 1.0, 2.0), (1.0, 1.0, 1e-3)):
        upper = bodies.rectangle([-a, -b, c], [2 * a, 0, 0], [0, 2 * b, 0])
        x, y = a / c, b / c
        r, s = np.sqrt(1 + x * x), np.sqrt(1 + y * y)
        factor = 2 / np.pi * (x / r * np.arctan(y / r) + y / s * np.arctan(x / s))
        for scale in (1e-18, 1.0, 1e18):
            scene = ray_scene(Mesh(upper.vertices * np.float32(scale), upper.faces, upper.normals))
            got = irradiance(lower, scene=scene)
            np.testing.assert_allclose(got, 1 - factor, rtol=0, atol=1e-2)  # 7e-3 measured


def test_plates_at_one_place_see_the_sky():
    """Twice the same way round, and back to back."""
    sides = [1, 0, 0], [0, 1, 0]
    for other in (sides, sides[::-1]):
        plates = joined(*(bodies.rectangle([0, 0, 0], *two) for two in (sides, other)))
        np.testing.assert_allclose(irradiance(plates), 1, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("vertices", "faces"),
    [
        (np.eye(3), [[0, 1, 2]]),  # one triangle: all of it is rim
        ([[0, 0, 0], [1, 0, 0], [0.5, 1e-5, 0], [0.5, -1, 0]], [[0, 1, 2], [0, 3, 1]]),  # a needle
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]),  # no area
        ([[3, 0, 0]] * 3, [[0, 1, 2]]),  # no extent
        ([[0, 0, 0]] * 3, [[0, 1, 2]]),
        ([[7, 7, 7]], np.zeros((0, 3))),  # no face
    ],
)
def test_meshes_of_little_see_everything(vertices, faces):
    faces = np.asarray(faces, np.int32)
    vertices = jnp.asarray(vertices, jnp.float32)
    mesh = Mesh(vertices, jnp.asarray(faces), vertex_normals(vertices, jnp.asarray(faces)))
    scene = ray_scene(bodies.rectangle([0, 0, -9], [1, 0, 0], [0, 1, 0]))
    for options in ({}, {"scene": scene}) if len(faces) else ({"scene": scene},):
        np.testing.assert_allclose(irradiance(mesh, **options), 1, rtol=0, atol=1e-6)


def test_ray_bias_and_offset_exclude_each_other(unchecked):
    with pytest.raises(ValueError, match=r"expected ray_bias or offset, not both: got 0\.1 and 1"):
        bake(bodies.cube(), 1, ray_bias=0.1, offset=1)
    for wrong in (0, -1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match=r"offset must be (a number > 0|finite)"):
            bake(bodies.cube(), 1, offset=wrong)


def test_origins_do_not_depend_on_the_blocks_they_are_made_in(monkeypatch):
    """A mesh with a rim, gaps and shadows, cut in blocks that divide nothing."""
    whole = knot(3000)
    mesh = Mesh(whole.vertices, whole.faces[: len(whole.faces) * 9 // 10], whole.normals)
    scene, normals = ray_scene(mesh), unit_normals(mesh)
    expected = _origins.origins(mesh, normals, scene, None, None)
    monkeypatch.setattr(_origins, "_BLOCK", 1000)
    got = _origins.origins(mesh, normals, scene, None, None)
    np.testing.assert_array_equal(got.positions, expected.positions)
    np.testing.assert_array_equal(got.distance, expected.distance)
    np.testing.assert_array_equal(got.least, expected.least)
