"""The basis at low degree in one pass over the vectors, for its values alone.

Every harmonic of degree 6 or less is a product of at most four sums of a few terms,

    y_lm = (1, x, y) · (1, z², p, q) · (1, z², p, q) · (1, z, z², p, q),  p = x² - y², q = xy,

on the unit sphere: its roots in z pair up, and so do the lines on which the part in x and y is
zero. Written so, all K harmonics of a vector are one expression whose factors are tables along K,
which XLA computes and stores in any layout without anything held in between.
"""

import functools
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._core.host import read_only_cache
from .._core.xla import materialize
from ._indexing import index
from ._polynomials import polynomial
from ._tables import _positive_roots

# Up to here four sums are enough.
LOW_DEGREE = 6


class _Factors(NamedTuple):
    """Coefficients along K of the sums that a harmonic is the product of."""

    linear: Float[np.ndarray, "3 k"]  # of 1, x, y
    quadratic: list[Float[np.ndarray, "4 k"]]  # of 1, z², p, q
    last: Float[np.ndarray, "5 k"]  # of 1, z², p, q, z


def points_first(vectors: Float[Array, "n 3"], degree: int) -> Float[Array, "n k"]:
    """Harmonics of vectors of any length, coefficients last."""
    if degree == 1:
        return _first_degree(vectors).T
    reciprocal = _reciprocals(vectors)[:, None]
    x, y, z = (_shortened(vectors[:, i : i + 1], reciprocal) for i in range(3))
    return products(x, y, z, degree, (1, -1))


def coefficients_first(vectors: Float[Array, "n 3"], degree: int) -> Float[Array, "k n"]:
    """Harmonics of vectors of any length, coefficients first."""
    if degree == 1:
        return _first_degree(vectors)

    def units(vectors):
        reciprocal = _reciprocals(vectors)
        return jnp.stack([_shortened(vectors[:, i], reciprocal) for i in range(3)])

    x, y, z = materialize(units, vectors)[:, None]
    return products(x, y, z, degree, (-1, 1))


def _first_degree(vectors: Float[Array, "n 3"]) -> Float[Array, "4 n"]:
    """Harmonics of degree 0 and 1: a constant and unit vectors, of which no factor is shared."""
    reciprocal = _reciprocals(vectors)
    constant, scale = (np.sqrt(value / np.pi).astype(vectors.dtype) for value in (0.25, 0.75))
    x, y, z = (scale * _shortened(vectors[:, i], reciprocal) for i in range(3))
    return jnp.stack([constant + 0 * x, y, z, x])  # NaN in all rows where a vector is zero


def _reciprocals(vectors: Float[Array, "n 3"]) -> Float[Array, " n"]:
    """Reciprocal lengths: times -256 of large vectors, where they might be subnormal.

    NaN where a vector is not finite.
    """
    x, y, z = (vectors[:, i] for i in range(3))
    largest = jnp.maximum(jnp.maximum(jnp.abs(x), jnp.abs(y)), jnp.abs(z))
    third = jnp.finfo(x.dtype).maxexp // 3
    small, large = largest < 2.0**-third, largest > 2.0**third

    def one_but(condition, value):
        """Chooses of two scalars: JAX 0.12 cannot of one and rows that devices share."""
        value, one = jnp.asarray(value, x.dtype), jnp.asarray(1, x.dtype)
        return jnp.where(condition, value, one)

    power = one_but(small, 2.0 ** (2 * third)) * one_but(large, 2.0 ** (-2 * third))
    divisor = one_but(small, 2.0 ** (-2 * third)) * one_but(large, -(2.0 ** (2 * third - 8)))
    divisor = divisor * one_but(~(largest < np.inf), np.nan)
    x, y, z = x * power, y * power, z * power
    # A quotient, since XLA computes those once, where it would make a product anew for each use.
    return jnp.sqrt(1 / (x * x + y * y + z * z)) / divisor


def _shortened(component: Float[Array, "..."], reciprocal: Float[Array, "..."]):
    """A component at unit length."""
    one, back = (jnp.asarray(value, component.dtype) for value in (1, -(2.0**-8)))
    return component * reciprocal * jnp.where(reciprocal < 0, back, one)


def products(x, y, z, degree: int, shape: tuple[int, int]) -> Float[Array, "..."]:
    """All harmonics of unit vectors, with K along the axis where `shape` has -1."""
    factors = _factors(degree)
    squares = z * z, (x - y) * (x + y), x * y
    sums = [_sum(factors.linear, (x, y), shape)]
    sums += [_sum(quadratic, squares, shape) for quadratic in factors.quadratic]
    sums += [_sum(factors.last, (*squares, z), shape)]
    return functools.reduce(jnp.multiply, sums)


def _sum(table: Float[np.ndarray, "terms k"], terms, shape) -> Float[Array, "..."]:
    """Sum of a constant and the terms, of those that any harmonic has."""
    constant, *rows = (jnp.asarray(row.reshape(shape), terms[0].dtype) for row in table)
    there = np.any(table[1:] != 0, axis=1).tolist()
    used = (row * term for row, term, any_ in zip(rows, terms, there, strict=True) if any_)
    return functools.reduce(jnp.add, used, constant)


@read_only_cache(maxsize=None)
def _factors(degree: int) -> _Factors:
    count, pairs = (degree + 1) ** 2, max(1, (degree - 1) // 2)
    linear, last = np.zeros((3, count)), np.zeros((5, count))
    quadratic = np.zeros((pairs, 4, count))
    linear[0] = last[0] = quadratic[:, 0] = 1
    for m in range(degree + 1):
        for l in range(m, degree + 1):
            zenith = [np.array([-root, 1, 0, 0]) for root in _positive_roots(l, m) ** 2]
            for sign in (1, -1) if m else (1,):
                k = index(l, sign * m)
                if m % 2:
                    linear[:, k] = (0, 1, 0) if sign > 0 else (0, 0, 1)
                squares, lead = [*_azimuth(m, sign), *zenith], polynomial(l, m)[0]
                if squares:
                    squares[0] = lead * squares[0]
                else:
                    linear[:, k] *= lead
                if (l - m) % 2:
                    last[:, k] = 0, 0, 0, 0, 1
                elif len(squares) > pairs:
                    last[:4, k] = squares.pop()
                for place, square in enumerate(squares):
                    quadratic[place, :, k] = square
    return _Factors(linear, list(quadratic), last)


def _azimuth(m: int, sign: int) -> list[Float[np.ndarray, "4"]]:
    """Factors of the real (sign 1) or imaginary part of (x + iy)^m, but for x or y.

    Of even m it is that of (p + 2iq)^(m/2), a product of m/2 lines through zero. Of odd m the lines
    pair up left and right of x or y: x² sin²b - y² cos²b = (p - (1 - z²) cos 2b)/2.
    """
    half = m // 2
    if m % 2:
        scale = 2.0 ** (m - 1)
        cosines = np.cos((np.arange(half) + (0.5 if sign > 0 else 1)) * 2 * np.pi / m)
        rows = [np.array([-c, c, 1, 0]) / 2 for c in cosines]
    else:
        scale = 2.0 ** max(half - 1, 0)
        angles = (np.arange(half) + (0.5 if sign > 0 else 0)) * np.pi / max(half, 1)
        rows = [np.array([0, 0, np.sin(b), 2 * np.cos(b)]) for b in angles]
    return [scale * row if i == 0 else row for i, row in enumerate(rows)]
