"""Where y_lm lives: coefficient i = l(l+1) + m, degree l = 0..L, order m = -l..l ("ACN")."""

import math
import operator

import numpy as np
from jaxtyping import Int

from .._core.checks import check_degree


def num_coefficients(degree: int) -> int:
    """Number of coefficients K = (degree + 1)² of a function of this degree."""
    return (check_degree(degree) + 1) ** 2


def degree_of(count: int) -> int:
    """Degree of a function with `count` coefficients; the inverse of `num_coefficients`.

    Raises `ValueError` where `count` is not a square: 1, 4, 9, 16, …
    """
    bands = math.isqrt(count) if isinstance(count, int | np.integer) and count > 0 else 0
    if bands == 0 or bands**2 != count:
        raise ValueError(
            f"expected (degree + 1)² = 1, 4, 9, 16, … coefficients on the last axis, got {count}"
        )
    return bands - 1


def index(l: int, m: int) -> int:
    """Position l(l+1) + m of y_lm on the coefficient axis.

    Raises `ValueError` unless l ≥ 0 and |m| ≤ l.
    """
    l, m = operator.index(l), operator.index(m)
    if l < 0 or abs(m) > l:
        raise ValueError(f"expected l >= 0 and -l <= m <= l, got l = {l}, m = {m}")
    return l * (l + 1) + m


def degrees(degree: int) -> Int[np.ndarray, " k"]:
    """Degree l of each of the K coefficients: 0, 1, 1, 1, 2, …"""
    # int32, as an index and as a factor the same with and without x64.
    ls = np.arange(check_degree(degree) + 1, dtype=np.int32)
    return np.repeat(ls, 2 * ls + 1)


def orders(degree: int) -> Int[np.ndarray, " k"]:
    """Order m of each of the K coefficients: 0, -1, 0, 1, -2, …"""
    l = degrees(degree)
    return np.arange(len(l), dtype=np.int32) - l * (l + 1)
