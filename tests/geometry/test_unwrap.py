"""Meshes without UV, which xatlas unwraps; and bilinear look-ups into what is written by texel."""

import dataclasses
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import ndimage
from shapes import square

from jaxsh import geometry
from jaxsh.geometry import BaseColor, Texels, _atlas


@pytest.fixture(scope="module")
def knot():
    pytest.importorskip("xatlas", reason="needs the package xatlas")
    return geometry.knot(300)


@pytest.fixture(scope="module")
def held(knot) -> Texels:
    return geometry.texels(knot, 128, gutter=1)


def corners(mesh: geometry.Mesh, name: str) -> np.ndarray:
    return np.asarray(getattr(mesh, name))[np.asarray(mesh.faces)]


def test_an_unwrapped_mesh_has_the_faces_of_the_one_given(knot, held):
    assert knot.uv is None
    np.testing.assert_array_equal(corners(held.mesh, "vertices"), corners(knot, "vertices"))
    np.testing.assert_array_equal(corners(held.mesh, "normals"), corners(knot, "normals"))
    np.testing.assert_array_equal(knot.vertices[held.vertex], held.mesh.vertices)
    assert (np.diff(held.vertex) >= 0).all()
    uv = np.asarray(held.mesh.uv)
    assert uv.dtype == np.float32
    assert uv.min() >= 1 / 128  # a gutter from the rim
    assert uv.max() <= 127 / 128


def test_its_texels_lie_on_it(knot, held):
    """A ray from outside along the face's normal arrives at each, in its face."""
    a, b, c = np.moveaxis(corners(knot, "vertices").astype(np.float64)[np.asarray(held.face)], 1, 0)
    across = np.cross(b - a, c - a)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    assert np.abs(((np.asarray(held.positions) - a) * across).sum(axis=1)).max() < 2e-7
    leans = np.einsum("nc,nc->n", across, np.asarray(held.normals))
    assert leans.min() > 0.2  # of a coarse mesh with smooth normals
    np.testing.assert_allclose(np.linalg.norm(held.normals, axis=1), 1, rtol=0, atol=2e-7)


def test_its_charts_do_not_overlap(knot, held):
    flat = corners(held.mesh, "uv").astype(np.float64) * 128
    covered = _atlas.cover(flat, 128, 128)
    assert not covered.overlapping.any()
    assert covered.flat == covered.hidden == 0


@pytest.mark.parametrize("resolution", [128, pytest.param((160, 96), marks=pytest.mark.slow)])
def test_a_gutter_of_one_serves_bilinear_look_ups(knot, held, resolution, rng):
    """Looked up anywhere on the surface, a picture of positions gives about the place itself."""
    held = held if resolution == 128 else geometry.texels(knot, resolution, gutter=1)
    face, weights = rng.integers(len(knot.faces), size=5000), rng.dirichlet([1, 1, 1], size=5000)
    places = np.einsum("nkc,nk->nc", corners(knot, "vertices")[face], weights)
    u, v = np.einsum("nkc,nk->nc", corners(held.mesh, "uv")[face], weights).T
    height, width = held.shape
    at = np.stack([(1 - v) * height - 0.5, u * width - 0.5])
    picture = np.asarray(held.image(held.positions, 100.0))  # background shows wherever it enters
    found = [
        ndimage.map_coordinates(picture[..., k], at, order=1, mode="grid-wrap") for k in range(3)
    ]
    away = np.linalg.norm(np.stack(found, axis=-1) - places, axis=1)
    texel = np.sqrt(surface(knot) / held.num_points)
    assert np.median(away) < 0.1 * texel
    assert away.max() < 2.5 * texel


def surface(mesh) -> float:
    a, b, c = np.moveaxis(corners(mesh, "vertices").astype(np.float64), 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


@pytest.mark.slow
def test_the_same_mesh_is_unwrapped_alike(knot, held):
    again = geometry.texels(knot, 128, gutter=1)
    for one, other in zip(jax.tree.leaves(held), jax.tree.leaves(again), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.slow
def test_the_size_of_a_mesh_does_not_matter(knot, held):
    small = dataclasses.replace(knot, vertices=1e-6 * knot.vertices)
    assert abs(geometry.texels(small, 128, gutter=1).num_points / held.num_points - 1) < 0.1


def test_values_of_the_mesh_given_are_taken_along(knot, held, unchecked):
    with pytest.raises(ValueError, match=r"those of the mesh given are values\[texels.vertex\]$"):
        held.carry(knot.vertices)
    carried = held.carry(knot.vertices[held.vertex])
    np.testing.assert_allclose(carried, held.positions, rtol=0, atol=2e-7)


def test_charts_without_room_are_said(knot):
    with pytest.warns(UserWarning, match="32 × 32 leave less than 2 between the .* charts"):
        geometry.texels(knot, 32)
    with pytest.raises(
        ValueError, match=r"expected a resolution at which the .* charts .* have ro"
    ):
        geometry.texels(knot, 2)


@pytest.mark.filterwarnings("error")
def test_a_mesh_with_normals_that_are_none_or_without_area(knot):
    expected = geometry.texels(square(), 16, unwrap=True)
    for wrong in (np.nan, np.inf, 0):
        mesh = dataclasses.replace(square(), normals=jnp.full((4, 3), wrong, jnp.float32))
        held = geometry.texels(mesh, 16, unwrap=True)
        np.testing.assert_array_equal(held.mesh.uv, expected.mesh.uv)
        np.testing.assert_array_equal(held.normals, expected.normals)  # those of the faces
    line = jnp.asarray([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]], jnp.float32)
    with pytest.raises(ValueError, match="expected a mesh with an area, got none on any face"):
        geometry.texels(dataclasses.replace(square(), vertices=line), 16, unwrap=True)
    # A single chart has no other beside it that look-ups could mix.
    assert geometry.texels(square(), 4, unwrap=True).num_points


def test_textures_stay_with_the_uv_that_they_belong_to(knot):
    brick = BaseColor("brick", (0.5, 0.2, 0.1, 1.0), jnp.zeros((2, 2, 4), jnp.uint8))
    mesh = dataclasses.replace(
        square(scale=(3.0, 3.0)),
        materials=(brick,),
        face_material=jnp.zeros(2, jnp.int32),
        colors=jnp.ones((4, 4), jnp.float32),
    )
    held = geometry.texels(mesh, 16, unwrap=True)
    (color,) = held.mesh.materials
    assert color.texture is None
    assert color.name == "brick"
    assert held.mesh.colors.shape == (4, 4)
    # The texture's own UV at the texels, by the faces and weights that hold for both.
    uv = np.einsum(
        "nkc,nk->nc", corners(mesh, "uv")[np.asarray(held.face)], np.asarray(held.barycentric)
    )
    np.testing.assert_allclose(uv, 3 * np.asarray(held.positions)[:, :2], rtol=0, atol=1e-6)


def test_without_xatlas_a_mesh_without_uv_is_refused(monkeypatch):
    monkeypatch.setitem(sys.modules, "xatlas", None)
    with pytest.raises(
        ImportError, match="the package xatlas, which cannot be imported here: `pip"
    ):
        geometry.texels(geometry.knot(300), 16)
    assert geometry.texels(square(), 4).num_points == 16
