"""Prior of real light: how fast its bands fall off."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._core.checks import check_size

# Mean square of a coefficient of degree l, in that of the constant one: _LEVEL · l^-_FALL. Printed
# by `python -m experiments run inverse.prior --preset paper`, from five probes.
_LEVEL, _FALL = 0.281, 0.965


def light_variances(degree: int) -> Float[Array, " degree"]:
    """Give the variances of the bands of real light: of each coefficient of degree l = 1, 2, ….

    They are relative to the square of the constant coefficient of the same channel, and follow a
    power law, 0.281 · l^-0.965, the most probable for five light probes (grace, galileo,
    eucalyptus, stpeters and uffizi: `python -m experiments run inverse.prior --preset paper`). The
    prior of `fit_light`; multiply it for light that is more even or has more contrast. A probe's
    bands are on the whole 0.3 to 2.7 times those of the law of the others. It knows no up or down.

    **Returns** (degree,) in JAX's default float type. Raises `ValueError` unless `degree` is an
    integer >= 1.

    **Example**

    >>> from jaxsh import inverse
    >>> [round(float(v), 3) for v in inverse.light_variances(3)]
    [0.281, 0.144, 0.097]
    """
    return jnp.asarray(power_law(check_size("degree", degree)), jnp.result_type(float))


def power_law(degree: int) -> Float[np.ndarray, " degree"]:
    """The same numbers on the host."""
    return _LEVEL * np.arange(1.0, degree + 1) ** -_FALL
