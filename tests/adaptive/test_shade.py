"""All methods through one door."""

import numpy as np
import pytest
from test_masks import scene

from jaxsh import adaptive
from jaxsh.transfer import Material, quantize, shade_glossy


@pytest.mark.parametrize(("quantized", "tolerance"), [(False, 1e-11), (True, 6e-3)])
def test_every_method_at_its_finest_is_the_full_computation(rng, quantized, tolerance):
    light, made, eye, material = scene(rng)
    material = Material(material.diffuse, material.specular, 9.0)
    everyone = {"threshold": 0.0, "diffuse_threshold": 0.0}
    probes = adaptive.make_probes(made, share=0.2, quantized=quantized)
    tiles = adaptive.make_tiles(made, eye, directions=500, quantized=quantized)
    options = {
        "two_stage": everyone,
        "probes": {"probes": probes, "threshold": 0.0},
        "tiles": {"tiles": tiles},
    }
    transfers = {"two_stage": adaptive.stage(made, quantized=quantized)}
    if not quantized:
        options |= {"masks": everyone, "levels": everyone}
    full = shade_glossy(light, made, eye, material)
    for method, own in options.items():
        given = transfers.get(method, quantize(made) if quantized else made)
        result = adaptive.shade(light, given, eye, material, method=method, **own)
        worst = tolerance * np.abs(full).max()
        np.testing.assert_allclose(result.color, full, rtol=0, atol=worst, err_msg=method)
        assert result.spent.shape == ()
        assert result.spent > 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "magic"}, "method to be one of masks, .*, got 'magic'"),
        ({"method": "tiles"}, "'tiles' needs tiles=, a TileSet made by make_tiles, got NoneType"),
        ({"method": "probes", "probes": 3}, "needs probes=, a ProbeSet made by make_p.* got int"),
    ],
)
def test_unknown_methods_and_missing_sets_are_refused(unchecked, rng, options, message):
    with pytest.raises(ValueError, match=message):
        adaptive.shade(*scene(rng), **options)


def test_options_of_another_method_are_refused(unchecked, rng):
    with pytest.raises(TypeError, match="middle"):
        adaptive.shade(*scene(rng), method="masks", middle=3)


def test_methods_of_levels_refuse_eight_bits(unchecked, rng):
    light, made, eye, material = scene(rng)
    with pytest.raises(ValueError, match="method 'levels' needs the transfer's coefficients"):
        adaptive.shade(light, quantize(made), eye, material, method="levels")
