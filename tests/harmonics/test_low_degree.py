"""Values of low degree are one pass over the vectors, of any length, in both layouts."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import harmonics
from jaxsh.harmonics import _basis


# Largest error: 2.4e-6 in float32, 4.4e-15 in float64.
@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float32, 4e-6), (np.float64, 8e-15)])
@pytest.mark.parametrize("axis", [0, -1])
def test_values_are_those_that_derivatives_come_with(dtype, tolerance, axis):
    random = np.random.default_rng(0)
    vectors = random.normal(size=(300, 3))
    # Up to the ends of the range, where squares and reciprocals of lengths leave it.
    high = np.log10(float(np.finfo(dtype).max)) - 0.1
    vectors *= 10 ** random.uniform(-high + 1.5, high - 0.7, (300, 1))
    vectors = jnp.asarray(vectors.astype(dtype))
    for degree in (2, 6):
        values = harmonics.evaluate(vectors, degree, axis=axis)
        assert values.dtype == dtype
        rows = _basis._by_rows(vectors, degree, axis)
        np.testing.assert_allclose(values, rows, 0, tolerance)


def test_what_has_no_direction_is_nan():
    wrong = jnp.array([[0.0, 0, 0], [np.inf, 1, 1], [1, np.nan, 0]])
    for axis in (0, -1):
        assert np.isnan(harmonics.evaluate(wrong, 3, axis=axis)).all()
