"""What an accelerator computes at once, a share of the vertices or a few blocks, is the same."""

import accelerators
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import adaptive, sphere, transfer

V, K = 2500, 9  # more than a block on a CPU
MATERIAL = transfer.Material(0.5, 0.5, 8.0)


@pytest.fixture
def frame(rng):
    points = sphere.fibonacci(V).directions
    neighbors = jnp.asarray(rng.integers(0, V, size=(V, 6)), jnp.int32)
    made = transfer.Transfer(jnp.asarray(rng.normal(size=(V, K))), points, points, neighbors)
    return jnp.asarray(rng.normal(size=(3, K))), made


def method(name, made):
    """The method, of which some vertices are in and some are not, and what it shades."""
    if name == "two_stage":
        staged = adaptive.stage(made, base=1, quantized=False)
        return adaptive.TwoStage(base=1, threshold=0.3), staged
    if name == "anchors":
        anchors = adaptive.make_anchors(made, quantized=False)
        return adaptive.Anchors(anchors, threshold=0.5), made
    return adaptive.Levels(base=1, threshold=0.3, rings=1), made


@pytest.mark.slow
@pytest.mark.parametrize("name", ["levels", "two_stage", "anchors"])
def test_at_once_is_as_block_by_block(name, frame):
    light, made = frame
    chosen, made = method(name, made)
    eye = jnp.asarray([0.0, -3.0, 1.0])

    def both(light):
        def brightness(light):
            result = adaptive.shade(light, made, eye, MATERIAL, chosen)
            return jnp.sum(result.color**2), result

        (_, result), slope = jax.value_and_grad(brightness, has_aux=True)(light)
        return result.color, result.active_fraction["specular"], slope

    expected = both(light)
    assert 0 < float(np.min(expected[1])) < 1
    with accelerators.branches(2**21):
        found = both(light)
    for one, other in zip(found, expected, strict=True):
        atol = 1e-14 * float(np.abs(other).max())
        np.testing.assert_allclose(one, other, rtol=0, atol=atol)
