"""Plain polynomials in θ and τ, the paper's own fit (Habel et al. 2008, eq. 1), and its export."""

import functools
import math
from fractions import Fraction

import numpy as np
from jaxtyping import Float

from .._core.checks import as_host_float, check_options, check_type
from ._angles import half_rows
from ._fit import OPTIONS, fit
from ._preetham import Constants, preetham_constants, preetham_radiance
from ._sky_fit import Axis, SkyFit


def habel2008_fit(
    terms: tuple[int, int] = (14, 8),
    turbidity: tuple[float, float] = (2.5, 6.0),
    degree: int = 6,
    *,
    constants: Constants = "paper",
    **options,
) -> SkyFit:
    """Fits each weight by a polynomial in θ and τ of degree (13, 7), as Habel et al. 2008 do.

    The same polynomials as the paper's, found in Chebyshev polynomials of θ and τ: in the
    monomials of eq. 1 no solver reaches them (condition number 4e19). `habel2008_monomials`
    converts them. Linear sRGB, kcd/m². Further options as for `fit`.

    Not smooth where the sun passes the zenith: weights with m ≠ 0 are small there but not zero,
    and take the azimuth 0. Worst E_mean over the range: 0.28 % at 5 bands and 0.31 % at 7;
    Lawson's rounds with 1/L_min as `weight` end there too, so no polynomial of this degree does
    much better. The paper says less than 0.005 % and 1.5 %. `preetham_fit` is smooth there.

    **Example**

    >>> from jaxsh import sky
    >>> fitted = sky.habel2008_fit((4, 3), degree=1, solver="qr")
    >>> sky.habel2008_monomials(fitted).shape
    (4, 4, 3, 3)
    """
    preetham_constants(constants)
    check_type("terms", terms, tuple, list)
    check_options("habel2008_fit", options, OPTIONS)
    return fit(
        _model(constants),
        {"turbidity": turbidity},
        degree=degree,
        terms=terms,
        parity=False,
        **options,
    )


def habel2008_monomials(fit: SkyFit) -> Float[np.ndarray, "k i j channels"]:
    """Converts a fit to the coefficients p of eq. 1, c_lm = Σ_ij p_lm,ij θ^i τ^j, as published.

    (K, terms in θ, terms in τ, channels) in NumPy float64, zero for m < 0. The conversion from
    Chebyshev coefficients is done in exact integers and rounded once. The sum itself cancels
    terms of 1e9 of its size: at degree (13, 7) it keeps seven digits in float64, and none in
    float32.

    Raises `ValueError` for a fit with parity, prefactor or logarithms, which is no polynomial.

    **Example**

    >>> from jaxsh import sky
    >>> fitted = sky.habel2008_fit((4, 3), degree=1, solver="qr")
    >>> table = sky.habel2008_monomials(fitted)
    >>> table.shape, bool((table[1] == 0).all())
    ((4, 4, 3, 3), True)
    """
    check_type("fit", fit, SkyFit)
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


def habel2008_evaluate(
    table: Float[np.ndarray, "k i j channels"],
    theta: Float[np.ndarray, " n"],
    turbidity: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n channels k"]:
    """Evaluates eq. 1 of Habel et al. 2008 as printed, for suns at azimuth 0: (n, channels, K).

    `table`: as `habel2008_monomials` gives it or the authors publish theirs; `theta` (n,): the
    sun's angle from the zenith; `turbidity` (n,). In NumPy on the host, in the table's dtype: at
    degree (13, 7) the sum keeps seven digits in float64 and none in float32.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> table = sky.habel2008_monomials(sky.habel2008_fit((4, 3), degree=1, solver="qr"))
    >>> sky.habel2008_evaluate(table, np.array([0.2, 0.9]), np.array([3.0, 4.0])).shape
    (2, 3, 4)
    """
    table = as_host_float(table, "table")
    if table.ndim != 4 or math.isqrt(len(table)) ** 2 != len(table):
        raise ValueError(
            "expected table (K, terms in θ, terms in τ, channels) with K = 1, 4, 9, …, got shape "
            f"{table.shape}"
        )
    theta, turbidity = as_host_float(theta, "theta"), as_host_float(turbidity, "turbidity")
    if theta.ndim != 1 or theta.shape != turbidity.shape:
        raise ValueError(
            f"expected theta and turbidity (n,), got shapes {theta.shape} and {turbidity.shape}"
        )
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
    return functools.partial(preetham_radiance, constants=constants, check="allow")


_HEADER = """\
/* Sky light in spherical harmonics: Habel, Mustata and Wimmer 2008, eqs. 1 and 4. Made by jaxsh.

   Polynomials in the sun's zenith angle, 0 to {theta:.17g}, and {name}, {low:.17g} to {high:.17g};
   no range is checked. Coefficients of the real orthonormal harmonics without Condon-Shortley
   phase, index l(l + 1) + m, m < 0 for the sines, z up, azimuths from +x towards +y.
   Use doubles: the sums cancel. */
#ifndef {guard}
#define {guard}

#include <math.h>

#define {guard}_DEGREE {degree}
#define {guard}_CHANNELS {channels}

/* For each (l, m >= 0) and channel, powers of the angle by powers of {name}. */
static const double {prefix}_table[{rows}][{channels}][{i}][{j}] = {{
{table}
}};

static void {prefix}(double theta, double phi, double {name},
    double coefficients[{channels}][{count}])
{{
    int l, m, c, i, j, row = 0;
    for (l = 0; l <= {degree}; ++l)
        for (m = 0; m <= l; ++m, ++row)
            for (c = 0; c < {channels}; ++c) {{
                double value = 0;
                for (i = {i} - 1; i >= 0; --i) {{
                    double inner = 0;
                    for (j = {j} - 1; j >= 0; --j)
                        inner = inner * {name} + {prefix}_table[row][c][i][j];
                    value = value * theta + inner;
                }}
                coefficients[c][l * (l + 1) - m] = value * sin(m * phi);
                coefficients[c][l * (l + 1) + m] = value * cos(m * phi);
            }}
}}

#endif
"""


def c_header(fit: SkyFit, prefix: str = "sky_harmonics") -> str:
    """Writes a C89 header: the fit's monomials, `prefix(theta, phi, parameter, coefficients)`.

    For a fit that `habel2008_monomials` takes, `habel2008_fit` first of all; in doubles, by
    Horner's rule. Raises `ValueError` for a prefix that is no name in C.

    **Example**

    >>> from jaxsh import sky
    >>> header = sky.c_header(sky.habel2008_fit((4, 3), degree=1, solver="qr"), "my_sky")
    >>> "static void my_sky(double theta, double phi, double turbidity," in header
    True
    """
    check_type("fit", fit, SkyFit)
    check_type("prefix", prefix, str)
    if not (prefix.isidentifier() and prefix.isascii()):
        raise ValueError(f"prefix must be a name in C, got {prefix!r}")
    table = np.moveaxis(habel2008_monomials(fit)[half_rows(fit.degree)], -1, 1)
    height, parameter = fit.axes
    return _HEADER.format(
        guard=prefix.upper(),
        prefix=prefix,
        name=parameter.name,
        theta=height.high,
        low=parameter.low,
        high=parameter.high,
        degree=fit.degree,
        count=(fit.degree + 1) ** 2,
        rows=len(table),
        channels=table.shape[1],
        i=table.shape[2],
        j=table.shape[3],
        table=",\n".join(_braces(weight) for weight in table),
    )


def _braces(array: np.ndarray) -> str:
    if array.ndim == 1:
        return "{" + ", ".join(f"{value:.17g}" for value in array) + "}"
    return "{" + ",\n".join(_braces(row) for row in array) + "}"
