"""The integral over emitters: its own derivative, quadrature, and limits."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from lights import rectangle, surface_quadrature

from jaxsh import harmonics
from jaxsh.geometry import make_mesh
from jaxsh.midrange import (
    EmissiveMesh,
    Polygon,
    Sphere,
    SurfaceSamples,
    project_surface,
    project_surface_with_gradient,
    surface_samples,
)

LIGHT = rectangle([0.3, -0.2, 2], [0.6, 0.1, 0], [0, -0.5, 0.2])
RADIANCE = np.array([1.0, 2, 3])
POINT = jnp.array([0.1, 0.2, -0.1])


def every_kind():
    mesh = make_mesh(np.array([[0, 0, -1], [1, 0, -1], [0, 1, -1.0]]), np.array([[0, 1, 2]]))
    return surface_samples(
        [
            Polygon(LIGHT, RADIANCE, two_sided=True),
            Sphere(np.array([1.5, 0, 1]), np.array(0.3), RADIANCE),
            EmissiveMesh(mesh, np.array([[1.0, 0, 2]])),
        ],
        30,
    )


def test_analytic_gradient_is_the_derivative_of_the_sum():
    samples = every_kind()
    c, gradient = project_surface_with_gradient(samples, POINT, 4)
    exact = jax.jacfwd(lambda point: project_surface(samples, point, 4))(POINT)
    np.testing.assert_allclose(gradient, exact, rtol=0, atol=1e-14 * np.abs(exact).max())
    np.testing.assert_allclose(c, project_surface(samples, POINT, 4), rtol=0, atol=1e-15)


@pytest.mark.parametrize("turned", [False, True])
def test_a_rectangle_is_its_quadrature(turned):
    """The other side sees black unless both shine."""
    light = LIGHT[::-1] if turned else LIGHT
    for two_sided in (False, True):
        samples = surface_samples([Polygon(light, RADIANCE, two_sided)], 24**2)
        got = project_surface_with_gradient(samples, POINT, 4)
        exact = surface_quadrature(light, RADIANCE, POINT, 4, two_sided=two_sided)
        for a, b in zip(got, exact, strict=True):
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-13)


def test_a_concave_polygon_is_its_quadrature():
    star = np.array([[0, 0, 0], [1, -0.1, 0], [0.4, 0.3, 0], [0.9, 1, 0], [-0.2, 0.8, 0.0]])
    star = star - np.array([0.5, 0.5, 1.5])
    samples = surface_samples([Polygon(star, RADIANCE)], 20**2)
    got = project_surface_with_gradient(samples, POINT, 3)
    for a, b in zip(got, surface_quadrature(star, RADIANCE, POINT, 3), strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-13)


def test_a_far_sphere_is_a_distant_light():
    """Its solid angle times y, with the error of a disc's width."""
    samples = surface_samples([Sphere(np.array([0, 30.0, 40]), np.array(0.5), RADIANCE)], 4000)
    solid_angle = 2 * np.pi * (1 - np.sqrt(1 - (0.5 / 50) ** 2))
    basis = np.asarray(harmonics.evaluate(jnp.array([0, 0.6, 0.8]), 3))
    distant = solid_angle * np.outer(RADIANCE, basis)
    np.testing.assert_allclose(
        project_surface(samples, jnp.zeros(3), 3), distant, rtol=4e-3, atol=1e-6
    )


def test_batches_of_points_and_dtype():
    samples = every_kind()
    points = jnp.tile(POINT, (2, 1, 1))
    c, gradient = project_surface_with_gradient(samples, points, 2)
    one, slope = project_surface_with_gradient(samples, POINT, 2)
    assert c.shape == (2, 1, 3, 9)
    assert gradient.shape == (2, 1, 3, 9, 3)
    np.testing.assert_allclose(c[1, 0], one, rtol=0, atol=1e-14)
    np.testing.assert_allclose(gradient[1, 0], slope, rtol=0, atol=1e-13)
    single = jax.tree.map(lambda a: a.astype(jnp.float32), samples)
    assert project_surface(single, points, 2).dtype == jnp.float32


def test_samples_cover_the_areas():
    samples = every_kind()
    area = np.linalg.norm(np.cross(LIGHT[1] - LIGHT[0], LIGHT[2] - LIGHT[1]))
    np.testing.assert_allclose(np.sum(samples.areas), 2 * area + 4 * np.pi * 0.09 + 0.5, rtol=1e-13)


def test_refuses_what_gives_no_light_and_what_does_not_fit(unchecked):
    with pytest.raises(ValueError, match="needs an emitter that gives light"):
        surface_samples([], 4)
    with pytest.raises(ValueError, match="count must be an integer >= 1"):
        surface_samples([Polygon(LIGHT, RADIANCE)], 0)
    with pytest.raises(ValueError, match="expected n samples"):
        SurfaceSamples(np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(3), np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"expected point \(..., 3\)"):
        project_surface(every_kind(), jnp.zeros(2), 2)
