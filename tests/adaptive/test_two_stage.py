"""Two stages: between the middle degree and everything."""

import appendix
import jax
import numpy as np
import pytest
from jax.test_util import check_grads
from test_masks import TARGET, V, scene

from jaxsh.adaptive import TwoStage, _two_stage, shade, stage
from jaxsh.transfer import Material, shade_diffuse, shade_glossy

MIDDLE = 3
LIMITS, ALL, NONE = ({"threshold": threshold} for threshold in (0.15, 0.0, np.inf))


def staged(rng, dtype="float64"):
    light, made, eye, material = scene(rng, dtype)
    return light, stage(made, middle=MIDDLE, quantized=False), eye, material


@pytest.mark.parametrize(
    ("dtype", "atol", "fallback", "degree"),
    [("float64", 1e-12, "level", MIDDLE), ("float32", 3e-6, "base", 2)],
)
def test_each_vertex_is_one_or_the_other(rng, dtype, atol, fallback, degree):
    light, made, eye, material = inputs = staged(rng, dtype)
    full = shade_glossy(light, made.transfer, eye, material)
    # What is left out is glossy alone.
    shiny = Material(0 * material.diffuse, material.specular, material.exponent)
    cut = shade_glossy(light[:, : (degree + 1) ** 2], made.transfer, eye, shiny)
    cut = cut + shade_diffuse(light, made.transfer, material.diffuse)
    kept = []
    for limits in (LIMITS, ALL, NONE):
        got = shade(*inputs, TwoStage(fallback=fallback, **limits))
        inside = np.asarray(got.shown_degree["specular"] == TARGET)
        assert got.color.dtype == dtype
        np.testing.assert_allclose(got.active_fraction["specular"], inside.mean(), rtol=1e-6)
        kept.append(inside.mean())
        exact = np.where(inside[:, None], full, cut)
        np.testing.assert_allclose(got.color, exact, rtol=0, atol=atol)
    assert kept[1:] == [1, 0]
    assert 0 < kept[0] < 1


def test_a_transfer_is_staged_on_the_way(rng):
    light, made, eye, material = inputs = staged(rng)
    given = shade(light, made.transfer, eye, material, TwoStage(middle=MIDDLE, **LIMITS))
    jax.tree.map(
        lambda a, b: np.testing.assert_allclose(a, b, rtol=0, atol=1e-12),
        given,
        shade(*inputs, TwoStage(**LIMITS)),
    )


@pytest.mark.slow
def test_two_stages_refined_and_smoothed(rng):
    light, made, eye, material = inputs = staged(rng)
    white = Material(0 * material.diffuse, 0 * material.specular + 1, material.exponent)
    inputs = light, made, eye, white
    limits = {"threshold": 0.3, "fallback": "base"}
    plain = shade(*inputs, TwoStage(**limits))
    near, decided = np.asarray(made.transfer.neighbors), np.asarray(plain.shown_degree["specular"])
    start = set(np.flatnonzero(decided == TARGET).tolist())
    # Whole rings join: the first stage has asked everyone already.
    region = start | {int(n) for v in start for n in near[v]}
    assert 0 < len(start) < len(region) < V
    got = shade(*inputs, TwoStage(rings=1, smoothing=True, **limits))
    assert set(np.flatnonzero(got.shown_degree["specular"] == TARGET).tolist()) == region
    np.testing.assert_allclose(got.active_fraction["specular"], plain.active_fraction["specular"])
    base = shade(*inputs, TwoStage(**limits | NONE)).color
    added = np.asarray(shade_glossy(light, made.transfer, eye, white) - base)
    added = np.where(np.isin(np.arange(V), list(region))[:, None], added, 0)
    expected = base + appendix.smooth_boundary(added, region, near)
    np.testing.assert_allclose(got.color, expected, rtol=0, atol=1e-12)


def test_two_stages_remember(rng):
    inputs = staged(rng)

    def at(threshold, **options):
        return shade(*inputs, TwoStage(threshold=threshold, **options))

    low, high = at(0.1), at(0.2)
    assert high.active_fraction["specular"] < low.active_fraction["specular"]
    assert (
        at(0.2, previous=low, hysteresis=0.5).active_fraction["specular"]
        == low.active_fraction["specular"]
    )
    assert (
        at(0.2, previous=low, hysteresis=1.0).active_fraction["specular"]
        == high.active_fraction["specular"]
    )


def test_two_stage_derivatives(rng):
    light, made, eye, material = staged(rng)

    def color(light, specular):
        changed = Material(material.diffuse, specular, material.exponent)
        return shade(light, made, eye, changed, TwoStage(**LIMITS)).color

    arguments = light, material.specular
    check_grads(color, arguments, order=1, modes=["fwd", "rev"], rtol=1e-6, atol=1e-6)


def test_two_stages_compile_once(rng):
    inputs = staged(rng)
    shade(*inputs, TwoStage(**LIMITS))
    before = _two_stage._two_stage._cache_size()
    frames = [shade(*inputs, TwoStage(threshold=t)) for t in (0.0, 0.2, 9.0)]
    kept = [float(frame.active_fraction["specular"]) for frame in frames]
    assert _two_stage._two_stage._cache_size() == before
    assert kept == sorted(kept, reverse=True)
    assert kept[0] == 1 > kept[1]


def test_bad_stages_are_refused(unchecked, rng):
    light, made, eye, material = staged(rng)
    plain = made.transfer
    with pytest.raises(
        ValueError, match=r"staged as base, middle .*, \(2, 3, 4\), got \(2, 4, 4\)"
    ):
        shade(light, made, eye, material, TwoStage(middle=4))
    with pytest.raises(ValueError, match=r"\(2, 2, 3\), got \(2, 2, 4\)"):
        shade(light, stage(plain, 3, middle=2), eye, material, TwoStage())
    with pytest.raises(ValueError, match="<= the transfer's, 4, got 2, 3 and 5"):
        stage(plain, 5)
    with pytest.raises(ValueError, match=r"base <= middle <= degree .* got 2, 1 and 4"):
        shade(light, plain, eye, material, TwoStage(middle=1))
