"""Transfer at texels, against closed forms, a finer surface and the vertices' transfer."""

import dataclasses

import bodies
import jax.numpy as jnp
import numpy as np
import pytest
from bodies import relative, texels_at, texels_at_vertices

from jaxsh.geometry import Mesh, Points, Surface, ray_scene, texels
from jaxsh.transfer import Transfer, bake, shade_diffuse


def baked(surface: Surface, **options) -> Transfer:
    return bake(surface, 2, **{"directions": 64, "progress": False} | options)


def test_texels_of_a_convex_body_have_no_shadow():
    """Their normals' horizon is not that of their faces, which are 30° wide here."""
    mesh, rng = bodies.ball(), np.random.default_rng(3)
    atlas = texels_at(mesh, rng.integers(len(mesh.faces), size=60), rng.dirichlet(np.ones(3), 60))
    got, exact = baked(atlas), baked(atlas, shadows=False)
    np.testing.assert_array_equal(got.coefficients, exact.coefficients)
    points = Points(atlas.positions, atlas.normals)  # off the faces themselves 1.5 % are lost
    lost = baked(points, scene=mesh, directions=256).coefficients
    assert 0.01 < relative(lost, exact.coefficients) < 0.03
    # Not through another surface that is nearer: a lining 1e-3 off, the curved surface up to 3e-2.
    lined = ray_scene([mesh, bodies.by_hand(1.001 * mesh.vertices, mesh.faces, mesh.normals)])
    with pytest.warns(UserWarning, match="60 of 60 texels see nothing"):
        assert not baked(atlas, scene=lined).coefficients.any()


def torus(rows: int, columns: int) -> Mesh:
    """Around z, of radii 1 and 1/2, with the torus's own normals."""
    around, across = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    u, v = 2 * np.pi * around / rows, 2 * np.pi * across / columns
    normals = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1)
    middle = np.stack([np.cos(u), np.sin(u), 0 * u], axis=-1)
    after, beside = (around + 1) % rows, (across + 1) % columns
    a, b, c, d = (
        (i * columns + j).ravel()
        for i, j in ((around, across), (after, across), (after, beside), (around, beside))
    )
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return bodies.by_hand((middle + normals / 2).reshape(-1, 3), faces, normals.reshape(-1, 3))


@pytest.mark.slow
def test_texels_of_a_coarse_torus_are_nearer_to_the_round_one_than_its_vertices():
    """Against points on the torus itself, among far finer faces."""
    coarse, rng = torus(24, 16), np.random.default_rng(1)
    atlas = texels_at(coarse, rng.integers(768, size=200), rng.dirichlet(np.ones(3), 200))
    places = np.asarray(atlas.positions, float)
    ring = places * [1, 1, 0]
    ring /= np.linalg.norm(ring, axis=1, keepdims=True)
    normals = places - ring
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    exact = baked(
        Points(jnp.asarray(ring + normals / 2, jnp.float32), jnp.asarray(normals, jnp.float32)),
        scene=torus(200, 100),
        directions=1024,
        offset=5e-4,
    ).coefficients
    by_texel = baked(atlas, directions=1024).coefficients
    by_vertex = atlas.carry(baked(coarse, directions=1024).coefficients)
    assert relative(by_texel, exact) < 0.011  # 1.05e-2 measured
    assert relative(by_vertex, exact) > 0.024  # 2.5e-2
    flat = baked(Points(atlas.positions, atlas.normals), scene=coarse, directions=1024)
    assert relative(by_texel, exact) < 0.9 * relative(flat.coefficients, exact)  # 0.86


OPENING = np.radians(60)


@pytest.mark.slow
def test_light_between_the_walls_of_a_bowl():
    """Inside of a sphere E_n = E_0 + albedo·F·E_{n-1}; a point at its center sees albedo/π·E."""
    bowl, share = bodies.bowl(OPENING, 12, 30), (1 + np.cos(OPENING)) / 2
    options = {"directions": 512, "bounces": 2, "albedo": 0.7}
    faces = np.arange(0, len(bowl.faces), 7)
    atlas = texels_at(bowl, faces, np.full((len(faces), 3), 1 / 3))
    got = np.asarray(baked(atlas, **options).coefficients)
    mean = np.asarray(baked(bowl, **options).coefficients)[np.asarray(bowl.faces)[faces]].mean(1)
    assert relative(got, mean) < 0.02  # 1.8e-2 measured: 640 facets
    series = 1 + 0.7 * share * (1 + 0.7 * share)
    np.testing.assert_allclose(
        got[:, 0].mean() * np.sqrt(4 * np.pi), np.pi * (1 - share) * series, rtol=2e-3
    )
    center = baked(Points(jnp.zeros((1, 3), jnp.float32)), scene=bowl, **options)
    gap = 2 * np.pi * (1 - np.cos(OPENING))
    wall = 0.7 * (1 - share) * (1 + 0.7 * share)  # its radiance, of light that met one wall or two
    np.testing.assert_allclose(
        float(center.coefficients[0, 0]) * np.sqrt(4 * np.pi),
        gap + (4 * np.pi - gap) * wall,
        rtol=4e-3,
    )


def test_texels_of_a_floor_under_a_wall():
    """A quarter of the sphere at each; a mesh of its own UV, whose rim is in the wall's plane."""
    floor = bodies.rectangle([0, -1, 0], [2, 0, 0], [0, 2, 0])
    uv = jnp.asarray([[0, 0], [1, 0], [1, 1], [0, 1]], jnp.float32)
    floor = dataclasses.replace(floor, uv=uv)
    wall = bodies.rectangle([0, -1e4, -1e4], [0, 2e4, 0], [0, 0, 2e4])
    atlas = texels(floor, 4)
    got = baked(atlas, scene=ray_scene([floor, wall]), directions=1024)
    exact = bodies.lune(0, np.pi / 2, 2)
    np.testing.assert_allclose(got.coefficients, [exact] * 16, rtol=0, atol=5e-3)  # 3.8e-3 measured
    light = jnp.zeros((3, 1), jnp.float32).at[:, 0].set((4 * np.pi) ** 0.5)
    picture = atlas.image(shade_diffuse(light, got, 1.0))
    np.testing.assert_allclose(picture, 0.5, rtol=0, atol=4e-3)  # 3.1e-3 measured
    on_rim = texels_at_vertices(floor)
    np.testing.assert_allclose(
        baked(on_rim, scene=ray_scene([floor, wall]), directions=1024).coefficients,
        [exact] * 4,
        rtol=0,
        atol=5e-3,
    )
