"""Functions turned to axes, against their rotation by matrices."""

import jax.numpy as jnp
import numpy as np

from jaxsh import harmonics
from jaxsh.adaptive._tile_samples import turns
from jaxsh.adaptive._turned import turned


def test_functions_turn_as_the_frames_do(rng):
    axes = rng.normal(size=(8, 3))
    axes[:4] = [[0, 0, 1], [0, 0, -1], [1e-9, -1e-9, 1], [0, 1e-9, -1]]  # at the poles, too
    axes = jnp.asarray(axes / np.linalg.norm(axes, axis=1, keepdims=True))
    rows, frames = jnp.asarray(rng.normal(size=(2, 25))), turns(axes)
    np.testing.assert_allclose(frames[:, :, 2], axes, rtol=0, atol=1e-15)
    gram = jnp.swapaxes(frames, 1, 2) @ frames
    np.testing.assert_allclose(gram, np.tile(np.eye(3), (8, 1, 1)), rtol=0, atol=1e-15)
    expected = harmonics.rotate(rows, frames[:, None])
    np.testing.assert_allclose(turned(rows, axes), expected, rtol=0, atol=2e-14)
