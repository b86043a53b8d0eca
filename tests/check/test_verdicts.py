"""What is open is said and what is wrong refused; no verdict on random lights is wrong."""

from collections import Counter

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import samples
import sweep

import jaxsh
from jaxsh import harmonics


def test_a_light_of_another_picture_fits_nothing(light, rng):
    verdict = jaxsh.check(rng.normal(size=(3, 9)), samples.picture(rng))
    assert not verdict.decided
    assert verdict.found is None
    assert not verdict.agree


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
    verdict = jaxsh.check(samples.basis(samples.DIRECTION))
    assert "jaxsh" in verdict.agree
    assert "irradiance" not in verdict.agree
    # And nothing that is nowhere negative has a negative mean.
    assert not jaxsh.check(-light).agree


def test_irradiance_alone_shows_itself_at_degree_4(rng):
    image = samples.picture(rng)
    light = jaxsh.sphere.project_lat_long(jnp.asarray(image), 4)
    verdict = jaxsh.check(harmonics.convolve(light, harmonics.clamped_cosine(4)))
    assert any("degree 3 is zero" in note for note in verdict.notes)


def test_a_clipped_picture_is_said(image, light):
    verdict = jaxsh.check(light, np.minimum(image, np.quantile(image, 0.5)))
    assert not verdict.decided
    assert "the picture is clipped: 50" in verdict.notes[-1]


def test_a_report_has_all(image, light):
    report = str(jaxsh.check(0.7 * samples.CS * light, image))
    for words in ("found: Condon–Shortley", "scale: 0.7", "but for a scale", "to convert:"):
        assert words in report
    assert "undecided" in str(jaxsh.check(light))


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
        jaxsh.check(np.ones(9), image, direction=samples.DIRECTION)
    with pytest.raises(TypeError, match="expected a basis alone"):
        jaxsh.check(samples.basis, image)
