"""Sphere lights, beside quadrature over the cap that they are seen as."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import harmonics
from jaxsh.midrange import (
    Sphere,
    sphere_harmonics,
    sphere_harmonics_with_gradient,
)

RADIANCE = np.array([1.0, 2, 0.5])


def cap_quadrature(center, radius, point, degree):
    s = center - point
    d = np.linalg.norm(s)
    low = np.sqrt(1 - (radius / d) ** 2)
    t, w = np.polynomial.legendre.leggauss(40)
    z, phi = (1 + low) / 2 + (1 - low) / 2 * t, np.arange(64) / 64 * 2 * np.pi
    frame, _ = np.linalg.qr(np.column_stack([s, np.eye(3)[:, :2] + 0.1]))
    axis = s / d
    ring = np.sqrt(1 - z * z)[:, None, None] * (
        np.cos(phi)[:, None] * frame[:, 1] + np.sin(phi)[:, None] * frame[:, 2]
    )
    weights = np.repeat(w * (1 - low) / 2 * 2 * np.pi / 64, 64)
    directions = (z[:, None, None] * axis + ring).reshape(-1, 3)
    return weights @ np.asarray(harmonics.evaluate(directions, degree))


@pytest.mark.parametrize("degree", [0, 10])
def test_sphere_is_the_integral_over_its_cap(rng, degree):
    center, radius = rng.normal(size=3), 0.7
    points = center + np.array([[0.1, 0.2, -0.8], [3, 1, 0], [-50, 20, 10]])
    sphere = Sphere(center, radius, RADIANCE)
    value, gradient = sphere_harmonics_with_gradient(sphere, points, degree)
    expected = [cap_quadrature(center, radius, p, degree) for p in points]
    np.testing.assert_allclose(value[:, 0], expected, rtol=0, atol=1e-13)
    np.testing.assert_allclose(value[:, 1], 2 * value[:, 0], rtol=0, atol=1e-14)
    np.testing.assert_array_equal(value, sphere_harmonics(sphere, points, degree))
    assert gradient.shape == (3, 3, (degree + 1) ** 2, 3)


@pytest.mark.slow
def test_sphere_s_gradient_is_its_derivative(rng):
    sphere = Sphere(rng.normal(size=3), 0.7, RADIANCE)
    point = sphere.center + jnp.asarray([0.5, 0.6, -0.8])

    def light(sphere, point):
        return sphere_harmonics(sphere, point, 4)

    _, gradient = sphere_harmonics_with_gradient(sphere, point, 4)
    by_sphere, by_point = jax.jacrev(light, (0, 1))(sphere, point)
    np.testing.assert_allclose(by_point, gradient, rtol=0, atol=1e-13)
    np.testing.assert_allclose(by_sphere.center, -gradient, rtol=0, atol=1e-13)
    by_sphere, by_point = jax.jacfwd(light, (0, 1))(sphere, point)
    np.testing.assert_allclose(by_point, gradient, rtol=0, atol=1e-13)
    h = 1e-5
    larger, smaller = (Sphere(sphere.center, 0.7 + d, RADIANCE) for d in (h, -h))
    difference = (light(larger, point) - light(smaller, point)) / (2 * h)
    np.testing.assert_allclose(by_sphere.radius, difference, rtol=0, atol=1e-8)


def test_sphere_far_away_keeps_its_digits_in_float32():
    sphere = Sphere(np.zeros(3), 1.0, RADIANCE)
    far = np.array([300.0, -4000, 1000])
    exact = sphere_harmonics(sphere, far, 4)
    single = sphere_harmonics(sphere, far.astype(np.float32), 4)
    assert single.dtype == jnp.float32
    np.testing.assert_allclose(single, exact, rtol=0, atol=5e-7 * float(jnp.abs(exact).max()))


def test_sphere_inside_and_other_mistakes(unchecked):
    sphere = Sphere(np.zeros(3), 1.0, RADIANCE)
    with pytest.raises(ValueError, match="2 points are inside"):
        sphere_harmonics(sphere, np.array([[0, 0, 0.5], [0, 0, 2], [0.1, 0, 0]]), 2)
    inside = jax.jit(lambda p: sphere_harmonics(sphere, p, 2))(jnp.asarray([0, 0, 0.5]))
    assert jnp.isnan(inside).all()
    with pytest.raises(ValueError, match="point"):
        sphere_harmonics(sphere, np.zeros(2), 2)
    with pytest.raises(ValueError, match="radius must be positive"):
        Sphere(np.zeros(3), 0.0, RADIANCE)
    with pytest.raises(ValueError, match="center must be finite"):
        Sphere(np.array([0, np.nan, 0]), 1.0, RADIANCE)
    with pytest.raises(ValueError, match="expected radiance"):
        Sphere(np.zeros(3), 1.0, np.ones(1))


def test_any_unit_of_length():
    """Powers of two about 1e-18 and 1e18 change no bit, in float32."""
    center, points = np.array([1.0, -2, 2], np.float32), np.array([[0.1, 0.2, 0], [9, 5, 1]])
    value, gradient = [], []
    for scale in np.float32([1, 2.0**-60, 2.0**60]):
        sphere = Sphere(scale * center, scale, RADIANCE)
        c, slope = sphere_harmonics_with_gradient(sphere, scale * points.astype(np.float32), 1)
        value, gradient = [*value, c], [*gradient, scale * slope]
    for found in (value, gradient):
        np.testing.assert_array_equal(found[1:], [found[0]] * 2)
        assert np.abs(found[0]).min() > 5e-5


def test_points_must_be_finite():
    with pytest.raises(ValueError, match="point must be finite"):
        sphere_harmonics(Sphere(np.zeros(3), 1.0, RADIANCE), np.array([np.nan, 2, 0]), 1)
