"""Coefficients of known lights: conventions are recognized, faults named, and doubts said."""

import dataclasses
from collections import Counter

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import samples
import sweep

import jaxsh
from jaxsh import harmonics

# Each way that conventions differ in, in the default run; the others are slow for compiling.
QUICK = {"jaxsh", "three.js", "unity", "alicevision", "pyshtools-4pi"}
NAMES = [
    pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
    for name in harmonics.conventions()
]
DIRECTION = np.array([0.3, 0.5, 0.8]) / np.linalg.norm([0.3, 0.5, 0.8])


@pytest.fixture
def image(rng):
    return samples.picture(rng)


@pytest.fixture
def light(image):
    return samples.project(image)


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
    np.testing.assert_allclose(back, light, rtol=0, atol=1e-12 * np.abs(light).max())


@pytest.mark.parametrize("name", NAMES)
def test_each_convention_is_recognized_from_a_direction(name):
    light = samples.basis(DIRECTION)[None] * np.array([[2.0], [3.0], [1.0]])
    given = harmonics.convert(light, "jaxsh", name)
    verdict = jaxsh.check(given, direction=DIRECTION)
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
    np.testing.assert_allclose(back, light, rtol=0, atol=1e-12 * np.abs(light).max())


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
        assert verdict.summary.endswith(words) or words in verdict.summary
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
        np.testing.assert_allclose(back, light, rtol=0, atol=0.01 * np.abs(light).max())


def test_another_lobe(image):
    light = np.asarray(jaxsh.sphere.project_lat_long(jnp.asarray(image), 2))
    lobe = np.repeat([1, 11 / 12, 10 / 13], [1, 3, 5])  # cos^10, normalized
    verdict = jaxsh.check(light * lobe, image)
    assert not verdict.decided
    assert "a lobe cosⁿ with n = 10" in verdict.faults[0]
    assert "z up" in verdict.summary


def test_a_light_of_another_picture_fits_nothing(light, rng):
    verdict = jaxsh.check(rng.normal(size=(3, 9)), samples.picture(rng))
    assert not verdict.decided
    assert verdict.found is None
    assert not verdict.agree


def test_turned_by_no_quarter(image, light):
    given = harmonics.convert(harmonics.rotate_z(light, 0.3), "jaxsh", "three.js")
    verdict = jaxsh.check(given, image)
    assert not verdict.decided
    assert verdict.faults[0].startswith("turned by 17.")  # 0.3 in degrees, 17.19
    assert verdict.agree == ("three.js",)
    scope = {"harmonics": harmonics, "coefficients": given}
    back = eval(verdict.conversion, scope)
    np.testing.assert_allclose(back, light, rtol=0, atol=0.01 * np.abs(light).max())
    # Where no name is known, the hint stands behind the whole call.
    mirrored = harmonics.Convention(axes=("-z", "+y", "+x"))
    given = harmonics.convert(harmonics.rotate_z(light, 0.3), "jaxsh", mirrored)
    verdict = jaxsh.check(given, image)
    call, hint = verdict.conversion.split(", with ")
    assert hint == "found = verdict.found"
    back = eval(call, scope | {"coefficients": given, "found": verdict.found})
    np.testing.assert_allclose(back, light, rtol=0, atol=0.01 * np.abs(light).max())


def test_a_furnace_tests_constants_only():
    for radiance, name in ((1.0, "jaxsh"), (np.pi, "irradiance")):
        given = np.zeros((3, 9))
        given[:, 0] = radiance * np.sqrt(4 * np.pi)
        verdict = jaxsh.check(given, np.ones((8, 16, 3)))
        assert not verdict.decided
        assert name in verdict.agree
        assert "the same in all axes" in verdict.open[0]
    given[0, 4] = 1.0
    assert "no coefficients but the first" in jaxsh.check(given, np.ones((8, 16, 3))).faults[0]


def test_a_symmetric_light_leaves_axes_open():
    up = np.array([0.0, 0.0, 1.0])
    verdict = jaxsh.check(samples.basis(up), direction=up)
    assert not verdict.decided
    assert "jaxsh" in verdict.agree
    assert "axes" in verdict.summary.split("open: ")[1]
    assert "x, y and z all differ" in verdict.open[-1]


def test_coefficients_alone(light):
    verdict = jaxsh.check(light)
    assert not verdict.decided
    assert {"jaxsh", "condon-shortley"} <= set(verdict.agree)
    assert "the picture or the direction" in verdict.open[0]
    # What a lamp alone gives is too sharp for irradiance.
    verdict = jaxsh.check(samples.basis(DIRECTION))
    assert "jaxsh" in verdict.agree
    assert "irradiance" not in verdict.agree
    # And nothing that is nowhere negative has a negative mean.
    assert not jaxsh.check(-light).agree


def test_irradiance_alone_shows_itself_at_degree_4(rng):
    image = samples.picture(rng)
    light = jaxsh.sphere.project_lat_long(jnp.asarray(image), 4)
    verdict = jaxsh.check(harmonics.convolve(light, harmonics.clamped_cosine(4)))
    assert any("degree 3 is zero" in note for note in verdict.notes)


def test_single_precision_and_other_arrays(image, light):
    for kind in (np.float32, jnp.float32):
        verdict = jaxsh.check(jnp.asarray(light, kind), np.asarray(image, np.float32))
        assert verdict.decided
        assert "jaxsh" in verdict.agree


def test_lists_are_as_good_as_arrays(image, light, unchecked):
    assert jaxsh.check(light.tolist(), image.tolist()).decided
    assert jaxsh.check(samples.basis(DIRECTION).tolist(), direction=DIRECTION.tolist()).decided


def test_what_is_traced_is_refused(image):
    with pytest.raises(ValueError, match="expected known values for given"):
        jax.jit(lambda c: jaxsh.check(c, image))(jnp.ones((3, 9)))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: jaxsh.check(np.ones((2, 7))), r"\(C, K\).*got shape \(2, 7\)"),
        (lambda: jaxsh.check(np.zeros(9)), "zero throughout"),
        (lambda: jaxsh.check(np.ones(9), np.zeros((8, 16, 3))), "black throughout"),
        (lambda: jaxsh.check(np.ones(9), direction=np.zeros(3)), "nonzero x, y, z"),
        (lambda: jaxsh.check(np.ones((2, 9)), np.ones((8, 16, 3))), "got 2 beside 3 of picture"),
        (lambda: jaxsh.check(np.ones(9), np.ones((2, 4, 3))), "3 rows or more, .* got .*2, 4, 3"),
        (lambda: jaxsh.check(np.ones(9), np.ones((16, 16, 3))), "twice as wide as high"),
    ],
)
def test_errors(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_one_test_at_a_time(image):
    with pytest.raises(TypeError, match="got both"):
        jaxsh.check(np.ones(9), image, direction=DIRECTION)
    with pytest.raises(TypeError, match="expected a basis alone"):
        jaxsh.check(samples.basis, image)


def test_a_report_has_all(image, light):
    report = str(jaxsh.check(0.7 * samples.CS * light, image))
    for words in ("found: Condon–Shortley", "scale: 0.7", "but for a scale", "to convert:"):
        assert words in report
    assert "undecided" in str(jaxsh.check(light))


def test_a_clipped_picture_is_said(image, light):
    verdict = jaxsh.check(light, np.minimum(image, np.quantile(image, 0.5)))
    assert not verdict.decided
    assert "the picture is clipped: 50" in verdict.notes[-1]


@pytest.mark.slow
def test_no_verdict_is_wrong():
    """Random lights in random conventions with noise: each is right, or said to be open."""
    total = sum((sweep.rates(1, seed=1, **case) for case in sweep.CASES), Counter())
    assert total["wrong"] == 0
    clean = [case for case in sweep.CASES if not case["noise"] and case["degree"] > 1]
    pictures = [case for case in clean if not case.get("direction")]
    found = sum((sweep.rates(3, seed=2, **case) for case in pictures), Counter())
    assert set(found) == {"right"}
    # And light of another picture has none.
    found = sum((sweep.rates(2, seed=3, other=True, **case) for case in clean), Counter())
    assert set(found) <= {"open", "none"}
