"""Bounces baked into the transfer, where they are known: inside of a spherical bowl."""

import bodies
import numpy as np
import pytest

from jaxsh.geometry import Mesh, ray_scene
from jaxsh.transfer import bake

OPENING = np.radians(60)
# From any point of a sphere's inside every other part of it has the form factor of its area.
SURFACE = (1 + np.cos(OPENING)) / 2


def irradiance(mesh, **options):
    """Of a uniform sky of radiance 1."""
    transfer = bake(mesh, 2, directions=512, progress=False, **options)
    return np.asarray(transfer.coefficients)[:, 0] * np.sqrt(4 * np.pi)


@pytest.mark.parametrize("albedo", [0.5, 0.9])
def test_a_bowl_under_a_uniform_sky_follows_the_geometric_series(albedo):
    """E_0 = π(1 - F), E_n = E_0 + albedo·F·E_{n-1}, which ends at π(1 - F)/(1 - albedo·F)."""
    mesh = bodies.bowl(OPENING, 16, 40)
    for bounces in (0, 1, 3):
        # 2e-3 measured of the mean, which 640 facets explain; 6e-2 at the worst vertex.
        series = sum((albedo * SURFACE) ** k for k in range(bounces + 1))
        exact = np.pi * (1 - SURFACE) * series
        got = irradiance(mesh, bounces=bounces, albedo=albedo)
        np.testing.assert_allclose(got.mean(), exact, rtol=5e-3)
        np.testing.assert_allclose(got, exact, rtol=0.07)


def test_bounces_converge_to_the_end_of_the_series():
    mesh = bodies.bowl(OPENING, 8, 20)
    exact = np.pi * (1 - SURFACE) / (1 - 0.5 * SURFACE)
    before, last = (irradiance(mesh, bounces=n, albedo=0.5).mean() for n in (11, 12))
    np.testing.assert_allclose(last, exact, rtol=0.02)
    assert 0 < last - before < exact * 0.5**11


def test_albedo_may_differ_by_vertex():
    mesh = bodies.bowl(OPENING, 8, 20)
    uniform = irradiance(mesh, bounces=2, albedo=0.7)
    each = irradiance(mesh, bounces=2, albedo=np.full(len(uniform), 0.7))
    np.testing.assert_array_equal(each, uniform)
    black = irradiance(mesh, bounces=2, albedo=np.zeros(len(uniform)))
    np.testing.assert_array_equal(black, irradiance(mesh))


def test_a_floor_gets_the_wall_s_light_by_its_form_factor():
    """One bounce from a wall of known radiance: E_1 - E_0 = albedo·E_wall·F, no other bounce."""
    wall = bodies.rectangle([0, -1e3, 0], [0, 2e3, 0], [0, 0, 1e3])
    floor = bodies.points([[1, 0, 0], [2, 0, 0]], [[0, 0, 1]] * 2)
    mesh = bodies.by_hand(
        np.concatenate([wall.vertices, floor.vertices]),
        wall.faces,
        np.concatenate([wall.normals, floor.normals]),
    )
    for faces, share in ((mesh.faces, 0.6), (mesh.faces[:, ::-1], 0.0)):  # front, back
        turned = Mesh(mesh.vertices, faces, mesh.normals)
        direct, bounced = (
            irradiance(turned, bounces=n, albedo=0.6, ray_bias=1e-6)[-2:] for n in (0, 1)
        )
        # Nothing is before the wall, whose irradiance is π; to the floor it is half of the sky.
        np.testing.assert_allclose(direct, np.pi / 2, rtol=0.012)  # 1.05e-2 measured
        np.testing.assert_allclose(bounced - direct, share * np.pi / 2, rtol=0, atol=0.01)


def test_other_meshes_of_the_scene_reflect_nothing():
    mesh = bodies.bowl(OPENING, 8, 20)
    lining = bodies.by_hand(0.999 * mesh.vertices, mesh.faces, mesh.normals)
    options = {"scene": ray_scene([mesh, lining]), "ray_bias": 2e-3}
    # Rays that slip between the rims add 0.3 % at one vertex; all of the bowl would add 35 %.
    np.testing.assert_allclose(
        irradiance(mesh, bounces=1, **options), irradiance(mesh, **options), rtol=5e-3
    )
