"""The paper's own fit: plain polynomials in θ and τ (Habel et al. 2008, eq. 1)."""

import functools
import math
from fractions import Fraction

import numpy as np
from jaxtyping import Float

from ._azimuth import half_rows
from ._chebyshev import Axis
from ._fit import fit
from ._preetham import preetham_radiance
from ._preetham_constants import Constants, preetham_constants
from ._sky_fit import SkyFit


def habel2008_fit(
    terms: tuple[int, int] = (14, 8),
    turbidity: tuple[float, float] = (2.5, 6.0),
    degree: int = 6,
    *,
    constants: Constants = "paper",
    **options,
) -> SkyFit:
    """Habel et al. 2008: each weight a polynomial in θ and τ of degree (13, 7), for 7 bands.

    The same polynomials as the paper's, found in Chebyshev polynomials of θ and τ: in the
    monomials of eq. 1 no solver reaches them (condition number 4e19). `habel2008_monomials`
    converts them. Linear sRGB, kcd/m². Further options as for `fit`.

    Not smooth where the sun passes the zenith: weights with m ≠ 0 are small there but not zero,
    and take the azimuth 0. Worst E_mean over the range: 0.28 % at 5 bands and 0.31 % at 7;
    Lawson's rounds with 1/L_min as `weight` end there too, so no polynomial of this degree does
    much better. The paper says less than 0.005 % and 1.5 %.
    """
    return fit(
        _model(constants),
        {"turbidity": turbidity},
        degree=degree,
        terms=terms,
        parity=False,
        **options,
    )


def habel2008_monomials(fit: SkyFit) -> Float[np.ndarray, "k i j channels"]:
    """The coefficients p of eq. 1, c_lm = Σ_ij p_lm,ij θ^i τ^j, as the authors publish theirs.

    (K, terms in θ, terms in τ, channels) in NumPy float64, zero for m < 0. The conversion from
    Chebyshev coefficients is done in exact integers and rounded once. The sum itself cancels
    terms of 1e9 of its size: at degree (13, 7) it keeps seven digits in float64, and none in
    float32.

    Raises `ValueError` for a fit with parity, prefactor or logarithms, which is no polynomial.
    """
    if fit.parity or fit.prefactor is not None or any(axis.log for axis in fit.axes):
        raise ValueError("only a plain fit in θ and τ is a polynomial: see habel2008_fit")
    if len(fit.axes) != 2:
        raise ValueError(f"expected θ and one parameter, got {[axis.name for axis in fit.axes]}")
    mix, series = (np.asarray(a, np.float64) for a in (fit.mix, fit.coefficients))
    mixed = np.einsum("oc,crij->roij", mix, series)
    integers, size = _integers(np.vectorize(Fraction, "O")(mixed))
    theta, tau = (
        _integers(_exact_monomials(axis, count))
        for axis, count in zip(fit.axes, mixed.shape[2:], strict=True)
    )
    powers = theta[0].T @ integers @ tau[0] / (theta[1] * size * tau[1])
    table = np.zeros(((fit.degree + 1) ** 2, *mixed.shape[2:], mixed.shape[1]))
    table[half_rows(fit.degree)] = np.moveaxis(powers.astype(np.float64), 1, -1)
    return table


def evaluate_monomials(
    table: Float[np.ndarray, "k i j channels"],
    theta: Float[np.ndarray, " n"],
    turbidity: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n channels k"]:
    """Eq. 1 as the paper has it, in NumPy and in the table's dtype: suns at azimuth 0."""
    powers = (
        np.power.outer(np.asarray(x, table.dtype), np.arange(count, dtype=table.dtype))
        for x, count in zip((theta, turbidity), table.shape[1:3], strict=True)
    )
    return np.einsum("kijc,ni,nj->nck", table, *powers, optimize=True)


def _exact_monomials(axis: Axis, count: int) -> np.ndarray:
    """Fractions t_ik of T_i(scaled x) = Σ_k t_ik x^k, (count, count)."""
    low, high = Fraction(axis.low), Fraction(axis.high)
    slope, offset = 2 / (high - low), -(low + high) / (high - low)
    table = np.full((max(count, 2), count + 1), Fraction(0), object)
    table[0, 0], table[1, 0], table[1, 1] = Fraction(1), offset, slope
    for i in range(2, count):
        table[i] = 2 * offset * table[i - 1] - table[i - 2]
        table[i, 1:] += 2 * slope * table[i - 1, :-1]
    return table[:count, :count]


def _integers(fractions: np.ndarray) -> tuple[np.ndarray, int]:
    """Numerators over a common denominator: integers multiply without reducing."""
    common = math.lcm(*(f.denominator for f in fractions.flat))
    return np.vectorize(lambda f: int(f * common), "O")(fractions), common


@functools.cache
def _model(constants: Constants):
    preetham_constants(constants)
    return functools.partial(preetham_radiance, constants=constants, check="allow")
