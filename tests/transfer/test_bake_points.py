"""Transfer at points, texels and in volumes, against vertices, closed forms and quadrature."""

import functools

import bodies
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh.geometry import Points, Texels, knot, ray_scene
from jaxsh.transfer import Transfer, bake

MESH = knot(500)
POINTS = Points(MESH.vertices, MESH.normals)
OPTIONS = {"directions": 128, "progress": False}


def baked(surface=POINTS, degree=2, **options) -> Transfer:
    return bake(surface, degree, **OPTIONS | options)


@functools.cache
def vertices(bounces: int) -> Transfer:
    return baked(MESH, bounces=bounces, albedo=0.8)


def relative(value, reference):
    value, reference = np.asarray(value), np.asarray(reference)
    return np.linalg.norm(value - reference) / np.linalg.norm(reference)


def texels_at_vertices(mesh) -> Texels:
    """One texel a vertex, in a corner of one of its faces."""
    faces = np.asarray(mesh.faces)
    _, first = np.unique(faces, return_index=True)
    count = len(mesh.vertices)
    return Texels(
        positions=mesh.vertices,
        normals=mesh.normals,
        uv=jnp.zeros((count, 2), jnp.float32),
        face=jnp.asarray(first // 3, jnp.int32),
        barycentric=jnp.asarray(np.eye(3)[first % 3], jnp.float32),
        source=jnp.arange(count, dtype=jnp.int32)[None],
        mesh=mesh,
        vertex=jnp.arange(count, dtype=jnp.int32),
    )


@pytest.mark.parametrize("bounces", [0, 2])
def test_points_and_texels_at_the_vertices_have_their_coefficients(bounces):
    """Rays start a little elsewhere, by which some that graze a face change sides."""
    expected = vertices(bounces)
    points = baked(scene=MESH, bounces=bounces, albedo=0.8)
    assert relative(points.coefficients, expected.coefficients) < 1e-6
    atlas = texels_at_vertices(MESH)
    at = baked(atlas, bounces=bounces, albedo=0.8)
    assert relative(at.coefficients, expected.coefficients) < 1e-6
    assert (points.surface, at.surface, at.cosine) == ("points", "texels", True)
    np.testing.assert_array_equal(at.neighbors, np.arange(len(MESH.vertices))[:, None])
    for made, surface in ((points, POINTS), (at, atlas)):
        np.testing.assert_array_equal(made.normals, surface.normals)
        assert made.belongs_to(surface)
        assert not made.belongs_to(Points(MESH.vertices))
        assert not made.belongs_to(Points(MESH.vertices + 1, MESH.normals))


def test_another_mesh_may_be_in_the_way():
    """Vertices of one mesh under the shadow and the bounces of another, as a mesh and as points."""
    roof = bodies.moved(bodies.box([-2, -2, -0.1], [2, 2, 0.1]), [0, 0, 1.5])
    got = baked(MESH, scene=roof, bounces=1, albedo=np.linspace(0.1, 0.9, len(roof.vertices)))
    alike = baked(scene=roof, bounces=1, albedo=np.linspace(0.1, 0.9, len(roof.vertices)))
    np.testing.assert_allclose(got.coefficients, alike.coefficients, rtol=0, atol=2e-6)
    alone = baked(MESH, scene=ray_scene(roof))
    assert relative(baked(MESH, scene=roof).coefficients, alone.coefficients) == 0
    assert relative(got.coefficients, alone.coefficients) > 0.01
    assert relative(baked(MESH, scene=MESH).coefficients, vertices(0).coefficients) == 0
