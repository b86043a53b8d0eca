"""All methods through one door."""

import numpy as np
import pytest
from test_masks import scene

from jaxsh import adaptive
from jaxsh.transfer import Material, shade_glossy


def test_every_method_at_its_finest_is_the_full_computation(rng):
    light, made, eye, material = scene(rng)
    material = Material(material.diffuse, material.specular, 9.0)
    everyone = {"threshold": 0.0, "diffuse_threshold": 0.0}
    options = {
        "masks": everyone,
        "levels": everyone,
        "two_stage": everyone,
        "probes": {"probes": adaptive.make_probes(made, share=0.2), "threshold": 0.0},
        "tiles": {"tiles": adaptive.make_tiles(made, eye, directions=500)},
    }
    full = shade_glossy(light, made, eye, material)
    staged = adaptive.stage(made)
    for method, own in options.items():
        result = adaptive.shade(light, staged, eye, material, method=method, **own)
        np.testing.assert_allclose(result.color, full, rtol=0, atol=1e-11, err_msg=method)
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
