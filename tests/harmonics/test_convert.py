"""Conversion between conventions: to and fro, turns of axes, shapes, derivatives."""

import itertools

import jax
import numpy as np

from jaxsh import harmonics

CONVENTIONS = harmonics.conventions()


def to(name, light):
    return harmonics.convert(light, "jaxsh", name)


def test_every_pair_to_and_fro(rng):
    """In float64 to 1e-14, through every pair of names."""
    light = rng.normal(size=(3, 9))
    with jax.disable_jit():
        said = {name: to(name, light) for name in CONVENTIONS}
        for source, target in itertools.permutations(CONVENTIONS, 2):
            there = harmonics.convert(said[source], source, target)
            np.testing.assert_allclose(there, said[target], rtol=0, atol=3e-14)
            assert there.shape == said[target].shape
