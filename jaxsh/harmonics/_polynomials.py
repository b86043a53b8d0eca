"""The basis at low degree as unrolled polynomials that share their powers.

y_lm(x, y, z) = Z_lm(z) · T_m(x, y) on the unit sphere (see `_tables`): the T_m by the recursion
(x + iy)^(m+1) = (x + iy)(x + iy)^m, each Z_lm by Horner's rule in z² - ½, where the polynomial
keeps its digits, times z if it is odd.
"""

import functools
from typing import Any

import numpy as np
from jaxtyping import Array, Float

from ._indexing import index
from ._tables import _positive_roots, _sectoral


def solid_rows(
    x: Float[Array | np.ndarray, "..."],
    y: Float[Array | np.ndarray, "..."],
    z: Float[Array | np.ndarray, "..."],
    degree: int,
) -> list[Any]:
    """The K harmonics of unit vectors (x, y, z), one array each, of their shape and dtype.

    Nothing but elementwise arithmetic, so that XLA fuses it with whatever the rows are used for,
    and NumPy's arrays give NumPy's.
    Derivatives are not those of `_solid`: give a function of these rows a rule of its own.
    """
    u = z * z - 0.5
    rows: list[Any] = [None] * (degree + 1) ** 2
    azimuth = [(x, y)]  # (C_m, S_m) from m = 1 on
    while len(azimuth) < degree:
        c, s = azimuth[-1]
        azimuth.append((x * c - y * s, x * s + y * c))
    for m in range(degree + 1):
        for l in range(m, degree + 1):
            first, *rest = polynomial(l, m)
            zenith = functools.reduce(lambda value, b: value * u + b, rest, first)
            if (l - m) % 2:
                zenith = zenith * z
            if m:
                c, s = azimuth[m - 1]
                rows[index(l, m)], rows[index(l, -m)] = zenith * c, zenith * s
            else:
                rows[index(l, 0)] = zenith + 0 * z if l == 0 else zenith
    return rows


@functools.lru_cache(maxsize=1024)
def polynomial(l: int, m: int) -> tuple[float, ...]:
    """Coefficients of Z_lm, or of Z_lm / z if it is odd, in z² - ½, the highest first."""
    lead = _sectoral(m)
    for k in range(m + 1, l + 1):
        lead = lead * np.sqrt((4 * k**2 - 1) / (k**2 - m**2))
    return tuple(float(c) for c in lead * np.atleast_1d(np.poly(_positive_roots(l, m) ** 2 - 0.5)))
