"""Few directions around a glossy lobe, and what of the transfer to take in each."""

import functools
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.polynomial.legendre import legval

from ..harmonics import degrees, phong
from ..transfer._nodes import product_nodes

# How far from the pole lobes may point, in radians: half a tile's width, and how far an eye goes
# before it takes other tiles.
_REACH = 0.3
# What is expected of band l of light and transfer, as amplitudes: 1/(1 + l) to these powers.
_LIGHT, _TRANSFER = 1, 2
# Of the largest variance, added to each, so that nearly equal directions do not cancel.
_RIDGE = 1e-7


class LocalRule(NamedTuple):
    """∫ L O lobe(B·ω) dω ≈ Σ_n L(ω_n) lobe(B·ω_n) (A O)_n, for B within 0.3 of the pole +z."""

    directions: Float[np.ndarray, "n 3"]
    rows: Float[np.ndarray, "n k"]  # A


@functools.lru_cache(maxsize=32)
def local_rule(degree: int, count: int, exponent: float) -> LocalRule:
    """A rule of `count` directions for functions of a degree and lobes of an exponent.

    Light and lobes are random: of L, the bands are independent, with variances v_l that fall off
    as natural light's do, and B is anywhere within reach. Then f = L lobe has the covariance
    C(ω, ω') = Σ_l v_l (2l+1)/4π P_l(ω·ω') · mean of lobe(B·ω) lobe(B·ω') over B. With values of f
    at ω_n, the best linear estimate of its coefficients f_k has the weights A = C_nn⁻¹ C_nk, and
    an error that is known in advance (Bayesian quadrature); 1e-7 of the largest variance is added
    to the diagonal of C_nn. The ω_n are taken one by one from
    the exact directions of `product_nodes`, each where it lowers the error most, band l of
    which counts as transfers have it.

    Where the exact directions are no more than `count`, it is these, and the rule is exact.
    """
    nodes = product_nodes(degree)
    if len(nodes.directions) <= count:
        return LocalRule(nodes.directions, nodes.project.T)
    covariance = _covariance(nodes.directions, degree, exponent)
    cross = covariance @ nodes.project.T
    importance = (1.0 + degrees(degree)) ** (-2.0 * _TRANSFER)
    chosen = _greedy(covariance, cross, importance, count)
    inner = covariance[np.ix_(chosen, chosen)] + _RIDGE * np.eye(count)
    return LocalRule(nodes.directions[chosen], np.linalg.solve(inner, cross[chosen]))


def check_rule(count: int, exponent: float) -> None:
    if count < 1 or not exponent > -1:
        raise ValueError(
            f"expected directions of at least 1 and exponent above -1, got {count} and {exponent}"
        )


def _covariance(directions, degree: int, exponent: float) -> Float[np.ndarray, "n n"]:
    """Of light times lobe, the largest variance 1."""
    bands = np.arange(degree + 1)
    lights = (2 * bands + 1) / (4 * np.pi) * (1.0 + bands) ** (-2.0 * _LIGHT)
    lobes = np.asarray(phong(exponent, degree), np.float64) * np.sqrt((2 * bands + 1) / (4 * np.pi))
    values = legval(np.clip(directions @ _poles().T, -1, 1), lobes)
    covariance = legval(np.clip(directions @ directions.T, -1, 1), lights) * (values @ values.T)
    return covariance / covariance.max()


def _poles(count: int = 64) -> Float[np.ndarray, "b 3"]:
    """Directions all over the reach, in a spiral."""
    turns = np.arange(count) + 0.5
    polar, azimuth = _REACH * np.sqrt(turns / count), np.pi * (3 - np.sqrt(5)) * turns
    sine = np.sin(polar)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(polar)], axis=-1)


def _greedy(covariance, cross, importance, count: int) -> list[int]:
    """Directions, each of which lowers Σ importance · error most, given those before."""
    chosen = []
    for _ in range(count):
        variance = np.maximum(covariance.diagonal(), 1e-12)
        gain = np.square(cross) @ importance / variance
        gain[chosen] = -1
        best = int(np.argmax(gain))
        chosen.append(best)
        # What the value there tells of all others is known from now on.
        share = covariance[:, best] / variance[best]
        cross = cross - np.outer(share, cross[best])
        covariance = covariance - np.outer(share, covariance[best])
    return chosen
