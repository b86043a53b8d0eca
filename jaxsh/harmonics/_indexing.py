"""Order of the coefficients: i = l(l+1) + m, degree l = 0..L, order m = -l..l ("ACN")."""

import math

import numpy as np
from jaxtyping import Int

from .._core.checks import check_degree, described


def num_coefficients(degree: int) -> int:
    """Count the coefficients of a function of this degree: K = (degree + 1)².

    Raises `ValueError` unless `degree` is an integer >= 0.

    **Example**

    >>> from jaxsh import harmonics
    >>> harmonics.num_coefficients(10)
    121
    """
    return (check_degree(degree) + 1) ** 2


def degree_of(count: int) -> int:
    """Find the degree of a function with `count` coefficients: the inverse of `num_coefficients`.

    Raises `ValueError` where `count` is not a square: 1, 4, 9, 16, …

    **Example**

    >>> from jaxsh import harmonics
    >>> harmonics.degree_of(9)
    2
    """
    whole = isinstance(count, int | np.integer) and not isinstance(count, bool)
    bands = math.isqrt(count) if whole and count > 0 else 0
    if bands == 0 or bands**2 != count:
        raise ValueError(
            "expected (degree + 1)² = 1, 4, 9, 16, … coefficients on the last axis, got "
            f"{described(count)}"
        )
    return bands - 1


def index(l: int, m: int) -> int:
    """Locate y_lm on the coefficient axis: l(l+1) + m.

    Raises `ValueError` unless l ≥ 0 and |m| ≤ l.

    **Example**

    >>> from jaxsh import harmonics
    >>> harmonics.index(2, -1)
    5
    """
    l = check_degree(l, "l")
    if not isinstance(m, int | np.integer) or isinstance(m, bool) or abs(m) > l:
        raise ValueError(f"expected m as an integer from -l to l, got {described(m)} for l = {l}")
    return l * (l + 1) + int(m)


def degrees(degree: int) -> Int[np.ndarray, " k"]:
    """List the degree l of each of the K coefficients: 0, 1, 1, 1, 2, … as NumPy int32.

    **Example**

    >>> from jaxsh import harmonics
    >>> harmonics.degrees(1).tolist()
    [0, 1, 1, 1]
    """
    # int32, as an index and as a factor the same with and without x64.
    ls = np.arange(check_degree(degree) + 1, dtype=np.int32)
    return np.repeat(ls, 2 * ls + 1)


def orders(degree: int) -> Int[np.ndarray, " k"]:
    """List the order m of each of the K coefficients: 0, -1, 0, 1, -2, … as NumPy int32.

    **Example**

    >>> from jaxsh import harmonics
    >>> harmonics.orders(1).tolist()
    [0, -1, 0, 1]
    """
    l = degrees(degree)
    return np.arange(len(l), dtype=np.int32) - l * (l + 1)
