"""The sun's disc: its harmonics against quadrature, its radiance against a loop and the sky."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from second_derivation import attenuated_sun, xyz_to_srgb
from suns import sun_at

from jaxsh import harmonics, sky
from jaxsh.sky._sun import (
    OZONE,
    SOLAR_RADIANCE,
    WATER,
    WAVELENGTHS,
    color_matching,
    optical_mass,
)

SOLID_ANGLE = 4 * math.pi * math.sin(sky.SUN_RADIUS / 2) ** 2


def test_harmonics_are_radiance_times_the_disc():
    sun, turbidity = sun_at(np.array([80.0, 20.0]), 20.0), np.array([2.0, 4.0])
    found = np.asarray(sky.sun_harmonics(sun, turbidity, 4))
    radiance = np.asarray(sky.sun_radiance(sun, turbidity))
    disc = harmonics.convolve(harmonics.evaluate(sun, 4), harmonics.disc(SOLID_ANGLE, 4))
    expected = np.einsum("nc,nk->nck", radiance, disc)
    np.testing.assert_allclose(found, expected, 1e-13)
    irradiance = np.asarray(sky.horizontal_irradiance(found))
    # The mean cosine over a small disc: cos θ · cos²(ρ/2).
    exact = radiance * SOLID_ANGLE * (sun[:, 2] * math.cos(sky.SUN_RADIUS / 2) ** 2)[:, None]
    np.testing.assert_allclose(irradiance, exact, 1e-12)
    assert pytest.approx(6.80e-5, rel=1e-3) == SOLID_ANGLE


@pytest.mark.parametrize(("elevation", "turbidity"), [(90, 2.0), (30, 2.5), (5, 4.0), (0, 6.0)])
def test_radiance_against_a_loop(elevation, turbidity):
    xyz = attenuated_sun(
        elevation, turbidity, WAVELENGTHS, SOLAR_RADIANCE, OZONE, WATER, color_matching()
    )
    found = sky.sun_radiance(sun_at(elevation), turbidity, space="xyz")
    np.testing.assert_allclose(found, xyz, 1e-11)
    srgb = sky.sun_radiance(sun_at(elevation), turbidity)
    np.testing.assert_allclose(srgb, xyz_to_srgb(xyz), 0, 1e-8 * xyz.max())


def test_published_illuminances():
    """Solar illuminance constant 133.1 klx (127.5 before 1990: Darula et al. 2005), and about 100
    klx at most through a clear sky."""
    luminance = 0.683 * 10 * color_matching()[1] @ SOLAR_RADIANCE
    assert 125 < luminance * SOLID_ANGLE < 135
    clear = sky.sun_radiance(sun_at(90.0), 2.0, space="xyY")
    assert 95 < clear[2] * SOLID_ANGLE < 105
    hazy = sky.sun_radiance(sun_at(90.0), np.array([2.0, 4.0, 6.0]), space="xyY")[:, 2]
    assert np.all(np.diff(hazy) < 0)
    # The color of direct sunlight: near 5,600 K at noon, and orange and then red at sunset.
    np.testing.assert_allclose(clear[:2], [0.330, 0.340], 0, 0.005)
    low = sky.sun_radiance(sun_at(np.array([30.0, 10.0, 2.0])), 2.5, space="xyY")
    assert np.all(np.diff(low[:, 0]) > 0.04)


def test_the_color_matching_is_the_observers():
    """ȳ peaks with one at 555 nm; the equal-energy spectrum is white, and 106.857 its sum."""
    assert WAVELENGTHS[np.argmax(color_matching()[1])] in (550, 560)
    np.testing.assert_allclose(10 * color_matching().sum(axis=1), 106.857, 2e-3)


def test_optical_mass():
    """Kasten 1965: 1 overhead, 2 near 60 degrees, 10.3 at 85, and finite on the horizon."""
    theta = jnp.radians(jnp.array([0.0, 60.0, 85.0, 90.0]))
    mass = optical_mass(theta, jnp.cos(theta))
    np.testing.assert_allclose(mass, [1.0, 1.993, 10.32, 36.51], 1e-3)


def test_no_sun_below_the_horizon():
    found = sky.sun_radiance(sun_at(np.array([-0.5, -30.0])), 3.0, check="allow")
    np.testing.assert_array_equal(found, 0.0)
    with pytest.raises(ValueError, match="sun must be at 0 to 90 degrees"):
        sky.sun_radiance(sun_at(-0.5), 3.0)
    with pytest.raises(ValueError, match=r"turbidity must be in \[1\.7, 10\]"):
        sky.sun_harmonics(sun_at(20.0), 1.0)
    with pytest.raises(ValueError, match="radius must be a number > 0"):
        sky.sun_harmonics(sun_at(20.0), 2.0, radius=0.0)


def test_derivatives_by_differences_and_finite():
    sun, turbidity, step = jnp.asarray(sun_at(25.0, 10.0)), jnp.asarray(3.0), 1e-5
    project = jax.jit(lambda s, t: sky.sun_harmonics(s, t, 2))
    forward = jax.jacfwd(project, argnums=(0, 1))
    found = forward(sun, turbidity)
    for axis in range(3):
        offset = jnp.zeros(3).at[axis].set(step)
        slope = (project(sun + offset, turbidity) - project(sun - offset, turbidity)) / (2 * step)
        np.testing.assert_allclose(found[0][..., axis], slope, 1e-6, 1e-6)
    slope = (project(sun, turbidity + step) - project(sun, turbidity - step)) / (2 * step)
    np.testing.assert_allclose(found[1], slope, 1e-6, 1e-6)
    for place in ([0.0, 0, 1], [1.0, 0, 0], [0.8, 0, -0.6], [0.0, 0, -1]):
        assert all(np.isfinite(d).all() for d in forward(jnp.array(place), turbidity))


def test_batches_and_single_precision(rng):
    sun, turbidity = sun_at(rng.uniform(2, 90, (2, 3)), 10.0), rng.uniform(2, 9, 3)
    flat = sky.sun_harmonics(sun, turbidity, 2)
    assert flat.shape == (2, 3, 3, 9)
    np.testing.assert_allclose(sky.sun_harmonics(sun[1, 2], turbidity[2], 2), flat[1, 2], 1e-12)
    single = sky.sun_harmonics(np.float32(sun), np.float32(turbidity), 2)
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, flat, 1e-4, 1e-2)
