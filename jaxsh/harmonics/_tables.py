"""Constants of the basis, computed once per degree on the host in float64.

On the unit sphere y_lm(x, y, z) = Z_lm(z) · T_m(x, y), where Z_lm is a polynomial of degree l-|m|
and parity (-1)^(l-m), and T_m is the real or imaginary part of (x + iy)^|m|:
C_m = r^m cos(mφ) for m ≥ 0, S_|m| = r^|m| sin(|m|φ) for m < 0, with r = sin θ.

Both are written as products over their roots, which come in pairs ±. A product keeps its digits
where an expanded polynomial or a long recursion loses them, and all of its rows have the same
form, padded to the same number of factors: one two-dimensional array kernel.
"""

import functools
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from .._core.checks import as_host_float, check_degree
from .._core.host import read_only_cache
from ._indexing import degrees, index, orders


class AzimuthTable(NamedTuple):
    """Rows m = 0..L of C_m (part 0) and S_m (part 1).

    row = (a + b x + c y + d x y) · Π_j (α_j x² + β_j y² + γ_j)
    """

    lone: Float[np.ndarray, "2 rows 4"]  # a, b, c, d
    alpha: Float[np.ndarray, "2 rows factors"]
    beta: Float[np.ndarray, "2 rows factors"]
    gamma: Float[np.ndarray, "2 rows factors"]


class ZenithTable(NamedTuple):
    """Rows i = l(l+1) + m of Z_lm, with the whole normalisation of y_lm.

    row = (e z + f) · Π_j p_j(z² - ½), p_j a polynomial whose highest coefficient comes first.
    """

    azimuth_row: Int[np.ndarray, " k"]  # the row of the flattened azimuth table to multiply with
    e: Float[np.ndarray, " k"]
    f: Float[np.ndarray, " k"]
    factors: Float[np.ndarray, "factors coefficients k"]


class GradientTable(NamedTuple):
    """Gradient of the solid harmonics: two terms for each axis k.

    ∂_k (r^l y_lm) = first_k y[first_row] + second_k y[second_row].

    The solid harmonics r^l y_lm are harmonic polynomials, so each derivative is one of degree
    l-1, and the ladder operators ∂x ± i∂y show that at most two orders take part.
    """

    first_row: Int[np.ndarray, "3 k"]
    first: Float[np.ndarray, "3 k"]
    second_row: Int[np.ndarray, "3 k"]
    second: Float[np.ndarray, "3 k"]


@read_only_cache(maxsize=None)
def azimuth_table(degree: int) -> AzimuthTable:
    rows, factors = degree + 1, degree // 2
    lone = np.zeros((2, rows, 4))
    alpha, beta = np.zeros((2, rows, factors)), np.zeros((2, rows, factors))
    gamma = np.ones((2, rows, factors))
    lone[0, 0, 0] = 1.0  # C_0 = 1; S_0 = 0 stays a row of zeros
    for m in range(1, rows):
        # sin(mφ) = 2^(m-1) Π_k sin(φ + kπ/m), and cos(mφ) is the same half a step further.
        # The roots ψ and π-ψ pair to x² sin²ψ - y² cos²ψ; 0 leaves y, π/2 leaves x.
        for part, shift in ((0, 0.5), (1, 0.0)):
            root = (np.arange(m) + shift) * np.pi / m
            paired = root[(np.arange(m) + shift > 0) & (2 * np.arange(m) + 2 * shift < m)]
            pairs = len(paired)
            lead = 2.0 ** (m - 1)
            spread = lead ** (1 / pairs) if pairs else 1.0
            alpha[part, m, :pairs] = spread * np.sin(paired) ** 2
            beta[part, m, :pairs] = -spread * np.cos(paired) ** 2
            gamma[part, m, :pairs] = 0.0
            unpaired = {(0, 0): 0, (0, 1): 1, (1, 1): 2, (1, 0): 3}[part, m % 2]
            lone[part, m, unpaired] = 1.0 if pairs else lead
    return AzimuthTable(lone, alpha, beta, gamma)


@read_only_cache(maxsize=None)
def zenith_table(degree: int) -> ZenithTable:
    l, m = degrees(degree), orders(degree)
    # Horner's rule over several roots takes half the operations of as many factors. In z² - ½ it
    # loses no digits with three of them, up to degree 20; from there on two are safe.
    size = min(3 if degree <= 20 else 2, max(degree // 2, 1))
    factors = np.zeros((-(-(degree // 2) // size), size + 1, len(l)))
    factors[:, -1] = 1.0
    e, f = np.zeros(len(l)), np.zeros(len(l))
    for order in range(degree + 1):
        lead = _sectoral(order)
        for deg in range(order, degree + 1):
            if deg > order:
                lead *= np.sqrt((4 * deg**2 - 1) / (deg**2 - order**2))
            root = _positive_roots(deg, order)
            used = -(-len(root) // size)
            # The leading coefficient is spread evenly, so that no partial product overflows.
            spread = lead ** (1 / (used + 1))
            for i in {index(deg, order), index(deg, -order)}:
                for j in range(used):
                    polynomial = spread * np.poly(root[j::used] ** 2 - 0.5)
                    factors[j, -len(polynomial) :, i] = polynomial
                (e if (deg - order) % 2 else f)[i] = spread
    azimuth_row = np.where(m >= 0, m, degree + 1 - m)
    return ZenithTable(azimuth_row, e, f, factors)


@read_only_cache(maxsize=None)
def gradient_table(degree: int) -> GradientTable:
    count = (degree + 1) ** 2
    row, value = np.zeros((2, 3, count), np.int32), np.zeros((2, 3, count))
    x, y, z = range(3)
    for l in range(1, degree + 1):
        scale = np.sqrt((2 * l + 1) / (2 * l - 1))
        for m in range(-l, l + 1):
            i, n, sign = index(l, m), abs(m), -1 if m < 0 else 1

            # y_(l-1, 0) carries no √2; a raise from m = 0 or a fall to m = 0 makes up for it.
            rise = scale * np.sqrt((l - n) * (l - n - 1)) * (0.5 if n else np.sqrt(0.5))
            fall = scale * np.sqrt((l + n) * (l + n - 1)) * (np.sqrt(0.5) if n == 1 else 0.5)

            def put(slot, axis, i, order, factor, l=l):
                row[slot, axis, i], value[slot, axis, i] = index(l - 1, order), factor

            if n < l:
                put(0, z, i, m, scale * np.sqrt(l**2 - n**2))
            if n + 1 < l:  # to |m| + 1, of the same kind along x and of the other along y
                put(0, x, i, sign * (n + 1), -rise)
                put(0, y, i, -sign * (n + 1), -sign * rise)
            if n > 1 or m == 1:  # to |m| - 1; there is no sine of order 0
                put(1, x, i, sign * (n - 1), fall)
            if n > 1 or m == -1:
                put(1, y, i, -sign * (n - 1), -sign * fall)
    return GradientTable(row[0], value[0], row[1], value[1])


@functools.lru_cache(maxsize=32)
def _sectoral(m: int) -> float:
    """Leading factor of y_mm: `_sectoral(m) · C_m`."""
    k = np.arange(1, m + 1)
    return np.sqrt(np.prod((2 * k + 1) / (2 * k)) / (4 * np.pi)) * (np.sqrt(2) if m else 1)


def _positive_roots(l: int, m: int) -> Float[np.ndarray, " pairs"]:
    """Positive roots of Z_lm, by the Golub–Welsch Jacobi matrix of its recursion.

    Its diagonal is zero, so with even and odd rows set apart it is [[0, B], [Bᵀ, 0]] with B
    bidiagonal: the roots are ± the singular values of B.
    """
    size = l - m
    k = np.arange(m + 1, l)
    off = np.sqrt((k**2 - m**2) / (4.0 * k**2 - 1))
    jacobi = np.diag(off, 1) + np.diag(off, -1)
    return np.linalg.svd(jacobi[::2, 1::2], compute_uv=False) if size > 1 else np.zeros(0)


def legendre(cos_theta: Float[np.ndarray, " n"], degree: int) -> Float[np.ndarray, "k n"]:
    """Tabulate the meridian of every harmonic, on the host: constants for separable transforms.

    y_lm(θ, φ) = legendre_lm(cos θ) · (cos mφ for m ≥ 0, sin |m|φ for m < 0).

    **Arguments**

    - `cos_theta`: (N,), a NumPy array in [-1, 1].
    - `degree`: the largest l.

    **Returns** (K, N) in NumPy float64, by the usual three-term recursion in l, stable to high
    degree and independent of `evaluate`. NumPy only: not for traced or sharded arrays, not
    differentiable. Raises `ValueError` for cosines out of range.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import harmonics
    >>> harmonics.legendre(np.array([0.0, 1.0]), degree=2).shape
    (9, 2)
    """
    degree, z = check_degree(degree), as_host_float(cos_theta, "cos_theta").astype(np.float64)
    if (wrong := ~(np.abs(z) <= 1)).any():
        raise ValueError(f"cos_theta must be in [-1, 1], got {z[wrong].flat[0]:g}")
    sin_theta = np.sqrt((1 - z) * (1 + z))
    table = np.zeros(((degree + 1) ** 2, *z.shape))
    for m in range(degree + 1):
        before, now = np.zeros_like(z), _sectoral(m) * sin_theta**m
        for l in range(m, degree + 1):
            table[index(l, m)] = table[index(l, -m)] = now
            up = np.sqrt((4 * (l + 1) ** 2 - 1) / ((l + 1) ** 2 - m**2))
            down = np.sqrt((l**2 - m**2) / (4 * l**2 - 1)) if l > m else 0.0
            before, now = now, up * (z * now - down * before)
    return table


class Grid(NamedTuple):
    """Directions with weights, and the basis there, in float64 on the host."""

    directions: Float[np.ndarray, "n 3"]
    weights: Float[np.ndarray, " n"]
    basis: Float[np.ndarray, "k n"]


@read_only_cache(maxsize=32)
def exact_grid(degree: int, basis_degree: int) -> Grid:
    """Integrates polynomials of `degree` exactly; the basis goes up to `basis_degree`."""
    return _product_grid(degree // 2 + 1, degree + 1, degree + 1, basis_degree)


@read_only_cache(maxsize=32)
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
