"""Fits for programs in C."""

import numpy as np

from ._azimuth import half_rows
from ._habel import habel2008_monomials
from ._sky_fit import SkyFit

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
    """A C89 header with the fit's monomials and `prefix(theta, phi, parameter, coefficients)`.

    For a fit that `habel2008_monomials` takes, `habel2008_fit` first of all; in doubles, by
    Horner's rule.
    """
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
