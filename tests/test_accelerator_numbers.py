"""What is computed on an accelerator, in one call or in large blocks, is what a CPU computes.

Forced onto the CPU: the other branch of each `platform_dependent`, with so little room that there
are a few blocks.
"""

import accelerators
import jax
import jax.numpy as jnp
import lowered
import numpy as np
import pytest
from lowered.derivative import is_float, with_gradient

ROWS = 2500  # more than a block on a CPU

# Name of a call, and the room that makes two or three blocks of it on an accelerator.
CALLS = [
    ("harmonics", "evaluate", 2**30),
    ("harmonics", "product", 2**23),
    ("midrange", "interpolate", 2**21),
    ("transfer", "shade_glossy", 2**20),
    ("transfer", "shade_sun.glossy", 2**24),
]
FAST = CALLS[:1]


def smaller(argument, rng):
    """Numbers for a shape, of fewer vertices; in float64, whose rounding takes none past a kink."""
    shape = tuple(ROWS if size == lowered.V else size for size in argument.shape)
    if is_float(argument):
        return jnp.asarray(rng.uniform(0.2, 1.0, size=shape), jnp.float64)
    return jnp.asarray(rng.integers(0, 2, size=shape), argument.dtype)


@pytest.mark.parametrize(
    ("module", "name", "room"),
    [call if call in FAST else pytest.param(*call, marks=pytest.mark.slow) for call in CALLS],
)
def test_the_accelerators_way_gives_the_same_numbers(module, name, room, rng):
    call = lowered.table(module)[name]
    arguments = jax.tree.map(lambda a: smaller(a, rng), call.arguments)
    function = with_gradient(call)
    expected = jax.jit(function)(*arguments)
    with accelerators.branches(room):
        found = jax.jit(lambda *arguments: function(*arguments))(*arguments)
    for one, other in zip(jax.tree.leaves(found), jax.tree.leaves(expected), strict=True):
        if is_float(one):
            atol = 1e-12 * float(np.abs(other).max(initial=0))
            np.testing.assert_allclose(one, other, rtol=0, atol=atol)
        else:
            np.testing.assert_array_equal(one, other)
