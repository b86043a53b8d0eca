"""Radiance cubes by Embree and by JAX: the same, and what each kind of surface looks like."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from lights import rectangle

from jaxsh import harmonics
from jaxsh.geometry import make_mesh
from jaxsh.midrange import (
    EmissiveMesh,
    Polygon,
    Scene,
    Sphere,
    capture,
    project_cube,
    project_cube_with_gradient,
    taylor,
)
from jaxsh.sphere import project_lat_long, reconstruct_lat_long

# Cubes are projected at 64² texels and degree 2 throughout: one program of each form.
NIGHT = np.zeros((2, 4, 3))
RED, WHITE = np.array([1.0, 0, 0]), np.array([1.0, 1, 1])
STAR = np.array([[0, 0, 0], [1, -0.1, 0], [0.4, 0.3, 0], [0.9, 1, 0], [-0.2, 0.8, 0.0]])
LIGHT = rectangle([0.3, -0.2, 2], [0.6, 0.1, 0], [0, -0.5, 0.2])
BOX = make_mesh(
    np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1.0)]),
    np.array([
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]),
)  # fmt: skip


def assert_same(a, b, atol=1e-12, differ=0):
    """All but `differ` texels, through whose surfaces' edges a float32 ray may pass elsewhere."""
    same = np.isclose(a.distance, b.distance, rtol=1e-9)
    assert np.sum(~same) <= differ
    for name in ("radiance", "normal", "plane_distance"):
        first, second = (np.asarray(getattr(cube, name))[same] for cube in (a, b))
        np.testing.assert_allclose(first, second, rtol=0, atol=atol)


def test_embree_and_jax_see_the_same():
    emitters = [
        Polygon(LIGHT, WHITE),
        Polygon(STAR + np.array([-2, 1, 1]), RED, two_sided=True),
        Sphere(np.array([1.0, 1, 1]), np.array(0.4), RED),
    ]
    blockers = [
        Polygon(rectangle([0.3, 0.2, 1.2], [0.2, 0.1, 0], [0, -0.2, 0.1]), WHITE),
        Sphere(np.array([0, 0.8, 1]), np.array(0.2), WHITE),
    ]
    points = jnp.array([[0.1, 0.2, -0.1], [0, 0.8, 1.05], [-1, 1, 3]])
    assert_same(
        capture(Scene(emitters, blockers), points, 32),
        jax.jit(lambda p: capture(Scene(emitters, blockers), p, 32, rays="analytic"))(points),
        differ=5,
    )


def test_planes_distances_and_directions_agree():
    cube = capture(Scene([Polygon(LIGHT, WHITE)]), np.array([0.1, 0.2, -0.1]), 32)
    near = np.isfinite(cube.distance)
    s = np.asarray(cube.directions * cube.distance[:, None])[near]
    normal, corner = np.asarray(cube.normal)[near], LIGHT[0] - [0.1, 0.2, -0.1]
    np.testing.assert_allclose(
        np.sum(normal * s, -1), np.asarray(cube.plane_distance)[near], rtol=1e-13
    )
    np.testing.assert_allclose(np.sum(normal * (s - corner), -1), 0, rtol=0, atol=1e-13)
    assert (np.asarray(cube.plane_distance) < 0).all()
    assert near.any()
    assert not np.asarray(cube.radiance)[~near].any()
    np.testing.assert_allclose(np.sum(cube.solid_angles), 4 * np.pi, rtol=1e-14)


def test_solid_angles_are_exact():
    """Of a texel as a spherical quadrilateral: the sum of its angles less 2π."""
    cube = capture(Scene([], environment=NIGHT), jnp.zeros(3), 3, rays="analytic")
    corners = np.stack(np.meshgrid(*[np.linspace(-1, 1, 4)] * 2, indexing="ij"), -1)
    expected = []
    for i in range(3):
        for j in range(3):
            ring = [corners[i, j], corners[i + 1, j], corners[i + 1, j + 1], corners[i, j + 1]]
            ring = [np.append(p, 1) for p in ring]
            sides = [np.cross(ring[k - 1], ring[k]) for k in range(4)]
            sides = [side / np.linalg.norm(side) for side in sides]
            expected.append(sum(np.arccos(-sides[k - 1] @ sides[k]) for k in range(4)) - 2 * np.pi)
    np.testing.assert_allclose(cube.solid_angles, np.tile(expected, 6), rtol=1e-12)


@pytest.mark.slow
def test_inside_a_closed_light_only_the_mean_is_left():
    """The furnace: radiance from all sides, so no band but l = 0 and no gradient, by both forms."""
    inwards = EmissiveMesh(BOX, WHITE, two_sided=True)
    cube = capture(Scene([inwards]), np.array([0.2, -0.3, 0.4]), 64)
    c, surface = project_cube_with_gradient(cube, 2, gradient="surface")
    _, edges = project_cube_with_gradient(cube, 2)
    np.testing.assert_allclose(c[:, 0], np.sqrt(4 * np.pi), rtol=1e-12)
    # The texels' centres integrate no harmonic and no 1/r exactly, but jumps there are none.
    np.testing.assert_allclose(c[:, 1:], 0, rtol=0, atol=2e-4)
    np.testing.assert_allclose(surface, 0, rtol=0, atol=1.2e-2)
    np.testing.assert_array_equal(edges, 0)


def test_backs_and_insides_are_black_and_block():
    point = np.array([0.1, 0.2, -0.1])
    back = Scene([Polygon(LIGHT[::-1], WHITE)], environment=np.ones((8, 16, 3)))
    both = Scene([Polygon(LIGHT[::-1], WHITE, two_sided=True)])
    seen = np.isfinite(capture(back, point, 16).distance)
    np.testing.assert_array_equal(capture(back, point, 16).radiance[:, 0], 1.0 - seen)
    np.testing.assert_array_equal(capture(both, point, 16).radiance[:, 0], 1.0 * seen)
    outwards = capture(Scene([EmissiveMesh(BOX, WHITE)]), np.zeros(3), 8)
    assert not np.asarray(outwards.radiance).any()
    within = capture(Scene([Sphere(np.zeros(3), np.array(2.0), WHITE)]), point, 8)
    assert not np.asarray(within.radiance).any()
    met = point + np.asarray(within.directions * within.distance[:, None])
    np.testing.assert_allclose(np.linalg.norm(met, axis=-1), 2, rtol=1e-12)


def test_radiance_by_face():
    radiance = np.arange(36.0).reshape(12, 3)
    cube = capture(Scene([EmissiveMesh(BOX, radiance, two_sided=True)]), np.zeros(3), 8)
    up = np.asarray(cube.directions).argmax(axis=0)[2]
    np.testing.assert_array_equal(np.unique(np.asarray(cube.radiance)[:, 0]), radiance[:, 0])
    assert np.asarray(cube.radiance)[up, 0] in (30, 33)


def test_an_environment_alone_is_its_projection(rng):
    """Within the cube's error, and with no gradient."""
    coefficients = rng.normal(size=(3, 9))
    picture = reconstruct_lat_long(coefficients, 64, 128)
    cube = capture(Scene([], environment=picture), np.zeros(3), 64)
    c, gradient = project_cube_with_gradient(cube, 2, gradient="surface")
    np.testing.assert_allclose(c, project_lat_long(picture, 2), rtol=0, atol=3e-3)
    np.testing.assert_array_equal(gradient, 0)
    np.testing.assert_array_equal(project_cube_with_gradient(cube, 2, gradient="edges")[1], 0)


def test_a_small_sun_of_the_environment_is_not_missed():
    picture = np.zeros((256, 512, 3))
    picture[70, 100] = 1e4
    cube = capture(Scene([], environment=picture), np.zeros(3), 16)
    exact = project_lat_long(picture, 0)
    np.testing.assert_allclose(project_cube(cube, 0), exact, rtol=0.1)


def test_the_sky_is_the_same_by_both_kinds_of_rays(rng):
    scene = Scene([Sphere(np.array([0, 0, 2.0]), np.array(0.5), RED)], (), rng.random((8, 16, 3)))
    inside = jax.jit(lambda p: capture(scene, p, 8, rays="analytic").radiance)(jnp.zeros(3))
    np.testing.assert_array_equal(inside, capture(scene, np.zeros(3), 8).radiance)
    with pytest.raises(ValueError, match="environment must be known"):
        jax.jit(lambda sky: capture(Scene([], (), sky), np.zeros(3), 4, rays="analytic"))(
            jnp.ones((8, 16, 3))
        )


def test_a_scene_without_light_is_refused_and_a_dark_one_is_black():
    for blockers in ([], [BOX]):
        with pytest.raises(ValueError, match="expected emitters or an environment"):
            Scene([], blockers)
    night = Scene([], environment=NIGHT)
    for cube in (
        capture(night, np.zeros(3), 4),
        capture(night, jnp.zeros(3), 64, rays="analytic"),
    ):
        assert not np.asarray(taylor(cube, 2, 1).terms).any()


def test_a_point_on_the_light_s_plane_sees_nothing_of_it():
    light = Polygon(rectangle([2, 0, 0], [0.5, 0, 0], [0, 0.5, 0]), WHITE)
    for cube in (
        capture(Scene([light]), np.zeros(3), 64),
        capture(Scene([light]), jnp.zeros(3), 64, rays="analytic"),
        capture(Scene([light]), np.array([2.0, 0, 0]), 64),
    ):
        assert np.isfinite(taylor(cube, 2, 1).terms).all()
        assert np.isfinite(project_cube_with_gradient(cube, 2, gradient="edges")[1]).all()


def test_translation_and_rotation():
    """A quarter turn maps texels to texels, so here even the cube's error turns with it."""
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    away, point = np.array([0.25, -1, 0.5]), np.array([0.1, 0.2, -0.1])

    def seen(move, point):
        polygon = Polygon(move(LIGHT), WHITE)
        ball = Sphere(move(np.array([-1, 0.2, 0.5])), np.array(0.25), RED)
        return taylor(capture(Scene([polygon], [ball]), point, 64), 2, 1)

    here = seen(lambda x: x, point)
    there = seen(lambda x: x + away, point + away)
    turned = seen(lambda x: x @ turn.T, turn @ point)
    np.testing.assert_allclose(there.terms, here.terms, rtol=0, atol=1e-11)
    coefficients = harmonics.rotate(here.coefficients, turn)
    np.testing.assert_allclose(turned.coefficients, coefficients, rtol=0, atol=1e-11)
    gradient = jnp.moveaxis(here.gradient, -1, 0)
    gradient = jnp.einsum("ij,jck->cki", turn, harmonics.rotate(gradient, turn))
    np.testing.assert_allclose(turned.gradient, gradient, rtol=0, atol=1e-11)


def test_a_far_light_is_a_distant_one():
    """1/r of what it sends: a gradient that falls as the inverse of the distance."""
    terms = [
        taylor(capture(Scene([Polygon(LIGHT * size, WHITE)]), np.zeros(3), 64), 2, 1)
        for size in (1.0, 100.0)
    ]
    np.testing.assert_allclose(terms[1].coefficients, terms[0].coefficients, rtol=0, atol=1e-12)
    np.testing.assert_allclose(terms[1].gradient, terms[0].gradient / 100, rtol=0, atol=1e-12)


def test_batches_dtypes_and_repeated_captures():
    scene = Scene([Polygon(LIGHT, WHITE)])
    points = np.zeros((2, 3, 3)) + np.linspace(0, 0.2, 6).reshape(2, 3, 1)
    cube = capture(scene, points, 4, progress=False)
    assert cube.radiance.shape == (2, 3, 96, 3)
    assert cube.resolution == 4
    rays = scene.rays
    one = capture(scene, points[1, 2], 4)
    assert scene.rays is rays
    np.testing.assert_array_equal(cube.distance[1, 2], one.distance)
    single = Scene([Polygon(LIGHT.astype(np.float32), WHITE.astype(np.float32))])
    cube = capture(single, points, 4)
    assert {leaf.dtype for leaf in jax.tree.leaves(cube)} == {np.dtype(np.float32)}
    assert (
        capture(single, jnp.zeros(3, jnp.float32), 4, rays="analytic").plane_distance.dtype
        == np.float32
    )


def test_the_analytic_cube_differentiates_in_point_and_vertices():
    """Distances and planes do; which texel sees what does not, so c has no slope."""
    point = jnp.array([0.1, 0.2, -0.1])

    def measures(point, vertices):
        cube = capture(Scene([Polygon(vertices, WHITE)]), point, 4, rays="analytic")
        near = jnp.isfinite(cube.distance)
        return jnp.sum(jnp.where(near, cube.distance, 0)), jnp.sum(cube.radiance)

    light, h = jnp.asarray(LIGHT), 1e-6
    slopes, nothing = jax.jit(jax.jacrev(measures, argnums=(0, 1)))(point, light)
    for slope, move in (
        (slopes[0][2], lambda step: (point + jnp.array([0, 0, step]), light)),
        (jnp.sum(slopes[1][:, 2]), lambda step: (point, light.at[:, 2].add(step))),
    ):
        difference = measures(*move(h))[0] - measures(*move(-h))[0]
        np.testing.assert_allclose(slope, difference / (2 * h), rtol=1e-6)
    for slope in nothing:
        np.testing.assert_array_equal(slope, 0)


def test_refuses_what_is_no_scene_or_point(unchecked):
    scene = Scene([], environment=NIGHT)
    with pytest.raises(TypeError, match="expected emitters as all of Polygon"):
        Scene([BOX])
    with pytest.raises(ValueError, match="expected an environment"):
        Scene([], environment=np.zeros((4, 8)))
    with pytest.raises(ValueError, match="expected radiance"):
        EmissiveMesh(BOX, np.zeros((4, 3)))
    with pytest.raises(ValueError, match="takes polygons and spheres, got Mesh"):
        capture(Scene([], [BOX], NIGHT), np.zeros(3), 4, rays="analytic")
    with pytest.raises(ValueError, match="rays must be one of embree"):
        capture(scene, np.zeros(3), 4, rays="embre")
    with pytest.raises(ValueError, match="point must be finite"):
        capture(scene, np.array([0, np.nan, 0]))
    for shoot in (
        lambda p, r: capture(scene, p, r),
        lambda p, r: capture(scene, p, r, rays="analytic"),
    ):
        with pytest.raises(ValueError, match=r"expected point \(..., 3\)"):
            shoot(np.zeros(2), 4)
        with pytest.raises(ValueError, match="resolution must be an integer >= 1"):
            shoot(np.zeros(3), 0)
