"""The basis on a mesh of devices."""

import jax
import numpy as np
import pytest
from sharding import ROWS, check_sharded

from jaxsh import harmonics


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_values_and_gradient_keep_the_sharding_of_directions(rng, dtype):
    directions = rng.normal(size=(64, 3)).astype(dtype)
    check_sharded(lambda d: harmonics.evaluate(d, 3), (directions,), (ROWS,), ROWS)
    check_sharded(
        lambda d: harmonics.evaluate_with_gradient(d, 3), (directions,), (ROWS,), (ROWS, ROWS)
    )
    check_sharded(jax.grad(lambda d: harmonics.evaluate(d, 3).sum()), (directions,), (ROWS,), ROWS)
