"""Two stages: between the middle degree and everything."""

import appendix
import jax
import numpy as np
import pytest
from jax.test_util import check_grads
from test_masks import TARGET, V, scene

from jaxsh.adaptive import _two_stage, shade_two_stage, stage
from jaxsh.transfer import Material, shade_diffuse, shade_glossy

MIDDLE = 3
LIMITS, ALL, NONE = ({"threshold": threshold} for threshold in (0.15, 0.0, np.inf))


def staged(rng, dtype="float64"):
    light, made, eye, material = scene(rng, dtype)
    return light, stage(made, middle=MIDDLE, quantized=False), eye, material


@pytest.mark.parametrize(
    ("dtype", "atol", "outside", "degree"),
    [("float64", 1e-12, "level", MIDDLE), ("float32", 3e-6, "base", 2)],
)
def test_each_vertex_is_one_or_the_other(rng, dtype, atol, outside, degree):
    light, made, eye, material = inputs = staged(rng, dtype)
    full = shade_glossy(light, made.transfer, eye, material)
    # What is left out is glossy alone.
    shiny = Material(0 * material.diffuse, material.specular, material.exponent)
    cut = shade_glossy(light[:, : (degree + 1) ** 2], made.transfer, eye, shiny)
    cut = cut + shade_diffuse(light, made.transfer, material.diffuse)
    kept = []
    for limits in (LIMITS, ALL, NONE):
        got = shade_two_stage(*inputs, outside=outside, **limits)
        inside = np.asarray(got.reached["specular"] == TARGET)
        assert got.color.dtype == dtype
        np.testing.assert_allclose(got.kept["specular"], inside.mean(), rtol=1e-6)
        kept.append(inside.mean())
        exact = np.where(inside[:, None], full, cut)
        np.testing.assert_allclose(got.color, exact, rtol=0, atol=atol)
    assert kept[1:] == [1, 0]
    assert 0 < kept[0] < 1


def test_a_transfer_is_staged_on_the_way(rng):
    light, made, eye, material = inputs = staged(rng)
    given = shade_two_stage(light, made.transfer, eye, material, middle=MIDDLE, **LIMITS)
    jax.tree.map(
        lambda a, b: np.testing.assert_allclose(a, b, rtol=0, atol=1e-12),
        given,
        shade_two_stage(*inputs, **LIMITS),
    )


@pytest.mark.slow
def test_two_stages_refined_and_smoothed(rng):
    light, made, eye, material = inputs = staged(rng)
    white = Material(0 * material.diffuse, 0 * material.specular + 1, material.exponent)
    inputs = light, made, eye, white
    limits = {"threshold": 0.3, "outside": "base"}
    plain = shade_two_stage(*inputs, **limits)
    near, decided = np.asarray(made.transfer.neighbors), np.asarray(plain.reached["specular"])
    start = set(np.flatnonzero(decided == TARGET).tolist())
    # Whole rings join: the first stage has asked everyone already.
    region = start | {int(n) for v in start for n in near[v]}
    assert 0 < len(start) < len(region) < V
    got = shade_two_stage(*inputs, rings=1, smoothing=True, **limits)
    assert set(np.flatnonzero(got.reached["specular"] == TARGET).tolist()) == region
    np.testing.assert_allclose(got.kept["specular"], plain.kept["specular"])
    base = shade_two_stage(*inputs, **limits | NONE).color
    added = np.asarray(shade_glossy(light, made.transfer, eye, white) - base)
    added = np.where(np.isin(np.arange(V), list(region))[:, None], added, 0)
    expected = base + appendix.smooth_boundary(added, region, near)
    np.testing.assert_allclose(got.color, expected, rtol=0, atol=1e-12)


def test_two_stages_remember(rng):
    inputs = staged(rng)

    def at(threshold, **options):
        return shade_two_stage(*inputs, threshold=threshold, **options)

    low, high = at(0.1), at(0.2)
    assert high.kept["specular"] < low.kept["specular"]
    assert at(0.2, previous=low, leave=0.5).kept["specular"] == low.kept["specular"]
    assert at(0.2, previous=low, leave=1.0).kept["specular"] == high.kept["specular"]


def test_two_stage_derivatives(rng):
    light, made, eye, material = staged(rng)

    def color(light, specular):
        changed = Material(material.diffuse, specular, material.exponent)
        return shade_two_stage(light, made, eye, changed, **LIMITS).color

    arguments = light, material.specular
    check_grads(color, arguments, order=1, modes=["fwd", "rev"], rtol=1e-6, atol=1e-6)


def test_two_stages_compile_once(rng):
    inputs = staged(rng)
    shade_two_stage(*inputs, **LIMITS)
    before = _two_stage._two_stage._cache_size()
    kept = [float(shade_two_stage(*inputs, threshold=t).kept["specular"]) for t in (0.0, 0.2, 9.0)]
    assert _two_stage._two_stage._cache_size() == before
    assert kept == sorted(kept, reverse=True)
    assert kept[0] == 1 > kept[1]


def test_bad_stages_are_refused(unchecked, rng):
    light, made, eye, material = staged(rng)
    plain = made.transfer
    with pytest.raises(
        ValueError, match=r"staged as base, middle .*, \(2, 3, 4\), got \(2, 4, 4\)"
    ):
        shade_two_stage(light, made, eye, material, middle=4)
    with pytest.raises(ValueError, match=r"\(2, 2, 3\), got \(2, 2, 4\)"):
        shade_two_stage(light, stage(plain, 3, middle=2), eye, material)
    with pytest.raises(ValueError, match="<= the transfer's, 4, got 2, 3 and 5"):
        stage(plain, 5)
    with pytest.raises(ValueError, match=r"base <= middle <= degree .* got 2, 1 and 4"):
        shade_two_stage(light, plain, eye, material, middle=1)
