"""The same mathematics by the peers, each in its fastest documented form and its own layout."""

from collections.abc import Callable
from typing import Any

import e3nn_jax
import jax
import numpy as np
import sphericart.jax
from scipy.special import sph_harm_y
from sphericart.jax.dsph import dsph

from jaxsh.harmonics import degrees, orders

# e3nn's axis of the order is y: its basis of (x, y, z) is ours of (z, x, y).
_TO_E3NN = [1, 2, 0]


def sphericart_values(vectors, degree: int):
    """(N, K), of vectors of any length."""
    return sphericart.jax.spherical_harmonics(vectors, degree)


def sphericart_solid(vectors, degree: int):
    """(N, K) polynomials r^l y_lm: cheaper, the same on unit vectors only."""
    return sphericart.jax.solid_harmonics(vectors, degree)


def sphericart_gradient(vectors, degree: int):
    """(N, K) and (N, 3, K): the primitive behind its derivatives, which returns both at once."""
    return dsph(vectors, degree, True)


def e3nn_values(vectors, degree: int):
    """(N, K)."""
    return e3nn_jax.spherical_harmonics(
        e3nn_jax.s2_irreps(degree), vectors[:, _TO_E3NN], True, normalization="integral"
    ).array


def scipy_values(vectors, degree: int) -> np.ndarray:
    """(N, K) in float64, one order at a time: also the oracle of the table of errors."""
    x, y, z = np.moveaxis(np.asarray(vectors, np.float64), -1, 0)
    theta, phi = np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)
    columns = []
    for l, m in zip(degrees(degree), orders(degree), strict=True):
        value = sph_harm_y(l, abs(m), theta, phi) * (-1.0) ** m * (np.sqrt(2) if m else 1)
        columns.append(value.imag if m < 0 else value.real)
    return np.stack(columns, axis=-1)


def pullback(values: Callable[..., Any], degree: int, cotangent) -> Callable[[Any], Any]:
    """Reverse mode: the gradient of Σ cotangent · y with respect to the vectors."""
    return lambda vectors: jax.vjp(lambda v: values(v, degree), vectors)[1](cotangent)[0]
