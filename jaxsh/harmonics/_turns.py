"""Exact matrices of axes that are exchanged or turned round, for functions of any degree."""

import functools
import math

import numpy as np
from jaxtyping import Float

# Exchanges whose product is each order of the axes: f(x, y, z) → f with these arguments.
_EXCHANGES: dict[tuple[int, ...], tuple[str, ...]] = {
    (0, 1, 2): (),
    (1, 0, 2): ("xy",),
    (2, 1, 0): ("xz",),
    (0, 2, 1): ("xy", "xz", "xy"),
    (1, 2, 0): ("xy", "xz"),
    (2, 0, 1): ("xz", "xy"),
}


@functools.lru_cache(maxsize=32)
def axes_blocks(
    turn: tuple[tuple[int, ...], ...], degree: int
) -> tuple[Float[np.ndarray, "m m"], ...]:
    """Build D for a signed permutation Q: `D @ c` are the coefficients of f(Qᵀω).

    One block for each degree l, in float64, for rotations and reflections. There is no quadrature:
    signs and exchanges of x and y are read off cos mφ and sin mφ, and the exchange of x and z is a
    quarter turn, whose elements are integers times a root.
    """
    inverse = np.array(turn).T
    order = tuple(int(np.flatnonzero(row)[0]) for row in inverse)
    signs = [int(row[column]) for row, column in zip(inverse, order, strict=True)]
    return tuple(_block(l, order, signs) for l in range(degree + 1))


def _block(l: int, order: tuple[int, ...], signs: list[int]) -> Float[np.ndarray, "m m"]:
    m = np.arange(-l, l + 1)
    odd, sine = m % 2 == 1, m < 0
    flips = (odd ^ sine, sine, (l - m) % 2 == 1)
    matrix = np.eye(2 * l + 1)
    for flip, sign in zip(flips, signs, strict=True):
        if sign < 0:
            matrix = np.where(flip, -1.0, 1.0)[:, None] * matrix
    for exchange in _EXCHANGES[order]:
        matrix = (_exchange_xy(l) if exchange == "xy" else _exchange_xz(l)) @ matrix
    return matrix


def _exchange_xy(l: int) -> Float[np.ndarray, "m m"]:
    """The matrix of f(y, x, z): φ becomes π/2 - φ."""
    matrix = np.zeros((2 * l + 1, 2 * l + 1))
    matrix[l, l] = 1.0
    for m in range(1, l + 1):
        cosine, sine = ((1, 0), (0, 1), (-1, 0), (0, -1))[m % 4]  # of mπ/2
        matrix[l + m, l + m], matrix[l - m, l + m] = cosine, sine
        matrix[l + m, l - m], matrix[l - m, l - m] = sine, -cosine
    return matrix


@functools.lru_cache(maxsize=256)
def _exchange_xz(l: int) -> Float[np.ndarray, "m m"]:
    """The matrix of f(z, y, x), from Wigner's d(π/2), between cosines and between sines.

    d_nm = 2^-l K √(C(2l, l+m) / C(2l, l+n)), where K is the coefficient of t^(l+n) in
    (1 + t)^(l+m) (1 - t)^(l-m), an integer. Each element is rounded a few times only.
    """
    choose = [math.comb(2 * l, k) for k in range(2 * l + 1)]
    # From (1 - t)^2l on, each row is the last one over (1 - t), times (1 + t).
    row = np.array([(-1) ** k * c for k, c in enumerate(choose)], object)
    rows = [row]
    for _ in range(2 * l):
        quotient = np.add.accumulate(row)
        row = quotient + np.append([0], quotient[:-1])
        rows.append(row)
    integers = np.array(rows, object).T / 2**l  # [l + n, l + m]
    root = np.sqrt(np.array(choose, float))
    d = integers.astype(float) * root / root[:, None]
    n = np.arange(l + 1)
    sign = np.where(n % 2 == 1, -1.0, 1.0)
    same, opposite = d[l:, l:], d[l:, l::-1]
    half = np.where(n == 0, math.sqrt(0.5), 1.0)
    matrix = np.zeros((2 * l + 1, 2 * l + 1))
    same = same * sign[:, None]
    opposite = opposite * sign[:, None] * sign
    matrix[l:, l:] = (same + opposite) * half[:, None] * half
    matrix[:l, :l] = (opposite - same)[:0:-1, :0:-1]
    return matrix
