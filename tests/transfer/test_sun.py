"""Shading by compact sources against quadrature, shading by harmonics, and finite differences."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from bodies import rectangle

from jaxsh.geometry import ray_scene
from jaxsh.sphere import Suns
from jaxsh.transfer import (
    Material,
    reflected_direction,
    sample,
    shade_diffuse,
    shade_glossy,
    shade_sun,
    sun_visibility,
    unshadowed,
)
from jaxsh.transfer._sun_disc import disc_irradiance, lobe_over_disc

EYE = np.array([0.4, -2.0, 3.0])


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def disc(radius):
    return 4 * np.pi * np.sin(radius / 2) ** 2


def inside(direction, radius, rings=160, steps=400):
    """Directions of a disc and their solid angles: Gauss–Legendre by area, even steps around."""
    nodes, weights = np.polynomial.legendre.leggauss(rings)
    height = (nodes + 1) * np.sin(radius / 2) ** 2
    phi = 2 * np.pi * (np.arange(steps) + 0.5) / steps
    frame = np.linalg.qr(np.column_stack([direction, np.eye(3)[:, :2]]))[0][:, 1:]
    around = np.stack([np.cos(phi), np.sin(phi)], axis=-1) @ frame.T
    lengths = np.sqrt(height * (2 - height))[:, None, None]
    directions = (1 - height)[:, None, None] * direction + lengths * around
    angles = np.repeat(weights / 2 * disc(radius) / steps, steps)
    return directions.reshape(-1, 3), angles


def suns(rng, *radii, shape=None):
    direction = unit(rng.normal(size=(len(radii), 3)) + np.array([0, 0, 1.5]))
    radiance = rng.uniform(1, 3, size=(len(radii), 3))
    return Suns(3 * direction, disc(np.array(radii)), radiance, shape)


def points(rng, count, dtype=np.float64):
    normals = unit(rng.normal(size=(count, 3)) + np.array([0, 0, 1]))
    return unshadowed(rng.normal(size=(count, 3)).astype(dtype), 2 * normals.astype(dtype), 0)


@pytest.mark.parametrize(
    ("dtype", "rtol"), [pytest.param(np.float32, 3e-6, marks=pytest.mark.slow), (np.float64, 2e-6)]
)
def test_irradiance_of_a_disc_that_the_horizon_cuts(dtype, rtol):
    for radius in (0.0047, 0.1, 0.8):
        heights = radius * np.array([-1.2, -0.9, -0.4, 0, 0.3, 0.95, 1.2])
        directions, angles = inside(np.array([0, 0, 1.0]), radius)
        normals = np.stack([np.cos(heights), 0 * heights, np.sin(heights)], axis=-1)
        exact = np.maximum(normals @ directions.T, 0) @ angles
        cosines = jnp.asarray(np.sin(heights), dtype)
        got = disc_irradiance(cosines, jnp.asarray(disc(radius), dtype))
        assert got.dtype == dtype
        np.testing.assert_allclose(got, exact, rtol=0, atol=rtol * np.pi * radius**2)


@pytest.mark.slow
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_lobe_over_a_disc(rng, dtype):
    """Wide and narrow lobes, whose axis lies beside, on or within the disc, also at the horizon.

    Bounds are those that the docstring of `shade_sun` states.
    """
    integrate = jax.jit(lobe_over_disc)
    for radius, if_cut in ((0.02, 3e-4), (0.15, 1e-3), (0.3, 2e-3), (1.4, 8e-3)):
        directions = unit(rng.normal(size=(6, 3)))
        normals = unit(rng.normal(size=(6, 3)))
        normals[::2] += rng.uniform(-1, 1, (3, 1)) * radius * directions[::2]
        normals[::2] -= np.sum(normals[::2] * directions[::2], 1, keepdims=True) * directions[::2]
        normals = unit(normals + 0.5 * radius * directions)
        exponents = np.array([3.0, 50, 2000, 3, 50, 2000])
        off = np.array([[0], [1], [0.1], [2], [0.3], [1]]) * radius
        axes = unit(directions + off * unit(rng.normal(size=(6, 3))))
        arguments = axes, normals, directions, np.full(6, disc(radius)), exponents
        got = np.diag(integrate(*(jnp.asarray(a, dtype) for a in arguments)))
        for i, k in enumerate(exponents):
            some, angles = inside(directions[i], radius)
            lobe = np.maximum(some @ axes[i], 0) ** k
            exact = angles @ (lobe * np.maximum(some @ normals[i], 0))
            most = min(disc(radius), 2 * np.pi / (k + 1))
            is_cut = abs(directions[i] @ normals[i]) < np.sin(radius)
            atol = most * (if_cut if is_cut else 3e-4)
            np.testing.assert_allclose(got[i], exact, rtol=0, atol=atol)


def test_shading_is_the_integral_of_the_picture_through_the_scene():
    """A floor behind a wall, lit by a sun that is painted on a picture of the sphere."""
    wall = rectangle([0, -9, 0], [0, 18, 0], [0, 0, 1.0])
    scene = ray_scene(wall)
    x = -np.linspace(0.6, 3.0, 9)
    made = unshadowed(np.stack([x, 0 * x, 0 * x], -1), np.tile([0.1, 0, 1.0], (9, 1)), 0)
    radius, direction = 0.3, unit(np.array([1.0, 0.2, 0.7]))
    height = 600
    theta = (np.arange(height) + 0.5) * np.pi / height
    theta, phi = np.meshgrid(theta, 2 * theta, indexing="ij")
    pixels = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    lit = pixels @ direction > np.cos(radius)
    directions, angles = pixels[lit], np.sin(theta[lit]) * 2 * (np.pi / height) ** 2
    color = np.array([3.0, 2.0, 1.0])
    material = Material(np.array([0.2, 0.3, 0.4]), 0.5, 30.0)
    exact = []
    axes = np.asarray(reflected_direction(EYE, made.positions, made.normals))
    for position, normal, axis in zip(made.positions, unit(made.normals), axes, strict=True):
        seen = ~scene.occluded(np.asarray(position, np.float32), directions.astype(np.float32))
        arriving = angles * seen * np.maximum(directions @ np.asarray(normal), 0)
        through = arriving @ np.maximum(directions @ axis, 0) ** 30.0 * 31 / (2 * np.pi)
        exact.append(color * (arriving.sum() * material.diffuse / np.pi + 0.5 * through))
    exact = np.stack(exact)
    assert exact[0].max() == 0 < exact[-1].min()  # from full shadow to light
    sun = Suns(direction[None], [disc(radius)], color[None])
    visibility = sun_visibility(sun, made, scene, rays=64)
    got = shade_sun(sun, made, visibility, material=material, eye=EYE)
    np.testing.assert_allclose(got, exact, rtol=0, atol=0.025 * exact.max())


@pytest.mark.slow
def test_a_scene_is_as_good_as_its_visibility(rng):
    wall = rectangle([0, -9, 0], [0, 18, 0], [0, 0, 1.0])
    scene, made, sun = ray_scene(wall), points(rng, 5), suns(rng, 0.1, 0.2)
    visibility = sun_visibility(sun, made, scene)
    np.testing.assert_array_equal(
        shade_sun(sun, made, scene, 0.5), shade_sun(sun, made, visibility, 0.5)
    )
    flat, diffuse = Material(0.5, 0.0, 30.0), shade_sun(sun, made, visibility, 0.5)
    glossy = shade_sun(sun, made, visibility, material=flat, eye=EYE)
    np.testing.assert_allclose(glossy, diffuse, rtol=1e-14, atol=0)
    np.testing.assert_array_equal(
        shade_sun(sun, wall, albedo=0.5), shade_sun(sun, wall, ray_scene(wall), 0.5)
    )


@pytest.mark.slow
@pytest.mark.parametrize("shaped", [False, True])
def test_units_are_those_of_shading_by_harmonics(rng, shaped):
    """At a degree that holds the discs: the same numbers but for what the degree cuts off."""
    degree = 16
    shape = None
    if shaped:
        shape = Suns([[0, 0, 1.0]] * 2, disc(np.array([0.5, 0.6])), np.ones((2, 3))).rays(64)
    sun = suns(rng, 0.5, 0.6, shape=shape)
    bare = points(rng, 4)
    made = unshadowed(bare.positions, bare.normals, degree)
    light = sun.harmonics(degree)
    material = Material(0.3, 0.6, 5.0)
    expected = shade_glossy(light, made, EYE, material)
    got = shade_sun(sun, made, material=material, eye=EYE, shadows=False)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(got, expected, rtol=0, atol=2e-3 * scale)
    got = shade_sun(sun, sample(made, 1), albedo=0.5, shadows=False)
    expected = shade_diffuse(light, made, 0.5)
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-3 * np.abs(expected).max())


def test_a_shape_is_the_sum_of_its_vectors(rng):
    shape = unit(np.array([0, 0, 1]) + 0.1 * rng.normal(size=(1, 12, 3)))
    sun, made = suns(rng, 0.1, shape=shape), points(rng, 6)
    directions = np.asarray(sun.rays())[0]
    floor = rectangle([-9, -9, 1.5], [18, 0, 0], [0, 9.3, 0])
    scene = ray_scene(floor)
    visibility = sun_visibility(sun, made, scene, rays=12)
    seen = np.stack([~scene.occluded(p, directions) for p in np.asarray(made.positions)])
    cosines = np.maximum(unit(made.normals) @ directions.T, 0)
    assert 0 < (seen & (cosines > 0)).mean() < 1
    exact = (seen * cosines).mean(1)[:, None] * sun.irradiance * 0.5 / np.pi
    got = shade_sun(sun, made, visibility, 0.5)
    np.testing.assert_allclose(got, exact, rtol=0, atol=1e-6)


def differentiated(sun, made, visibility, material):
    def shade(direction, solid_angle, radiance, eye, normals, diffuse, specular, exponent):
        given = Suns(direction, solid_angle, radiance)
        surface = unshadowed(made.positions, normals, 0)
        glossy = Material(diffuse, specular, exponent)
        return shade_sun(
            given, surface, visibility, material=glossy, eye=eye, shadows=visibility is not None
        )

    return shade, (
        sun.direction,
        sun.solid_angle,
        sun.radiance,
        jnp.asarray(EYE),
        made.normals,
        material.diffuse,
        material.specular,
        material.exponent,
    )


@pytest.mark.slow
def test_derivatives(rng):
    """In every argument, forward, reverse and by differences, with discs cut by the horizon."""
    made, material = points(rng, 4), Material(0.3, 0.5, 12.0)
    normals = np.asarray(made.normals)
    across = unit(np.cross(normals[:2], rng.normal(size=(2, 3))))
    sun = Suns(across + 0.04 * unit(normals[:2]), disc(np.array([0.15, 0.1])), [[3.0, 2, 1]] * 2)
    shade, arguments = differentiated(sun, made, None, material)
    steps = [jnp.asarray(rng.normal(size=a.shape)) * np.abs(a).max() for a in arguments]
    change = jax.random.normal(jax.random.key(0), (4, 3))

    @jax.jit
    def slopes(*arguments):
        _, forward = jax.jvp(shade, arguments, tuple(steps))
        _, pull = jax.vjp(shade, *arguments)
        return forward, pull(change)

    forward, reverse = slopes(*arguments)
    assert all(np.isfinite(x).all() and np.abs(x).max() > 0 for x in reverse)
    paired = sum(jnp.vdot(a, b) for a, b in zip(reverse, steps, strict=True))
    np.testing.assert_allclose(paired, jnp.vdot(forward, change), rtol=1e-11)
    values = jax.jit(shade)
    h = 1e-6
    low, high = (
        values(*(a + t * s for a, s in zip(arguments, steps, strict=True))) for t in (-h, h)
    )
    np.testing.assert_allclose(
        (high - low) / (2 * h), forward, rtol=0, atol=3e-7 * np.abs(forward).max()
    )


@pytest.mark.slow
def test_derivatives_of_the_disc_alone(rng):
    """By JAX's own derivative of a quadrature, where the horizon cuts and where it does not."""
    radius = 0.3
    heights = jnp.asarray(np.sin(radius * np.array([-0.8, 0.1, 0.7, 1.3])))
    got = jax.vmap(jax.grad(disc_irradiance, (0, 1)), (0, None))(heights, jnp.asarray(disc(radius)))
    nodes, weights = np.polynomial.legendre.leggauss(200)
    phi = 2 * np.pi * (np.arange(300) + 0.5) / 300

    def summed(cosine, solid_angle):
        height = jnp.asarray(nodes + 1)[:, None] / 2 * solid_angle / (2 * np.pi)
        sine = jnp.sqrt(1 - cosine**2) * jnp.sqrt(height * (2 - height)) * np.cos(phi)[None]
        return (
            solid_angle
            * jnp.mean(weights[:, None] * jnp.maximum(cosine * (1 - height) + sine, 0))
            * 100
        )

    exact = jax.vmap(jax.jacfwd(summed, argnums=(0, 1)), (0, None))(
        heights, jnp.asarray(disc(radius))
    )
    for a, b in zip(got, exact, strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=2e-4 * np.abs(b).max())


@pytest.mark.slow
def test_batches_of_radiance(rng):
    made, sun = points(rng, 3, np.float32), suns(rng, 0.1, 0.2)
    batch = jnp.asarray(rng.uniform(size=(2, 2, 3)))

    def shade(radiance):
        given = Suns(sun.direction, sun.solid_angle, radiance)
        return shade_sun(given, made, albedo=0.5, shadows=False)

    mapped = jax.vmap(shade)(batch)
    assert mapped.dtype == np.float32
    np.testing.assert_allclose(mapped, np.stack([shade(r) for r in batch]), rtol=1e-6)


def test_no_suns_give_nothing():
    """As `split_sun` finds none under an overcast sky."""
    none = Suns(np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)), np.zeros((0, 64, 3)))
    floor = rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0])
    np.testing.assert_array_equal(shade_sun(none, floor, albedo=0.5), np.zeros((4, 3)))


def test_undefined_normals_and_suns_below_give_nothing():
    normals = np.array([[0, 0, 0.0], [np.nan, 0, 1], [0, 0, -1], [0, 0, 1]])
    made = unshadowed(np.zeros((4, 3)), normals, 0)
    sun = Suns([[0.0, 0, 1]], [0.01], [[1.0, 1, 1]])
    material = Material(0.5, 0.5, 8.0)
    for shade in (
        functools.partial(shade_sun, albedo=0.5),
        functools.partial(shade_sun, material=material, eye=EYE),
    ):
        color = shade(sun, made, shadows=False)
        np.testing.assert_array_equal(color[:3], 0)
        assert (color[3] > 0).all()


def test_mistakes_are_told(rng, unchecked):
    made, sun, two = points(rng, 3), suns(rng, 0.1), suns(rng, 0.1, 0.2)
    floor = rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0])
    seen = sun_visibility(sun, floor, rays=4)
    material = Material(0.5, 0.5, 8.0)
    for call, said in (
        (lambda: shade_sun(sun, made, albedo=0.5), "expected a scene for points, or"),
        (lambda: shade_sun(sun, made, seen, 0.5), "3 vertices, but visibility is of 4"),
        (lambda: shade_sun(two, floor, seen, 0.5), "2 suns, but visibility is of 1"),
        (lambda: shade_sun(suns(rng, 0.1), floor, seen, 0.5), "suns of another direction"),
        (
            lambda: shade_sun(Suns(sun.direction, [0.02], sun.radiance), floor, seen, 0.5),
            "suns of another solid_angle",
        ),
        (lambda: shade_sun(sun, floor, seen, 0.5, shadows=False), "no scene with shadows=False"),
        (lambda: shade_sun(sun, floor), "got neither"),
        (lambda: shade_sun(sun, floor, seen, 0.5, material=material, eye=EYE), "got both"),
        (lambda: shade_sun(sun, floor, seen, material=material), "needs the eye"),
        (lambda: shade_sun(sun, floor, seen, 0.5, eye=EYE), "expected no eye"),
        (lambda: sun_visibility(sun, floor, rays=0), "rays must be an integer >= 1"),
        (
            lambda: sun_visibility(suns(rng, 0.1, shape=np.ones((1, 6, 3))), floor, rays=4),
            "rays must divide the 6 vectors",
        ),
        (
            lambda: shade_sun(Suns([[0, 0, 1.0]], [7.0], [[1.0, 1, 1]]), floor, albedo=0.5),
            "less than a hemisphere",
        ),
        (
            lambda: shade_sun(Suns([[0, 0, 0.0]], [0.1], [[1.0, 1, 1]]), floor, albedo=0.5),
            "a direction other than zero",
        ),
        (
            lambda: jax.jit(lambda s: shade_sun(s, floor, albedo=0.5))(sun),
            "got traced ones: this runs on the host",
        ),
    ):
        with pytest.raises(ValueError, match=said):
            call()
