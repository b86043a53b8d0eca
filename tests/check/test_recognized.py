"""Coefficients of known lights: each convention is recognized, in any form."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
import samples

import jaxsh
from jaxsh import harmonics

# Each way that conventions differ in, in the default run; the others are slow for compiling.
QUICK = {"jaxsh", "three.js", "unity", "alicevision", "pyshtools-4pi"}
NAMES = [
    pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
    for name in harmonics.conventions()
]


@pytest.mark.parametrize("name", NAMES)
def test_each_convention_is_recognized_from_the_picture(name, image, light):
    given = harmonics.convert(light, "jaxsh", name)
    verdict = jaxsh.check(given, image)
    assert verdict.decided
    assert name in verdict.agree
    assert verdict.scale == 1.0
    assert verdict.residual < 0.02  # the sine of 16 rows beside Fejér's weights
    assert not verdict.faults
    back = harmonics.convert(given, verdict.found, "jaxsh")
    np.testing.assert_allclose(back, light, rtol=0, atol=1e-15 * np.abs(light).max())


@pytest.mark.parametrize("name", NAMES)
def test_each_convention_is_recognized_from_a_direction(name):
    light = samples.basis(samples.DIRECTION)[None] * np.array([[2.0], [3.0], [1.0]])
    given = harmonics.convert(light, "jaxsh", name)
    verdict = jaxsh.check(given, direction=samples.DIRECTION)
    assert verdict.decided
    assert name in verdict.agree
    back = harmonics.convert(given, verdict.found, "jaxsh")
    cosine = np.sum(back * light) / np.linalg.norm(back) / np.linalg.norm(light)
    assert cosine > 1 - 1e-9


@pytest.mark.parametrize("degree", [1, pytest.param(3, marks=pytest.mark.slow), 9])
def test_other_degrees(degree, rng):
    image = samples.picture(rng, height=24)
    light = np.asarray(jaxsh.sphere.project_lat_long(jnp.asarray(image), degree))
    given = harmonics.convert(light, "jaxsh", "unreal")
    verdict = jaxsh.check(given, image)
    assert verdict.decided
    assert verdict.agree == ("unreal",)


def test_conventions_that_no_name_has(image, light):
    turned = dataclasses.replace(
        harmonics.conventions()["gltf"], axes=("-y", "+z", "+x"), normalization="schmidt"
    )
    verdict = jaxsh.check(harmonics.convert(light, "jaxsh", turned), image)
    assert verdict.decided
    assert not verdict.agree
    assert "Schmidt" in verdict.summary
    assert "y up" in verdict.summary
    assert "irradiance" in verdict.summary
    back = harmonics.convert(harmonics.convert(light, "jaxsh", turned), verdict.found, "jaxsh")
    np.testing.assert_allclose(back, light, rtol=0, atol=1e-15 * np.abs(light).max())


@pytest.mark.parametrize(
    ("axes", "words"),
    [
        (("+x", "-y", "+z"), "left-handed"),  # a mirrored panorama
        (("+y", "-x", "+z"), "y, −x, z"),  # turned by a quarter
        (("+x", "+y", "-z"), "−z up"),  # upside down
    ],
)
def test_pictures_placed_otherwise(axes, words, image, light):
    given = harmonics.convert(light, "jaxsh", harmonics.Convention(axes=axes))
    verdict = jaxsh.check(given, image)
    assert verdict.decided
    assert words in str(verdict)
    assert not verdict.agree


def test_half_a_turn_is_condon_shortley(image, light):
    given = harmonics.convert(light, "jaxsh", harmonics.Convention(axes=("-x", "-y", "+z")))
    verdict = jaxsh.check(given, image)
    assert "condon-shortley" in verdict.agree
    assert "the same conversion: no Condon–Shortley sign, z up (its x, y, z are our −x, −y, z)" in (
        verdict.notes
    )


def test_4pi_is_a_convention(image, light):
    verdict = jaxsh.check(light / np.sqrt(4 * np.pi), image)
    assert verdict.decided
    assert "4π normalized" in verdict.summary


def test_the_order_of_m_reversed(image, light):
    verdict = jaxsh.check(light[:, [0, 3, 2, 1, 8, 7, 6, 5, 4]], image)
    assert verdict.decided
    assert "order of m reversed" in verdict.summary
    assert "z up," in verdict.summary
    verdict = jaxsh.check(light[:, [0, 2, 3, 1, 6, 7, 5, 8, 4]], image)
    assert verdict.decided
    assert "m as 0, 1, −1, 2, −2" in verdict.summary


def test_layouts(image, light):
    for given, words in (
        (light.T, "coefficient-major, (K, C)"),
        (light.ravel(), "channel-major"),
        (light.T.ravel(), "coefficient-major, (3·K,)"),
    ):
        verdict = jaxsh.check(given, image)
        assert verdict.decided
        assert words in verdict.summary
        assert not verdict.faults
    verdict = jaxsh.check(light.T.reshape(3, 9), image)
    assert verdict.faults == (
        "the array lies coefficient by coefficient in memory, though its shape is (3, 9)",
    )
    assert "reshape(-1)" in verdict.conversion


def test_gray(image, light):
    gray = np.array([0.2126, 0.7152, 0.0722]) @ light
    verdict = jaxsh.check(gray * samples.CS, image)
    assert verdict.decided
    assert {"condon-shortley", "gaussian-splatting"} <= set(verdict.agree)
    assert any("one channel" in note for note in verdict.notes)
    verdict = jaxsh.check(light[1], image)
    assert verdict.decided
    assert "gray: green alone" in verdict.notes


def test_single_precision_and_other_arrays(image, light):
    for kind in (np.float32, jnp.float32):
        verdict = jaxsh.check(jnp.asarray(light, kind), np.asarray(image, np.float32))
        assert verdict.decided
        assert "jaxsh" in verdict.agree


def test_lists_are_as_good_as_arrays(image, light, unchecked):
    assert jaxsh.check(light.tolist(), image.tolist()).decided
    light, direction = samples.basis(samples.DIRECTION), samples.DIRECTION.tolist()
    assert jaxsh.check(light.tolist(), direction=direction).decided
