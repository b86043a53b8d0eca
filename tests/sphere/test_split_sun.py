"""Sources split from pictures that are made of known ones, and pictures without any."""

import itertools
import time
import warnings

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import imaging, sphere

SKY = np.array([0.3, 0.5, 0.9])
SUN = np.array([900.0, 800.0, 600.0])


def directions(height, width):
    return np.asarray(sphere.lat_long(height, width).directions).reshape(height, width, 3)


def picture(*suns, height=128, width=256, radius=0.05, radiance=SUN):
    """A plain sky with discs in it, some pixels wide."""
    cosines = directions(height, width) @ np.array(suns, float).reshape(-1, 3).T
    discs = (cosines > np.cos(radius)).any(axis=-1)
    return np.where(discs[..., None], radiance, SKY)


def integral(image):
    height, width, _ = image.shape
    weights = np.asarray(sphere.lat_long(height, width).weights, np.float64)
    return weights @ np.asarray(image, np.float64).reshape(-1, 3)


def angle(a, b):
    return np.arccos(np.clip(np.sum(np.asarray(a) * np.asarray(b), axis=-1), -1, 1))


@pytest.mark.parametrize("dtype", [np.float32, pytest.param(np.float64, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "sun",
    [(0.48, 0.6, 0.64), (0.8, 0.001, -0.6), (0, 0, 1), (0.01, 0.02, -0.99975)],
    ids=["anywhere", "on the seam", "zenith", "near the nadir"],
)
def test_a_disc_is_found_wherever_it_is(sun, dtype):
    image = picture(sun).astype(dtype)
    suns, rest = sphere.split_sun(image)
    assert rest.dtype == suns.radiance.dtype == dtype
    np.testing.assert_allclose(rest, np.broadcast_to(SKY, rest.shape), rtol=1e-7)
    assert angle(suns.direction, sun) < 0.005  # a fifth of a pixel
    lit = integral(image > 10).mean()  # the pixels' area
    np.testing.assert_allclose(suns.solid_angle, lit, rtol=2e-6)
    np.testing.assert_allclose(lit, np.pi * 0.05**2, rtol=0.09)
    np.testing.assert_allclose(suns.radiance[0], SUN - SKY, rtol=2e-6)
    np.testing.assert_allclose(
        integral(rest) + np.asarray(suns.irradiance[0]), integral(image), rtol=1e-6
    )


@pytest.mark.slow
def test_the_rays_are_the_disc():
    """Coefficients of the picture are those of the rest and of the suns."""
    image = picture((0.48, 0.6, 0.64))
    suns, rest = sphere.split_sun(image)
    whole, left = (sphere.project_lat_long(x, 8) for x in (image, np.asarray(rest)))
    error = np.linalg.norm(whole - left - suns.harmonics(8)) / np.linalg.norm(whole)
    assert error < 6e-4
    assert angle(suns.rays()[0], suns.direction).max() < 0.05 + np.pi / 128  # by a pixel


def test_several_are_sorted_by_their_light():
    at = np.array([[1.0, 0, 0], [0, 0.6, 0.8], [-0.6, -0.8, 0]])
    image = np.full((64, 128, 3), 0.2)
    for sun, radiance in zip(at, (20, 60, 40), strict=True):
        image = np.maximum(image, picture(sun, height=64, width=128, radius=0.1, radiance=radiance))
    suns, rest = sphere.split_sun(image, 2)
    assert angle(suns.direction, at[[1, 2]]).max() < 0.01
    np.testing.assert_allclose(integral(rest) + suns.irradiance.sum(0), integral(image), rtol=1e-12)
    assert sphere.split_sun(image, 9)[0].solid_angle.shape == (3,)


@pytest.mark.parametrize("place", [(20, 40), (0, 5), (33, 0)])
def test_one_pixel(place):
    image = np.full((64, 128, 3), 0.5)
    image[place] = 1e5
    suns, rest = sphere.split_sun(image, rays=4)
    np.testing.assert_allclose(rest, 0.5)
    quadrature = sphere.lat_long(64, 128)
    pixel = np.ravel_multi_index(place, (64, 128))
    assert angle(suns.direction, quadrature.directions[pixel]) < 1e-3
    np.testing.assert_allclose(suns.solid_angle, quadrature.weights[pixel], rtol=1e-12)
    np.testing.assert_allclose(suns.radiance, 1e5 - 0.5, rtol=1e-12)


def test_leaves_before_the_sun(rng):
    """What shines through them is one source, with its middle where the sun's is."""
    image = picture((0.48, 0.6, 0.64), height=512, width=1024)
    image[rng.random(image.shape[:2]) < 0.6] = 0.1
    image[::6] = 0.1
    suns, rest = sphere.split_sun(image, 4)
    assert suns.solid_angle.shape == (1,)
    assert angle(suns.direction, (0.48, 0.6, 0.64)) < 0.004
    assert rest.max() < 1
    np.testing.assert_allclose(integral(rest) + suns.irradiance[0], integral(image), rtol=1e-12)


def test_a_clipped_sun_is_split_and_clipped_skies_are_not():
    image = np.minimum(picture((0.48, 0.6, 0.64)), 8.0)
    np.testing.assert_allclose(sphere.split_sun(image)[0].radiance[0], 8.0 - SKY, rtol=1e-12)
    wide = np.minimum(picture((0.48, 0.6, 0.64), radius=0.7), 8.0)
    said = r"there is no sun to split off: .* is 1\.5 sr wide, more than largest=0\.1$"
    with pytest.warns(UserWarning, match=said):
        assert sphere.split_sun(wide)[0].solid_angle.shape == (0,)


@pytest.mark.parametrize("kind", ["black", "uniform", "noise", "overcast"])
def test_nothing_stands_out(kind, rng):
    z = directions(32, 64)[..., 2:]
    image = {
        "black": np.zeros((32, 64, 3)),
        "uniform": np.ones((32, 64, 3)),
        "noise": rng.exponential(size=(128, 256, 1)) * SKY,
        "overcast": np.where(z > 0, (1 + 2 * z) / 3, 0.05) * np.ones(3),
    }[kind]
    said = r"there is no sun to split off: .* with 0\.5 % of the light$"
    with pytest.warns(UserWarning, match=said):
        suns, rest = sphere.split_sun(image)
    assert suns.rays().shape == (0, 64, 3)
    np.testing.assert_array_equal(rest, image)
    np.testing.assert_array_equal(suns.harmonics(1), np.zeros((3, 4)))


def test_a_wide_light_gives_its_peaks_only():
    """A glow wider than is compact stays, but for the peak in it."""
    cosine = directions(64, 128) @ (0.48, 0.6, 0.64)
    glow = 20 * np.exp(12 * (cosine - 1)) + 500 * np.exp(400 * (cosine - 1))
    suns, rest = sphere.split_sun(np.repeat(glow[..., None], 3, axis=-1))
    assert angle(suns.direction, (0.48, 0.6, 0.64)) < 0.01
    assert 0.01 < suns.solid_angle < 0.1
    assert 10 < rest.max() < 40


def test_light_below_zero_and_a_dark_room_come_to_an_end():
    """As of a light made from coefficients; and a wide lamp far above what is else in the room."""
    image = picture((0.48, 0.6, 0.64))
    expected, _ = sphere.split_sun(image)
    image[-20:] = -5.0
    suns, rest = sphere.split_sun(image)
    np.testing.assert_allclose(suns.direction, expected.direction, rtol=0, atol=1e-15)
    np.testing.assert_allclose(suns.irradiance, expected.irradiance, rtol=1e-12)
    np.testing.assert_array_equal(rest[-20:], image[-20:])
    for depth, lamp in itertools.product((0.0, 1e-200), (5.0, 1e30)):
        room = np.where(directions(32, 64)[..., :1] > 0.8, lamp, depth) * np.ones(3)
        with pytest.warns(UserWarning, match="there is no sun to split off"):
            sphere.split_sun(room, largest=1e-3)


@pytest.mark.slow
def test_a_large_picture_takes_seconds():
    """A height of 4096: in little time, and with little memory besides the result's."""
    resource = pytest.importorskip("resource")
    image = np.full((4096, 8192, 3), 0.5, np.float32)
    image[1000:1024, 5000:5020] = 5e4
    before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    suns, rest = sphere.split_sun(image)
    assert time.process_time() - start < 20
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 3 * image.nbytes / 1024
    assert float(rest.max()) == 0.5
    assert float(suns.radiance[0, 0]) == pytest.approx(5e4 - 0.5, rel=1e-6)


def test_the_studio_and_what_is_refused(unchecked):
    image = imaging.studio(64, 128)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        suns, rest = sphere.split_sun(image, rays=16)
    assert suns.shape.shape == (1, 16, 3)
    assert float(rest.max()) < 10 < 600 < float(image.max())
    for wrong, message in (
        (image[..., :2], "RGB"),
        (np.ones((8, 16, 3), int), "expected image in floats, got int64"),
        (image.at[3, 4, 1].set(jnp.nan), "must be finite"),
        (image[:, :80], "lat-long"),
    ):
        with pytest.raises(ValueError, match=message):
            sphere.split_sun(wrong)
    whole, left = (sphere.project_lat_long(x, 10) for x in (image, rest))
    error = jnp.linalg.norm(whole - left - suns.harmonics(10)) / jnp.linalg.norm(whole)
    assert error < 0.0032  # as the docstring of `harmonics` says
