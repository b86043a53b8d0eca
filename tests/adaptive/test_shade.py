"""All methods through one door."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from test_masks import scene

from jaxsh import adaptive
from jaxsh.transfer import Material, quantize, sample, shade_diffuse, shade_glossy


@pytest.mark.parametrize(
    ("quantized", "tolerance"), [(False, 1e-11), pytest.param(True, 6e-3, marks=pytest.mark.slow)]
)
def test_every_method_at_its_finest_is_the_full_computation(rng, quantized, tolerance):
    """`Masks` and `Levels` are so checked in `test_masks`."""
    light, made, eye, material = scene(rng)
    light, made = light[:, :16], made.truncated(3)
    material = Material(material.diffuse, material.specular, 9.0)
    anchors = adaptive.make_anchors(made, share=0.2, quantized=quantized)
    single = {"num_tiles": made.num_points, "block": 1, "components": 16, "exponent": 9.0}
    tiles = adaptive.make_tiles(made, eye, **single, quantized=quantized)
    methods = [
        adaptive.TwoStage(threshold=0.0),
        adaptive.Anchors(anchors, threshold=0.0),
        adaptive.Tiles(tiles),
    ]
    staged = adaptive.stage(made, quantized=quantized)
    full = shade_glossy(light, made, eye, material)
    for method in methods:
        given = staged if isinstance(method, adaptive.TwoStage) else made
        result = adaptive.shade(light, given, eye, material, method)
        name = type(method).__name__
        # Tiles keep what polynomials of where a lobe points leave.
        worst = max(tolerance, 6e-6 if name == "Tiles" else 0) * np.abs(full).max()
        np.testing.assert_allclose(result.color, full, rtol=0, atol=worst, err_msg=name)
        assert result.relative_cost.shape == ()
        assert result.relative_cost > 0


@pytest.mark.parametrize(
    ("method", "message"),
    [
        ("magic", "method must be one of masks, levels, two_stage, anchors, tiles, got 'magic'"),
        ("level", "got 'level'; did you mean 'levels'?"),
        ("two-stage", "did you mean 'two_stage'?"),
    ],
)
def test_unknown_methods_are_refused_with_the_nearest(unchecked, rng, method, message):
    with pytest.raises(ValueError, match=message):
        adaptive.shade(*scene(rng), method)


@pytest.mark.parametrize(
    ("method", "option", "nearest"),
    [
        (adaptive.Masks, "treshold", "threshold"),
        (adaptive.Levels, "hysteresys", "hysteresis"),
        (adaptive.TwoStage, "midle", "middle"),
        (adaptive.Anchors, "shares", "share"),
        (adaptive.Tiles, "num_tile", "num_tiles"),
    ],
)
def test_unknown_options_are_refused_with_the_nearest(unchecked, method, option, nearest):
    with pytest.raises(TypeError, match=f"no option '{option}'; did you mean '{nearest}'?"):
        method(**{option: 1})
    with pytest.raises(TypeError, match=f"no option 'magic'; it has .*{nearest}"):
        method(magic=1)


def test_a_name_stands_for_the_defaults(rng):
    frame = scene(rng)
    named, typed = (adaptive.shade(*frame, way) for way in ("two_stage", adaptive.TwoStage()))
    np.testing.assert_array_equal(named.color, typed.color)


def test_methods_are_trees(rng):
    light, made, eye, material = scene(rng)
    frame = light, adaptive.stage(made), jnp.asarray(eye), material
    method = adaptive.TwoStage(threshold=0.15)
    plain, jitted = adaptive.shade(*frame, method), jax.jit(adaptive.shade)(*frame, method)
    np.testing.assert_allclose(jitted.color, plain.color, rtol=0, atol=1e-12)
    assert dataclasses.replace(method, threshold=0.2).base == 2


def test_forms_that_a_method_cannot_take_are_refused(unchecked, rng):
    light, made, eye, material = scene(rng)
    with pytest.raises(ValueError, match="not its eight bits"):
        adaptive.shade(light, quantize(made), eye, material, "levels")
    with pytest.raises(ValueError, match="'masks' needs the transfer's coefficients, got a Sampl"):
        adaptive.shade(light, sample(made), eye, material, "masks")


def test_a_staged_transfer_is_a_transfer(rng):
    light, made, _, material = scene(rng)
    staged = adaptive.stage(made, quantized=False)
    assert (staged.num_points, staged.degree, staged.dtype) == (40, 4, made.dtype)
    plain = shade_diffuse(light, made, material.diffuse)
    np.testing.assert_array_equal(shade_diffuse(light, staged, material.diffuse), plain)
    own = rng.normal(size=(40, 3, 25))
    np.testing.assert_array_equal(shade_diffuse(own, staged, 1.0), shade_diffuse(own, made, 1.0))
