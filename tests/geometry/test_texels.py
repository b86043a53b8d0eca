"""Texels of an atlas: places, gutters, and what is refused."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from shapes import QUAD, first_hits, square

from jaxsh import geometry
from jaxsh.geometry import _atlas, _texels


def with_uv(vertices, faces, uv):
    """A mesh in z = 0; of arrays as they are, since `make_mesh` compiles for each shape."""
    vertices, uv = np.asarray(vertices, np.float32), np.asarray(uv, np.float32)
    up = np.broadcast_to(np.array([0, 0, 1], np.float32), vertices.shape)
    return geometry.Mesh(*map(jnp.asarray, (vertices, faces, up, uv)))


def centers(width, height):
    """The u and v of each texel, (h, w, 2)."""
    u, v = (np.arange(width) + 0.5) / width, 1 - (np.arange(height) + 0.5) / height
    return np.stack(np.meshgrid(u, v), axis=-1)


def test_texels_of_a_square_are_its_grid():
    held = geometry.texels(square(), (5, 3))
    wanted = centers(5, 3).reshape(-1, 2)
    np.testing.assert_allclose(held.positions[:, :2], wanted, rtol=0, atol=6e-8)
    np.testing.assert_allclose(held.uv, wanted, rtol=0, atol=6e-8)
    np.testing.assert_array_equal(held.normals, np.tile([0, 0, 1], (15, 1)))
    np.testing.assert_array_equal(held.source, np.arange(15).reshape(3, 5))
    assert held.shape == (3, 5)
    assert held.num_points == 15
    assert held.positions.dtype == np.float32
    assert {held.face.dtype, held.source.dtype, held.vertex.dtype} == {np.dtype(np.int32)}


def test_each_center_is_in_the_face_that_a_ray_meets(rng):
    """Triangles of all shapes, laid out in a grid of cells, looked down upon from above."""
    side = 6
    cell = np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 1, 2)
    flat = (cell + rng.uniform(size=(side**2, 3, 2))).reshape(-1, 2) / side
    flat = flat.astype(np.float32).astype(np.float64)
    above = np.concatenate([flat, rng.normal(size=(len(flat), 1))], axis=1)
    faces = np.arange(len(flat)).reshape(-1, 3)
    mesh = geometry.Mesh(
        jnp.asarray(above), jnp.asarray(faces), jnp.asarray(above) * 0 + 1, jnp.asarray(flat)
    )
    held = geometry.texels(mesh, (64, 48), gutter=0)

    rays = centers(64, 48).reshape(-1, 2)
    origins = np.concatenate([rays, np.full((len(rays), 1), 9.0)], axis=1)
    distance, face, weights = first_hits(
        above, faces, origins, np.tile([0.0, 0, -1], (len(rays), 1))
    )
    # A face that has no center has one texel, which no ray met.
    given = np.asarray(held.source).ravel()
    met = face >= 0
    small = np.setdiff1d(np.arange(len(faces)), face)
    np.testing.assert_array_equal(np.sort(np.asarray(held.face)[given[(given >= 0) & ~met]]), small)
    np.testing.assert_array_equal(np.asarray(held.face)[given[met]], face[met])
    at = np.asarray(held.positions)[given[met]]
    # 1e-14 measured.
    np.testing.assert_allclose(at[:, 2], 9 - distance[met], rtol=0, atol=1e-13)
    np.testing.assert_allclose(at[:, :2], rays[met], rtol=0, atol=1e-14)
    np.testing.assert_allclose(
        np.asarray(held.barycentric)[given[met]], weights[met], rtol=0, atol=1e-13
    )
    np.testing.assert_allclose(np.linalg.norm(held.normals, axis=1), 1, rtol=0, atol=1e-15)


def test_blocks_change_nothing(monkeypatch):
    whole = geometry.texels(square(scale=(0.8, 0.7), offset=(0.1, 0.1)), (17, 13))
    monkeypatch.setattr(_atlas, "_BLOCK", 7)
    monkeypatch.setattr(_texels, "_BLOCK", 7)
    again = geometry.texels(square(scale=(0.8, 0.7), offset=(0.1, 0.1)), (17, 13))
    for one, other in zip(jax.tree.leaves(whole), jax.tree.leaves(again), strict=True):
        np.testing.assert_array_equal(one, other)


def test_gutters_show_the_nearest_texel():
    held = geometry.texels(square(scale=(0.25, 0.5), offset=(0.5, 0.25)), 12, gutter=2)
    covered = np.zeros((12, 12), bool)
    covered[3:9, 6:9] = True
    source = np.asarray(held.source)
    np.testing.assert_array_equal(source[covered], np.arange(18))
    own = np.argwhere(covered)
    for row, column in np.argwhere(~covered):
        away = np.linalg.norm(own - [row, column], axis=1)
        near = np.flatnonzero(away == away.min())
        if np.abs(own - [row, column]).max(axis=1).min() <= 2:
            assert source[row, column] in near
        else:
            assert source[row, column] == -1


def test_images_and_carried_values_differentiate(rng):
    held = geometry.texels(square(scale=(0.5, 1.0)), (6, 4), gutter=1)
    values = jnp.asarray(rng.normal(size=(held.num_points, 2)))
    image = held.image(values, jnp.array([7.0, 8.0]))
    source = np.asarray(held.source)
    np.testing.assert_array_equal(image[source < 0], np.tile([7.0, 8.0], (8, 1)))
    np.testing.assert_array_equal(image[source >= 0], np.asarray(values)[source[source >= 0]])
    # Each value counts as often as the picture shows it.
    shown = jax.grad(lambda values: jnp.sum(held.image(values)))(values)
    np.testing.assert_array_equal(shown[:, 0], np.bincount(source[source >= 0]))

    at_vertices = jnp.asarray(rng.normal(size=(4, 2)))
    carried, back = jax.vjp(held.carry, at_vertices)
    weights = np.zeros((held.num_points, 4))
    corners = np.asarray(held.mesh.faces)[np.asarray(held.face)]
    np.put_along_axis(weights, corners, np.asarray(held.barycentric, np.float64), axis=1)
    np.testing.assert_allclose(carried, weights @ at_vertices, rtol=0, atol=1e-15)
    np.testing.assert_allclose(back(carried)[0], weights.T @ carried, rtol=0, atol=1e-14)
    np.testing.assert_allclose(held.carry(held.mesh.vertices), held.positions, rtol=0, atol=6e-8)


def test_a_face_too_small_for_a_center_gets_a_texel_of_its_own():
    # A needle beside the rim of the square, in no center of 4 × 4 texels.
    vertices = np.concatenate([QUAD[0], [[2, 0, 0], [3, 0, 0], [3, 1, 0]]])
    uv = np.concatenate([0.5 * QUAD[0][:, :2], [[0.80, 0.8], [0.82, 0.8], [0.82, 0.82]]])
    mesh = with_uv(vertices, np.concatenate([QUAD[1], [[4, 5, 6]]]), uv)
    held = geometry.texels(mesh, 4, gutter=0)
    assert held.num_points == 5
    assert held.face[0] == 2
    assert held.source[0, 3] == 0
    np.testing.assert_allclose(held.positions[0], [8 / 3, 1 / 3, 0], rtol=0, atol=3e-7)
    np.testing.assert_allclose(held.uv[0], uv[4:].mean(axis=0), rtol=0, atol=1e-7)


def test_faces_and_charts_that_no_texel_shows_are_counted():
    vertices = np.concatenate([QUAD[0], QUAD[0] + [2, 0, 0], QUAD[0] + [4, 0, 0]])
    flat = QUAD[0][:, :2]
    uv = np.concatenate([flat, 0.01 * flat + 0.6, 0 * flat])  # the second's chart lies in a texel
    faces = np.concatenate([QUAD[1], QUAD[1] + 4, QUAD[1] + 8])
    mesh = with_uv(vertices, faces, uv)
    message = (
        "^texels: 2 faces have no area in UV and are on no texel, 1 charts are smaller than a "
        "texel and show what is beside them$"
    )
    with pytest.warns(UserWarning, match=message):
        held = geometry.texels(mesh, 4)
    assert set(np.asarray(held.face).tolist()) == {0, 1}


def test_a_normal_that_cancels_is_that_of_the_face():
    mesh = square()
    opposed = jnp.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, 0, 1]], jnp.float32)
    held = geometry.texels(dataclasses.replace(mesh, normals=opposed), 1)
    np.testing.assert_array_equal(held.normals, [[0, 0, 1]])


@pytest.mark.parametrize(
    ("mesh", "options", "message"),
    [
        (square(scale=(2, 1)), {}, r"UV of the mesh within 0 to 1, .* got 0 to 2 and 0 to 1: unwr"),
        (square(scale=(0, 1)), {}, "UV of the mesh with an area, got none on any face"),
        (square(offset=(np.nan, 0)), {}, "UV of the mesh that are finite, got none"),
        (
            dataclasses.replace(square(), vertices=jnp.full((4, 3), jnp.nan, jnp.float32)),
            {},
            "the mesh has 4 NaN or infinite vertices",
        ),
        (square(), {"resolution": 0}, "resolution must be an integer >= 1, got 0"),
        (square(), {"resolution": (4, 4, 4)}, "resolution as an integer or as width and height"),
        (square(), {"resolution": 40_000}, "resolution must be at most 32,768"),
        (square(), {"gutter": -1}, "gutter must be an integer >= 0, got -1"),
    ],
)
def test_what_has_no_texels_is_refused(unchecked, mesh, options, message):
    with pytest.raises(ValueError, match=message):
        geometry.texels(mesh, **{"resolution": 8, **options})


def test_uv_that_overlap_are_refused():
    """Two quads, where two of four texels in both lie on the diagonal of one."""
    vertices = np.concatenate([QUAD[0], QUAD[0] + [2, 0, 0]])
    uv = np.concatenate([QUAD[0][:, :2], [0.01, 0] + 0.5 * QUAD[0][:, :2]])
    mesh = with_uv(vertices, np.concatenate([QUAD[1], QUAD[1] + 4]), uv)
    with pytest.raises(
        ValueError, match="overlap, got 2 of 16 texels in several faces, first at ro"
    ):
        geometry.texels(mesh, 4)


def test_faces_that_share_an_edge_through_centers_do_not_overlap():
    held = geometry.texels(square(), 8)  # the diagonal runs through eight centers
    diagonal = np.asarray(held.face)[np.asarray(held.source)[np.arange(8), 7 - np.arange(8)]]
    np.testing.assert_array_equal(diagonal, 0)


def test_values_of_a_wrong_number_are_refused(unchecked):
    held = geometry.texels(square(), 2)
    with pytest.raises(ValueError, match=r"values \(4, c\), one row per vertex .* shape \(3, 2\)$"):
        held.carry(np.zeros((3, 2)))
    with pytest.raises(ValueError, match=r"values \(4, c\), one row per texel, got shape \(4,\)"):
        held.image(np.zeros(4))
    with pytest.raises(ValueError, match=r"background as a number or \(2,\), got shape \(3,\)"):
        held.image(np.zeros((4, 2)), np.zeros(3))
