"""Visibility of compact sources against the share of a disc that a wall leaves."""

import dataclasses

import numpy as np
import pytest
from bodies import by_hand, points, rectangle, texels_at_vertices

from jaxsh.geometry import JaxRayScene, Points, knot, ray_scene
from jaxsh.sphere import Suns
from jaxsh.transfer import shade_sun, sun_visibility

RADIUS = 0.1


def sun(height, shape=None):
    """A disc over +x, its middle `height` above the horizon."""
    direction = [[np.cos(height), 0, np.sin(height)]]
    return Suns(direction, [4 * np.pi * np.sin(RADIUS / 2) ** 2], [[1.0, 1.0, 1.0]], shape)


def wall(elevation):
    """A wide wall at x = 1 that hides what is below an elevation, seen from around the origin."""
    return rectangle([1, -200, -1], [0, 400, 0], [0, 0, 1 + np.tan(elevation)])


def floor(count, rng):
    """Points close together, each with a pattern of its own."""
    positions = 1e-4 * rng.normal(size=(count, 3)) * [0, 1, 0]
    return points(positions, np.tile([0, 0, 1], (count, 1)))


def in_groups():
    """The disc as 64 vectors, four neighbors after four (Shirley & Chiu's map of a square)."""
    u, v, i, j = np.meshgrid(*[np.arange(n) for n in (4, 4, 2, 2)], indexing="ij")
    a, b = ((2 * (2 * u + i) + 1) / 8 - 1).ravel(), ((2 * (2 * v + j) + 1) / 8 - 1).ravel()
    wide = abs(a) > abs(b)
    radius = np.where(wide, a, b)
    phi = np.where(wide, np.pi / 4 * b / a, np.pi / 2 - np.pi / 4 * a / b) + 0.3
    height = radius**2 * 2 * np.sin(RADIUS / 2) ** 2
    sine = np.sign(radius) * np.sqrt(height * (2 - height))
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), 1 - height], -1)[None]


@pytest.mark.parametrize("share", [-0.9, -0.5, 0, 0.3, 0.8])
@pytest.mark.parametrize("shaped", [False, True])
def test_a_wall_leaves_its_share_of_the_disc(rng, share, shaped):
    """The edge of a wide wall is a great circle: the part beyond it is nearly a flat segment's."""
    elevation = 0.6
    above = sun(elevation - share * RADIUS, in_groups() if shaped else None)
    visibility = sun_visibility(above, floor(500, rng), ray_scene(wall(elevation)))
    assert visibility.seen.shape == (500, 1, 16)
    exact = (np.arccos(share) - share * np.sqrt(1 - share**2)) / np.pi
    fraction = np.asarray(visibility.fraction[:, 0])
    # At each point 4.5 % of a disc and 6 % of a shape at most, and less over many.
    most, bias = (0.062, 0.02) if shaped else (0.047, 0.004)
    assert np.sqrt(np.mean((fraction - exact) ** 2)) < most
    np.testing.assert_allclose(fraction.mean(), exact, rtol=0, atol=bias)


def test_points_and_texels_are_lit_as_vertices_are():
    mesh = knot(300)
    points = Points(mesh.vertices, mesh.normals)
    atlas = dataclasses.replace(texels_at_vertices(mesh), normals=mesh.normals)  # to the last bit
    expected = sun_visibility(sun(0.8), mesh).seen
    np.testing.assert_array_equal(sun_visibility(sun(0.8), atlas).seen, expected)
    np.testing.assert_array_equal(sun_visibility(sun(0.8), points, mesh).seen, expected)
    light = shade_sun(sun(0.8), mesh, albedo=0.5)
    np.testing.assert_array_equal(shade_sun(sun(0.8), points, mesh, albedo=0.5), light)
    np.testing.assert_array_equal(shade_sun(sun(0.8), atlas, albedo=0.5), light)
    with pytest.raises(ValueError, match="expected a scene for points, or those of a transfer"):
        sun_visibility(sun(0.8), points)
    with pytest.raises(ValueError, match="expected points with normals, of a surface"):
        sun_visibility(sun(0.8), Points(mesh.vertices), mesh)


def test_one_position_has_one_pattern_and_a_seed_its_bits(rng):
    mesh = knot(300)
    twice = by_hand(
        np.concatenate([mesh.vertices] * 2), mesh.faces, np.concatenate([mesh.normals] * 2)
    )
    light = sun(0.5)
    scene = ray_scene(mesh)
    visibility = sun_visibility(light, twice, scene, offset=1e-3)
    for name in ("seen", "draw"):
        halves = np.split(np.asarray(getattr(visibility, name)), 2)
        np.testing.assert_array_equal(*halves)
    assert len(np.unique(visibility.draw)) > 290
    other = sun_visibility(light, twice, scene, offset=1e-3, seed=1)
    assert (other.draw != visibility.draw).mean() > 0.9
    fraction = np.asarray(visibility.fraction)
    assert min((fraction == value).mean() for value in (0, 1)) > 0.1


class Counting:
    """A scene that counts its rays; of nothing, or what another one holds."""

    def __init__(self, scene=None):
        self.scene, self.rays = scene, 0

    def occluded(self, origins, directions, max_distance=np.inf):
        self.rays += len(origins)
        if self.scene is None:
            return np.zeros(len(origins), bool)
        return self.scene.occluded(origins, directions, max_distance)

    def closest_hit(self, origins, directions):
        raise AssertionError


def test_no_ray_leaves_for_a_sun_below(rng):
    for height, rays in ((-0.2, 0), (0, (500, 1100)), (0.2, 16 * 100)):
        scene = Counting()
        visibility = sun_visibility(sun(height), floor(100, rng), scene, offset=1e-3)
        least, most = rays if isinstance(rays, tuple) else (rays, rays)
        assert least <= scene.rays <= most
        assert int(visibility.seen.sum()) == scene.rays


@pytest.mark.parametrize("shaped", [False, True])
def test_of_many_rays_the_first_speak_for_the_rest_where_they_agree(rng, shaped):
    shape, elevation = in_groups() if shaped else None, 0.6
    for share, rays in ((-1.1, 16), (0.3, 64), (1.1, 16)):
        scene = Counting(ray_scene(wall(elevation)))
        above = sun(elevation - share * RADIUS, shape)
        visibility = sun_visibility(above, floor(200, rng), scene, rays=64, offset=1e-3)
        assert scene.rays == 200 * rays
        inside = np.clip(share, -1, 1)
        exact = (np.arccos(inside) - inside * np.sqrt(1 - inside**2)) / np.pi
        np.testing.assert_allclose(visibility.fraction, exact, rtol=0, atol=0.05)


@pytest.mark.slow
def test_rays_in_jax_see_the_same():
    mesh, light = knot(300), sun(0.4)
    one, other = (sun_visibility(light, mesh, s) for s in (ray_scene(mesh), JaxRayScene(mesh)))
    assert (one.seen != other.seen).mean() < 1e-3
