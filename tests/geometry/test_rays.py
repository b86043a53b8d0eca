"""The ray scene against a slow twin and against scenes whose answer is known."""

import jax.numpy as jnp
import numpy as np
import pytest
import shapes
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxsh.geometry import EmbreeRayScene, _embree, knot, make_mesh


@pytest.fixture(scope="module")
def soup():
    """Triangles anywhere, each with its own vertices."""
    rng = np.random.default_rng(7)
    vertices = (rng.normal(size=(60, 1, 3)) + 0.5 * rng.normal(size=(60, 3, 3))).reshape(-1, 3)
    return make_mesh(vertices, np.arange(180).reshape(-1, 3))


def test_hits_equal_those_of_the_slow_twin(soup, rng):
    origins, directions = rng.normal(size=(2, 3000, 3)).astype(np.float32)
    hit = EmbreeRayScene(soup).closest_hit(origins, directions)
    distance, face, barycentric = shapes.first_hits(soup.vertices, soup.faces, origins, directions)
    np.testing.assert_array_equal(hit.face, face)
    np.testing.assert_array_equal(hit.mesh, np.where(face < 0, -1, 0))
    assert 0.2 < (face >= 0).mean() < 0.9
    # Float32 against float64: 1e-6 is usual, 8e-6 and 3e-5 the worst of several seeds (grazing).
    np.testing.assert_allclose(hit.distance, distance, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(hit.barycentric, barycentric, rtol=0, atol=5e-5)
    for array, dtype in zip(hit, (np.float32, np.int32, np.int32, np.float32), strict=True):
        assert type(array) is np.ndarray
        assert array.dtype == dtype


def test_occlusion_equals_that_of_the_slow_twin(soup, rng):
    scene = EmbreeRayScene(soup)
    origins, directions = rng.normal(size=(2, 3000, 3))
    distance, *_ = shapes.first_hits(soup.vertices, soup.faces, origins, directions)
    np.testing.assert_array_equal(scene.occluded(origins, directions), np.isfinite(distance))
    np.testing.assert_array_equal(scene.occluded(origins, directions, 0.5), distance < 0.5)
    limits = rng.uniform(0, 2, size=len(origins))
    np.testing.assert_array_equal(scene.occluded(origins, directions, limits), distance < limits)


def test_barycentrics_weigh_vertices_in_the_order_of_the_face():
    vertices = np.array([[0, 0, 1], [4, 0, 1], [0, 4, 1]], np.float32)
    mesh = make_mesh(vertices, np.array([[0, 1, 2]]))
    weights = np.array([[0.5, 0.375, 0.125], [0.125, 0.25, 0.625], [0.75, 0.125, 0.125]])
    points = weights @ vertices
    hit = EmbreeRayScene(mesh).closest_hit(points - [0, 0, 3], np.array([0.0, 0, 2]))
    np.testing.assert_allclose(hit.barycentric, weights, rtol=0, atol=1e-6)  # 6e-8 measured
    np.testing.assert_allclose(hit.distance, 3, rtol=1e-6)  # not 1.5: directions have no length


def test_a_point_above_the_middle_of_a_square_sees_the_sky_past_its_edges():
    scene = EmbreeRayScene(make_mesh(*shapes.QUAD))
    above = np.array([0.5, 0.5, 1.0])
    angle = np.linspace(0, np.pi / 2, 90, endpoint=False) + 0.5 * np.pi / 180
    directions = np.stack([np.sin(angle), 0 * angle, -np.cos(angle)], axis=1)
    np.testing.assert_array_equal(scene.occluded(above, directions), np.tan(angle) < 0.5)
    # From below it is as solid, and pointing away there is nothing.
    assert scene.occluded(above * [1, 1, -1], directions * [1, 1, -1])[0]
    assert not scene.occluded(above, -directions).any()


def test_max_distance_includes_what_lies_before_it():
    scene = EmbreeRayScene(make_mesh(*shapes.QUAD))
    origin, down = np.array([0.3, 0.6, 2.0]), np.array([0.0, 0.0, -0.1])
    assert scene.occluded(origin, down, 2.001).tolist() == [True]
    assert scene.occluded(origin, down, 1.999).tolist() == [False]
    assert scene.occluded(origin, down, 0.0).tolist() == [False]
    assert scene.occluded(origin, down).tolist() == [True]


def test_from_inside_a_closed_mesh_every_ray_hits(rng):
    """Also those through edges and vertices: no cracks."""
    vertices, faces = shapes.sphere(16, 32)
    scene = EmbreeRayScene(make_mesh(vertices, faces))
    middles = vertices[faces].mean(axis=1), vertices[faces[:, :2]].mean(axis=1), vertices
    directions = np.concatenate([*middles, rng.normal(size=(20_000, 3))])
    assert scene.occluded(np.zeros(3), directions).all()


def test_several_meshes_keep_their_own_numbers():
    vertices, faces = shapes.QUAD
    up = np.array([0, 0, 1], np.float32)
    scene = EmbreeRayScene([make_mesh(vertices + k * up, faces) for k in range(3)])
    origins = np.array([[0.7, 0.2, 2.5], [0.2, 0.7, 1.5], [0.7, 0.2, -1.0], [5.0, 5.0, 1.5]])
    directions = np.array([[0, 0, -1], [0, 0, 1], [0, 0, 1], [0, 0, 1]])
    hit = scene.closest_hit(origins, directions.astype(float))
    assert hit.mesh.tolist() == [2, 2, 0, -1]
    assert hit.face.tolist() == [0, 1, 0, -1]
    np.testing.assert_allclose(hit.distance, [0.5, 0.5, 1, np.inf], rtol=1e-6)
    np.testing.assert_array_equal(hit.barycentric[3], 0)


@pytest.mark.parametrize("kind", [np.asarray, jnp.asarray])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_one_vector_stands_for_all_and_any_array_will_do(soup, rng, kind, dtype):
    scene = EmbreeRayScene(soup)
    origins = kind(rng.normal(size=(200, 3)).astype(dtype))
    one = kind(np.array([0.3, -0.4, 0.8], dtype))
    many = kind(np.tile(np.asarray(one), (200, 1)))
    for ask in (scene.occluded, lambda *rays: scene.closest_hit(*rays).face):
        np.testing.assert_array_equal(ask(origins, one), ask(origins, many))
        np.testing.assert_array_equal(ask(one, origins), ask(many, origins))
        assert ask(one, one).shape == (1,)
        assert ask(origins[:0], one).shape == (0,)


@settings(max_examples=10)
@given(chunk=st.integers(1, 700), threads=st.integers(1, 5))
def test_chunks_and_threads_do_not_change_answers(chunk, threads):
    mesh = knot(1000)
    rng = np.random.default_rng(3)
    origins, directions = rng.normal(size=(2, 2000, 3)).astype(np.float32)
    whole = EmbreeRayScene(mesh)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_embree, "_CHUNK", (1, chunk))
        cut = EmbreeRayScene(mesh, threads=threads)
        occluded, hit = cut.occluded(origins, directions), cut.closest_hit(origins, directions)
    np.testing.assert_array_equal(occluded, whole.occluded(origins, directions))
    for a, b in zip(hit, whole.closest_hit(origins, directions), strict=True):
        np.testing.assert_array_equal(a, b)


def test_short_and_long_directions_are_directions():
    scene = EmbreeRayScene(make_mesh(*shapes.QUAD))
    down = np.array([0.0, 0.0, -1.0])
    for length in (1e-200, 1e-30, 1.0, 1e30, 1e200):
        hit = scene.closest_hit(np.array([0.3, 0.6, 2.0]), length * down)
        np.testing.assert_allclose(hit.distance, 2, rtol=1e-6)


@pytest.mark.parametrize(
    ("origins", "directions", "message"),
    [
        (np.zeros((4, 2)), np.ones(3), r"origins must have shape \(n, 3\) or \(3,\), got \(4, 2\)"),
        (np.zeros((4, 3)), np.float64(1), r"directions must have shape .* got \(\)"),
        (np.zeros((4, 3)), np.ones((5, 3)), r"origins \(4, 3\) and directions \(5, 3\)"),
        (np.zeros((4, 3)), np.zeros(3), r"ray 0 starts at .* towards \[0\.0, 0\.0, 0\.0\]"),
        (np.zeros(3), [[1, 0, 0], [np.nan, 0, 0]], "ray 1 .* towards .nan"),
        ([[0, 0, 0], [0, np.inf, 0]], np.ones(3), r"ray 1 starts at \[0\.0, inf, 0\.0\]"),
    ],
)
def test_bad_rays_are_refused(unchecked, soup, origins, directions, message):
    scene = EmbreeRayScene(soup)
    for ask in (scene.occluded, scene.closest_hit):
        with pytest.raises(ValueError, match=message):
            ask(np.asarray(origins), np.asarray(directions))


def test_bad_ray_is_named_across_chunks(soup):
    directions = np.ones((200_000, 3), np.float32)
    directions[123_456] = 0
    with pytest.raises(ValueError, match="ray 123456 "):
        EmbreeRayScene(soup).occluded(np.zeros(3), directions)


@pytest.mark.parametrize(
    ("limit", "message"),
    [(np.ones(4), r"\(5,\), one for each ray, got shape \(4,\)"), (np.nan, "NaN")],
)
def test_bad_limits_are_refused(unchecked, soup, limit, message):
    with pytest.raises(ValueError, match=message):
        EmbreeRayScene(soup).occluded(np.zeros((5, 3)), np.ones(3), limit)


def test_a_scene_needs_a_mesh(unchecked):
    with pytest.raises(ValueError, match="at least one mesh"):
        EmbreeRayScene([])
