"""Derivatives of harmonics as matrices on coefficients: constants, in float64 on the host.

The whole of it is two lines. ω_d y_l is the sum of a part of degree l+1 and one of degree l-1, and
for a function y_l(x/|x|) |x|^a, homogeneous of degree a,

    ∂_d = (a - l) · (the part of degree l+1)  +  (a + l + 1) · (the part of degree l-1).
"""

import itertools
import math

import numpy as np
from jaxtyping import Float

from .._core.host import read_only_cache
from ..harmonics import degrees
from ..harmonics._tables import gradient_table


def monomials(order: int) -> list[tuple[int, ...]]:
    """Those of one order, as sorted axes: xx, xy, xz, yy, yz, zz are (0, 0), (0, 1), …"""
    return list(itertools.combinations_with_replacement(range(3), order))


@read_only_cache(maxsize=32)
def times_direction(degree: int) -> Float[np.ndarray, "3 k k_up"]:
    """X_d[i, j] = ∫ ω_d y_i y_j dω, i up to `degree` and j up to degree + 1."""
    table, l = gradient_table(degree + 1), degrees(degree + 1)
    axis, i = np.indices(table.first.shape)
    down = np.zeros((3, len(l), len(l)))
    # ∂_d (|x|^l y_l) = (2l + 1) · (the part of degree l-1).
    np.add.at(down, (axis, i, table.first_row), table.first / (2 * l + 1))
    np.add.at(down, (axis, i, table.second_row), table.second / (2 * l + 1))
    return (down + down.transpose(0, 2, 1))[:, : (degree + 1) ** 2]


def derivative(degree: int, homogeneity: int) -> Float[np.ndarray, "3 k k_up"]:
    """∂_d [y_i(x/|x|) |x|^homogeneity] = Σ_j D_d[i, j] y_j(x/|x|) |x|^(homogeneity - 1)."""
    l, up = degrees(degree)[:, None], degrees(degree + 1)[None]
    return times_direction(degree) * np.where(up > l, homogeneity - l, homogeneity + l + 1)


@read_only_cache(maxsize=32)
def taylor_matrices(degree: int, order: int) -> Float[np.ndarray, "m k k_up"]:
    """The terms of one order of y_i(s/|s|)/|s|³ at s = ω - δ: Σ_α δ^α Σ_j T_α[i, j] y_j(ω).

    For each monomial α of δ, T_α = (-1)^|α| ∂^α / α!, of degree `degree` + `order`.
    """
    result = []
    for axes in monomials(order):
        matrix = np.eye((degree + 1) ** 2)
        for k, axis in enumerate(axes):
            matrix = -matrix @ derivative(degree + k, -3 - k)[axis]
        result.append(matrix / math.prod(math.factorial(axes.count(axis)) for axis in range(3)))
    return np.stack(result)
