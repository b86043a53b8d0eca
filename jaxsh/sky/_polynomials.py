"""Families of polynomials, all rows of one at once.

A recursion gives XLA a kernel for each row, and a kernel costs a microsecond however little it
does: for a few suns that is most of the time. Products over the roots of each row are one kernel
for all, and lose no more to rounding than the argument has lost. For many suns, and more so in
reverse mode, the recursion is faster.
"""

import functools

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._core.host import read_only_cache

# Suns at most for which the products are the faster way.
FEW = 32


def chebyshev(x: Float[Array, " n"], count: int) -> Float[Array, "count n"]:
    """Chebyshev's T_0 to T_(count-1) in rows. Differentiable."""
    if x.size <= FEW:
        return _products(_chebyshev_factors(count), x * x, x)
    rows = [jnp.ones_like(x), x]
    while len(rows) < count:
        rows.append(2 * x * rows[-1] - rows[-2])
    return jnp.stack(rows[:count])


def circular(x: Float[Array, " n"], y: Float[Array, " n"], degree: int) -> Float[Array, "m n"]:
    """Rows m = -degree … degree: imaginary and, for m ≥ 0, real parts of (x + iy)^|m|.

    Differentiable.
    """
    if x.size <= FEW:
        return _products(_circular_factors(degree), x, y)
    rows = [(jnp.ones_like(x), jnp.zeros_like(x))]
    for _ in range(degree):
        real, imaginary = rows[-1]
        rows.append((real * x - imaginary * y, real * y + imaginary * x))
    return jnp.stack([row[1] for row in rows[:0:-1]] + [row[0] for row in rows])


def _products(
    factors: Float[np.ndarray, "factors rows 3"], a: Float[Array, " n"], b: Float[Array, " n"]
) -> Float[Array, "rows n"]:
    """Products of α a + β b + γ, a row for each row of the factors."""
    rows = (jnp.asarray(row.T[..., None], a.dtype) for row in factors)
    return functools.reduce(jnp.multiply, (p * a[None] + q * b[None] + r for p, q, r in rows))


@read_only_cache(maxsize=None)
def _chebyshev_factors(count: int) -> Float[np.ndarray, "factors count 3"]:
    """T_i = 2^(i-1) x^(i mod 2) Π_k (x² - cos²((2k - 1) π/2i)), with (x², x) as a and b."""
    factors = np.zeros((max(1, (count + 1) // 2), count, 3))
    factors[..., 2] = 1
    for i in range(1, count):
        pairs = i // 2
        roots = np.cos((2 * np.arange(pairs) + 1) * np.pi / (2 * i))
        scale = 2 ** ((i - 1) / max(pairs, 1))
        factors[:pairs, i] = np.stack(
            [np.full(pairs, scale), np.zeros(pairs), -scale * roots**2], axis=-1
        )
        if i % 2:
            factors[pairs, i] = 0, 1, 0
    return factors


@read_only_cache(maxsize=None)
def _circular_factors(degree: int) -> Float[np.ndarray, "factors rows 3"]:
    """r^m cos mφ = 2^(m-1) Π_k r sin(φ + (2k - 1) π/2m), and sin mφ with (k - 1) π/m."""
    factors = np.zeros((max(1, degree), 2 * degree + 1, 3))
    factors[..., 2] = 1
    for m in range(1, degree + 1):
        scale = 2 ** ((m - 1) / m)
        for row, shift in ((degree + m, 0.5), (degree - m, 0.0)):
            angle = (np.arange(m) + shift) * np.pi / m
            factors[:m, row] = scale * np.stack(
                [np.sin(angle), np.cos(angle), np.zeros(m)], axis=-1
            )
    return factors
