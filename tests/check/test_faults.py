"""Coefficients of known lights that follow no convention: each fault is named."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import samples

import jaxsh
from jaxsh import harmonics


@pytest.mark.parametrize(
    ("factor", "words"),
    [(0.7, "0.7"), (1 / np.pi, "1/π"), (np.sqrt(np.pi) / 2, "√π/2"), (4.0, "factor 4")],
)
def test_a_scale_is_said(factor, words, image, light):
    verdict = jaxsh.check(factor * light, image)
    assert verdict.decided
    assert verdict.scale == pytest.approx(factor, rel=5e-3, abs=0)
    assert "jaxsh" in verdict.nearly
    assert words in verdict.faults[0]
    assert verdict.conversion.endswith(f"/ {verdict.scale:.4g}")


def test_a_white_balance(image, light):
    """Channels with factors of their own, which say nothing of signs and axes."""
    given = harmonics.convert(light * np.array([[0.8], [1.0], [1.3]]), "jaxsh", "unity")
    verdict = jaxsh.check(given, image)
    assert verdict.decided
    assert verdict.agree == ("unity",)
    assert verdict.residual < 0.01  # the light is from a larger picture
    assert verdict.faults == (
        "its channels are those of the picture times 0.8, 1, 1.3: a white balance, say",
    )


def test_mistakes_of_the_picture(image, light):
    image = image / image.max() * 2
    light = samples.project(image)

    def encode(linear):
        return np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)

    verdict = jaxsh.check(samples.project(encode(np.minimum(image, 1))), image)
    assert verdict.faults == (
        "it was made from a gamma-encoded picture, as stored, not from linear light",
    )
    verdict = jaxsh.check(light, encode(image))
    assert verdict.faults == (
        "the picture is gamma-encoded, and was decoded to linear light before",
    )
    verdict = jaxsh.check(samples.project(np.minimum(image, 1)), image)
    assert verdict.faults == ("it was made from a picture clipped at 1",)
    directions, solid_angles = samples.pixels(16)
    equal = np.einsum("hwc,hwk->ck", image, samples.basis(directions)) * solid_angles.mean()
    verdict = jaxsh.check(equal, image)
    assert "pixels were weighted equally" in verdict.faults[0]
    verdict = jaxsh.check(light[::-1], image)
    assert verdict.faults == ("channels as blue, green, red",)


@pytest.mark.parametrize(
    ("spoil", "fault"),
    [
        (lambda c: c * np.array([1, -1, 1, -1, 1, 1, 1, 1, 1]), "sign of l=1, m=±1 flipped"),
        (lambda c: c * np.array([1, 1, 1, 1, 1, 1, -1, 1, 1]), "sign of l=2, m=0 flipped"),
        (lambda c: c[:, [0, 1, 2, 3, 8, 5, 6, 7, 4]], "l=2, m=−2 and l=2, m=2 exchanged"),
        (
            lambda c: c * np.array([1, 1, 1, 1, 1, 1, 3, 1, 1]),
            "l=2, m=0 is off by a factor 3: a constant 0.9462 in place of 0.3154",
        ),
    ],
)
def test_single_coefficients(spoil, fault, image, light):
    # Of the very sum over pixels that `project_lat_long` has, so that only the fault is seen.
    light = np.asarray(jaxsh.sphere.project_lat_long(jnp.asarray(image), 2))
    verdict = jaxsh.check(spoil(light), image)
    assert verdict.faults == (fault,)
    assert verdict.found.axes == ("+x", "+y", "+z")


@pytest.mark.parametrize("kind", ["hann", "lanczos"])
def test_windows(kind, image, light):
    n = np.array([0, 1, 1, 1, 2, 2, 2, 2, 2]) / 3
    weights = {"hann": (1 + np.cos(np.pi * n)) / 2, "lanczos": np.sinc(n)}[kind]
    for name in ("jaxsh", "filament-irradiance"):
        given = harmonics.convert(light * weights, "jaxsh", name)
        verdict = jaxsh.check(given, image)
        assert verdict.decided
        assert name in verdict.agree
        assert f"the window '{kind}'" in verdict.faults[0]
        scope = {"harmonics": harmonics, "coefficients": given}
        with jax.numpy_rank_promotion("allow"):  # as at a user's
            back = eval(verdict.conversion, scope)
        np.testing.assert_allclose(back, light, rtol=0, atol=3e-15 * np.abs(light).max())


def test_another_lobe(image):
    light = np.asarray(jaxsh.sphere.project_lat_long(jnp.asarray(image), 2))
    lobe = np.repeat([1, 11 / 12, 10 / 13], [1, 3, 5])  # cos^10, normalized
    verdict = jaxsh.check(light * lobe, image)
    assert not verdict.decided
    assert "a lobe cosⁿ with n = 10" in verdict.faults[0]
    assert "z up" in verdict.summary


def test_turned_by_no_quarter(image, light):
    given = harmonics.convert(harmonics.rotate_z(light, 0.3), "jaxsh", "three.js")
    verdict = jaxsh.check(given, image)
    assert not verdict.decided
    assert verdict.faults[0].startswith("turned by 17.")  # 0.3 in degrees, 17.19
    assert verdict.agree == ("three.js",)
    scope = {"harmonics": harmonics, "coefficients": given}
    back = eval(verdict.conversion, scope)
    np.testing.assert_allclose(back, light, rtol=0, atol=1e-4 * np.abs(light).max())
    # Where no name is known, the hint stands behind the whole call.
    mirrored = harmonics.Convention(axes=("-z", "+y", "+x"))
    given = harmonics.convert(harmonics.rotate_z(light, 0.3), "jaxsh", mirrored)
    verdict = jaxsh.check(given, image)
    call, hint = verdict.conversion.split(", with ")
    assert hint == "found = verdict.found"
    back = eval(call, scope | {"coefficients": given, "found": verdict.found})
    np.testing.assert_allclose(back, light, rtol=0, atol=1e-4 * np.abs(light).max())
