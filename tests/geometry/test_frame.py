"""Rays at meshes of any size, anywhere: the answers are those of the mesh of unit size."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import shapes

from jaxsh.geometry import EmbreeRayScene, JaxRayScene, Mesh, trace
from jaxsh.geometry._frame import frame_around, framed

SCENES = [EmbreeRayScene, JaxRayScene]


small_chunks = pytest.fixture(shapes.small_chunks, scope="module", autouse=True)


@pytest.fixture(scope="module")
def soup():
    """Triangles anywhere, in float64, and rays: origins, directions."""
    rng = np.random.default_rng(7)
    return shapes.soup(rng), *rng.normal(size=(2, 1000, 3))


def mesh_of(vertices, dtype=np.float64) -> Mesh:
    faces = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    vertices = jnp.asarray(vertices, dtype)
    return Mesh(vertices, jnp.asarray(faces), jnp.zeros_like(vertices))


def check(scene, vertices, origins, directions, scale=1.0, shift=0.0):
    """Compare a scene that is scaled and moved with float64's answers for the unit one."""
    distance, face, weights = shapes.first_hits(
        vertices, np.arange(len(vertices)).reshape(-1, 3), origins, directions
    )
    hit = scene.closest_hit(origins * scale + shift, directions)
    assert 0.2 < (face >= 0).mean() < 0.9
    np.testing.assert_array_equal(hit.face, face)
    assert hit.distance.dtype == np.float32
    np.testing.assert_allclose(hit.distance / np.float64(scale), distance, rtol=2e-5, atol=1e-5)
    np.testing.assert_allclose(hit.barycentric, weights, rtol=0, atol=2e-4)
    limits = np.where(np.isinf(distance), 2, distance) * np.where(origins[:, 0] > 0, 0.999, 1.001)
    blocked = scene.occluded(origins * scale + shift, directions, limits * scale)
    np.testing.assert_array_equal(blocked, distance < limits)


@pytest.mark.parametrize("kind", SCENES)
@pytest.mark.parametrize("scale", [1e-30, 1e-18, 1e-15, 1e-9, 1e9, 1e15, 1e18, 1e30])
def test_scenes_of_any_size(soup, kind, scale):
    vertices, *rays = soup
    check(kind(mesh_of(vertices * scale)), vertices, *rays, scale=scale)
    check(kind(mesh_of(vertices * scale, np.float32)), vertices, *rays, scale=scale)


@pytest.mark.parametrize("kind", SCENES)
@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_scenes_far_from_the_origin(soup, kind, scale):
    """Ten million times their size away, in float64: float32 coordinates would be whole numbers."""
    vertices, *rays = soup
    shift = scale * np.array([1e7, -3e7, 0.5])
    check(kind(mesh_of(vertices * scale + shift)), vertices, *rays, scale=scale, shift=shift)


@pytest.mark.parametrize("kind", SCENES)
def test_rays_from_far_away(kind):
    """At a square, from up to 1e30 of its sides away; those that miss or lead away miss."""
    scene = kind(mesh_of(shapes.QUAD[0][shapes.QUAD[1]].reshape(-1, 3)))
    height = np.array([1e3, 1e6, 1e12, 1e20, 1e30])
    origins = np.stack([0.3 + 0 * height, 0.6 + 0 * height, height], axis=1)
    down = np.array([0.0, 0, -2])
    hit = scene.closest_hit(origins, down)
    assert hit.face.tolist() == [1] * 5
    np.testing.assert_allclose(hit.distance, height, rtol=1e-6)
    np.testing.assert_allclose(hit.barycentric, [[0.4, 0.3, 0.3]] * 5, rtol=0, atol=1e-4)
    assert scene.occluded(origins, down, 1.001 * height).all()
    assert not scene.occluded(origins, down, 0.999 * height).any()
    assert not scene.occluded(origins, -down).any()
    assert not scene.occluded(origins, down, -1.0).any()
    assert not scene.occluded(origins + np.array([1.5, 0, 0]), down).any()
    # Slanted, aimed at the middle in float64.
    origins = height[:3, None] * np.array([0.6, 0, 0.8]) + [0.5, 0.5, 0]
    assert scene.occluded(origins[:2], np.array([-0.6, 0, -0.8])).all()
    assert not scene.occluded(origins, np.array([-0.6, 1e-2, -0.8])).any()


def test_the_core_takes_the_coordinates_of_the_meshes(soup):
    """And directions of any length, whose lengths the distances count."""
    vertices, origins, directions = soup
    lengths = np.tile([1e-30, 1e-12, 1.0, 1e12, 1e30], len(origins) // 5)[:, None]
    scales = [1e-18, 1.0, 1e18]
    cast = jax.jit(trace)
    for scale in scales:
        tree = JaxRayScene(mesh_of(vertices * scale, np.float32)).tree
        unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        found = cast(
            tree,
            jnp.asarray(origins * scale, jnp.float32),
            jnp.asarray(unit * lengths, jnp.float32),
        )
        faces = np.arange(len(vertices)).reshape(-1, 3)
        distance, face, _ = shapes.first_hits(vertices, faces, origins, directions)
        np.testing.assert_array_equal(found.triangle, face)
        ours = np.asarray(found.distance, float) / scale * lengths[:, 0]
        # A distance that float32 cannot hold is infinite or zero.
        held = (scale / lengths[:, 0] > 1e-30) & (scale / lengths[:, 0] < 1e30)
        np.testing.assert_allclose(ours[held], distance[held], rtol=2e-5, atol=1e-5)


def test_powers_of_two_change_no_bit(soup):
    vertices, origins, directions = (x.astype(np.float32) for x in soup)
    for kind in SCENES:
        one = kind(mesh_of(vertices, np.float32)).closest_hit(origins, directions)
        for scale in (2.0**-60, 2.0**-15, 2.0**15, 2.0**60):
            scene = kind(mesh_of(vertices * np.float32(scale), np.float32))
            other = scene.closest_hit(origins * np.float32(scale), directions)
            for a, b in zip(one._replace(distance=one.distance * scale), other, strict=True):
                np.testing.assert_array_equal(a, b)


def test_ordinary_meshes_are_cast_as_they_are(soup):
    vertices = soup[0].astype(np.float32)
    for shift in (0, 5):
        points, _, frame = framed([mesh_of(vertices + np.float32(shift), np.float32)])
        assert frame.plain
        np.testing.assert_array_equal(points[0], vertices + np.float32(shift))
    # Farther away float32 loses nothing more: the difference to the center is exact.
    far = vertices + np.float32(12345)
    points, _, frame = framed([mesh_of(far, np.float32)])
    assert not frame.plain
    np.testing.assert_array_equal(points[0].astype(float) + frame.center, far.astype(float))


def test_meshes_with_origins_of_their_own_stand_where_they_stood():
    """Two files of one survey, each with its own origin taken off."""
    corners = shapes.QUAD[0][shapes.QUAD[1]].reshape(-1, 3)
    one = dataclasses.replace(mesh_of(corners, np.float32), origin=(4e5, 8e5, 100.0))
    two = dataclasses.replace(mesh_of(corners, np.float32), origin=(4e5 + 2, 8e5, 101.0))
    for kind in SCENES:
        scene = kind([one, two])
        hit = scene.closest_hit(np.array([[0.5, 0.4, 5], [2.5, 0.4, 5]]), np.array([0.0, 0, -1]))
        assert hit.mesh.tolist() == [0, 1]
        np.testing.assert_allclose(hit.distance, [5, 4], rtol=1e-6)


def test_a_point_and_nothing_make_a_frame():
    for corner in (np.zeros(3), np.array([3.0, 4e9, 5.0]), np.full(3, 1e-300)):
        frame = frame_around(corner, corner)
        assert np.abs(frame.into(corner[None])).max() <= 2**20
    assert framed([mesh_of(np.zeros((0, 3)))])[2].plain


@pytest.mark.parametrize("kind", SCENES)
def test_faces_of_no_vertex_are_refused(unchecked, kind):
    mesh = mesh_of(np.eye(3))
    broken = Mesh(mesh.vertices, jnp.array([[0, 1, 3]]), mesh.normals)
    with pytest.raises(ValueError, match="faces of mesh 1 name vertices 0 to 3, but it has 0 to 2"):
        kind([mesh, broken])
