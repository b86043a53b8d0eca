"""Rules of few directions around a glossy lobe, with weights for the transfer in each."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.polynomial.chebyshev import chebpts1
from numpy.polynomial.legendre import legval, legvander
from numpy.polynomial.polynomial import polyval

from .._core.checks import check_number, check_size
from .._core.host import read_only_cache
from ..harmonics import degrees, phong
from ..sphere import fibonacci
from ..transfer._glossy_kernels import product_nodes

# How far from the pole lobes may point, in radians: half a tile's width, and how far an eye goes
# before it takes other tiles.
_REACH = 0.3
# What is expected of band l of light and transfer, as amplitudes: 1/(1 + l) to these powers.
_LIGHT, _TRANSFER = 0.5, 2
# Of the largest variance, added to each, so that nearly equal directions do not cancel.
_RIDGE = 1e-7
# Directions to choose from, over the sphere.
_CANDIDATES = 1500
# How often each choice is looked at again.
_SWEEPS = 2
# Of the lobe's peak: what an economized lobe may be off.
_NEGLIGIBLE = 0.005


class LocalRule(NamedTuple):
    """∫ L O lobe(B·ω) dω ≈ Σ_n L(ω_n) lobe(B·ω_n) (A O)_n, for B within 0.3 of the pole +z.

    And the lobe with as few terms as it needs there: Σ_j p_j (t - t̄)^j of t = B·ω_n, no further
    down than `lowest`, where p are `powers` times its zonal coefficients and t̄ is `middle`.
    """

    directions: Float[np.ndarray, "n 3"]
    rows: Float[np.ndarray, "n k"]  # A
    powers: Float[np.ndarray, "terms bands"]
    lowest: float

    @property
    def middle(self) -> float:
        return (1 + self.lowest) / 2


@read_only_cache(maxsize=32)
def local_rule(degree: int, count: int, exponent: float) -> LocalRule:
    """A rule of `count` directions for functions of a degree and lobes of an exponent.

    Light and lobes are random: of L, the bands are independent, with variances v_l that fall off
    slowly, and B is anywhere within reach. Then f = L lobe has the covariance
    C(ω, ω') = Σ_l v_l (2l+1)/4π P_l(ω·ω') · mean of lobe(B·ω) lobe(B·ω') over B. With values of f
    at ω_n, the best linear estimate of its coefficients f_k has the weights A = C_nn⁻¹ C_nk, and
    an error that is known in advance (Bayesian quadrature); 1e-7 of the largest variance is added
    to the diagonal of C_nn. The ω_n are taken one by one, each where it lowers the error most, band
    l of which counts as transfers have it; then each is taken out in turn, and the best put in its
    place.

    Where the exact directions are no more than `count`, it is these, and the rule is exact.
    """
    nodes = product_nodes(degree)
    if len(nodes.directions) <= count:
        return LocalRule(nodes.directions, nodes.project.T, _powers(degree, -1.0, degree + 1), -1.0)
    candidates = np.asarray(fibonacci(_CANDIDATES).directions, np.float64)
    covariance = _covariance(candidates, candidates, degree, exponent)
    cross = _covariance(candidates, nodes.directions, degree, exponent) @ nodes.project.T
    covariance, cross = covariance / covariance.max(), cross / covariance.max()
    chosen = _choose(covariance, cross, (1.0 + degrees(degree)) ** (-2.0 * _TRANSFER), count)
    directions, rows = candidates[chosen], _estimate(covariance, chosen, cross)
    outermost = np.arccos(np.clip(directions[:, 2], -1, 1)).max()
    lowest = float(np.cos(min(outermost + _REACH / 2, np.pi)))
    return LocalRule(directions, rows, _economized(degree, exponent, lowest), lowest)


def _economized(degree: int, exponent: float, lowest: float) -> Float[np.ndarray, "terms bands"]:
    """`_powers` of as few terms as a lobe of this exponent needs."""
    zonal = np.asarray(phong(exponent, degree), np.float64)
    t = np.cos(np.linspace(0, np.arccos(lowest), 200)) - (1 + lowest) / 2
    exact = polyval(t, _powers(degree, lowest, degree + 1) @ zonal)
    for terms in range(1, degree + 1):
        powers = _powers(degree, lowest, terms)
        if np.abs(polyval(t, powers @ zonal) - exact).max() <= _NEGLIGIBLE * np.abs(exact).max():
            return powers
    return _powers(degree, lowest, degree + 1)


def _powers(degree: int, lowest: float, terms: int) -> Float[np.ndarray, "terms bands"]:
    """y_l0 between `lowest` and 1, in powers of t - t̄: interpolated in Chebyshev's points."""
    half = (1 - lowest) / 2
    points = chebpts1(terms)
    harmonics = np.sqrt((2 * np.arange(degree + 1) + 1) / (4 * np.pi)) * legvander(
        (1 + lowest) / 2 + half * points, degree
    )
    return np.linalg.solve(np.vander(points, increasing=True), harmonics) / (
        half ** np.arange(terms)[:, None]
    )


def check_rule(count: int, exponent: float) -> None:
    check_size("directions", count)
    check_number("exponent", exponent, above=-1.0)


def _covariance(left, right, degree: int, exponent: float) -> Float[np.ndarray, "m n"]:
    """Computes the covariance of light times lobe between directions."""
    bands = np.arange(degree + 1)
    lights = (2 * bands + 1) / (4 * np.pi) * (1.0 + bands) ** (-2.0 * _LIGHT)
    lobes = np.asarray(phong(exponent, degree), np.float64) * np.sqrt((2 * bands + 1) / (4 * np.pi))
    poles = _poles().T
    products = (
        legval(np.clip(left @ poles, -1, 1), lobes) @ legval(np.clip(right @ poles, -1, 1), lobes).T
    )
    return legval(np.clip(left @ right.T, -1, 1), lights) * products


def _poles(count: int = 64) -> Float[np.ndarray, "b 3"]:
    """Directions all over the reach, in a spiral."""
    turns = np.arange(count) + 0.5
    polar, azimuth = _REACH * np.sqrt(turns / count), np.pi * (3 - np.sqrt(5)) * turns
    sine = np.sin(polar)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(polar)], axis=-1)


def _choose(covariance, cross, importance, count: int) -> list[int]:
    """Picks the candidates that lower Σ importance · error most, given the others."""
    chosen: list[int] = []
    for step in range(count * (1 + _SWEEPS)):
        if step >= count:
            chosen.pop(0)
        known = _estimate(covariance, chosen, covariance)
        left = cross - known.T @ cross[chosen]
        variance = covariance.diagonal() - np.sum(known * covariance[chosen], axis=0)
        gain = np.square(left) @ importance / np.maximum(variance, 1e-12)
        gain[chosen] = -1
        chosen.append(int(np.argmax(gain)))
    return chosen


def _estimate(covariance, chosen: list[int], cross) -> Float[np.ndarray, "n k"]:
    """Returns the weights of the chosen values in an estimate with covariances `cross`."""
    inner = covariance[np.ix_(chosen, chosen)] + _RIDGE * np.eye(len(chosen))
    return np.linalg.solve(inner, cross[chosen])
