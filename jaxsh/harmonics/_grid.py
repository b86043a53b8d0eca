"""A product grid on the sphere with the basis on it: host constants for exact integrals.

Gauss–Legendre in cos θ and equal steps in φ integrate every polynomial up to the grid's degree
exactly, so products and rotations of band-limited functions are sums over its points.
"""

import functools
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ._indexing import orders
from ._tables import legendre


class Grid(NamedTuple):
    """Directions with weights, and the basis there, in float64 on the host."""

    directions: Float[np.ndarray, "n 3"]
    weights: Float[np.ndarray, " n"]
    basis: Float[np.ndarray, "k n"]


@functools.lru_cache(maxsize=32)
def exact_grid(degree: int, basis_degree: int) -> Grid:
    """Integrates polynomials of `degree` exactly; the basis goes up to `basis_degree`."""
    return _product_grid(degree // 2 + 1, degree + 1, degree + 1, basis_degree)


@functools.lru_cache(maxsize=32)
def even_grid(degree: int) -> Grid:
    """Integrates even polynomials of 2·`degree` exactly, with the basis up to `degree`.

    Products of two harmonics of one degree are even, so of a full grid of 2·degree + 2 azimuths
    one of each antipodal pair will do, at twice the weight.
    """
    return _product_grid(degree + 1, 2 * degree + 2, degree + 1, degree)


def _product_grid(rings: int, steps: int, used: int, basis_degree: int) -> Grid:
    cos_theta, ring_weights = np.polynomial.legendre.leggauss(rings)
    phi = 2 * np.pi * np.arange(used) / steps
    sin_theta = np.sqrt(1 - cos_theta**2)
    x, y = np.multiply.outer(sin_theta, np.cos(phi)), np.multiply.outer(sin_theta, np.sin(phi))
    z = np.broadcast_to(cos_theta[:, None], x.shape)
    weights = np.broadcast_to(ring_weights[:, None] * 2 * np.pi / used, x.shape)
    m = orders(basis_degree)[:, None]
    azimuth = np.where(m < 0, np.sin(-m * phi), np.cos(m * phi))
    basis = legendre(cos_theta, basis_degree)[:, :, None] * azimuth[:, None]
    directions = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return Grid(directions, weights.ravel(), basis.reshape(len(basis), -1))
