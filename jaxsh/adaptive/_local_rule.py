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
    an error that is known in advance (Bayesian quadrature). The ω_n are taken one by one from
    the exact directions of `product_nodes`, each where it lowers the error most, band l of
    which counts as transfers have it.

    Where the exact directions are no more than `count`, it is these, and the rule is exact.
    """
    nodes = product_nodes(degree)
    if len(nodes.directions) <= count:
        return LocalRule(nodes.directions, nodes.project.T)
    among = _covariance(nodes.directions, degree, exponent)
    among /= among.max()
    beside = among @ nodes.project.T
    of_transfer = (1.0 + degrees(degree)) ** (-2.0 * _TRANSFER)
    chosen = _greedy(among, beside, of_transfer, count)
    inner = among[np.ix_(chosen, chosen)] + _RIDGE * np.eye(count)
    return LocalRule(nodes.directions[chosen], np.linalg.solve(inner, beside[chosen]))


def _covariance(directions, degree: int, exponent: float) -> Float[np.ndarray, "n n"]:
    """Of light times lobe."""
    bands = np.arange(degree + 1)
    lights = (2 * bands + 1) / (4 * np.pi) * (1.0 + bands) ** (-2.0 * _LIGHT)
    lobes = np.asarray(phong(exponent, degree)) * np.sqrt((2 * bands + 1) / (4 * np.pi))
    values = legval(np.clip(directions @ _poles().T, -1, 1), lobes)
    return legval(np.clip(directions @ directions.T, -1, 1), lights) * (values @ values.T)


def _poles(count: int = 64) -> Float[np.ndarray, "b 3"]:
    """Directions all over the reach, in a spiral."""
    turns = np.arange(count) + 0.5
    polar, azimuth = _REACH * np.sqrt(turns / count), np.pi * (3 - np.sqrt(5)) * turns
    sine = np.sin(polar)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(polar)], axis=-1)


def _greedy(among, beside, importance, count: int) -> list[int]:
    """Directions, each of which lowers Σ importance · error most, given those before."""
    among, beside, chosen = among.copy(), beside.copy(), []
    for _ in range(count):
        gain = np.square(beside) @ importance / np.maximum(among.diagonal(), 1e-12)
        gain[chosen] = -1
        best = int(np.argmax(gain))
        chosen.append(best)
        share = among[:, best] / among[best, best]
        beside = beside - np.outer(share, beside[best])
        among = among - np.outer(share, among[best])
    return chosen
