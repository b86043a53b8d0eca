"""Few numbers of light and transfer that glossy light is made of, around a tile's middle."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.polynomial.legendre import legvander

from .._core.checks import check_number, check_size
from .._core.host import read_only_cache
from ..harmonics import degrees, num_coefficients, phong
from ..transfer._glossy_kernels import product_nodes

# How far from a tile's middle, as a sine, lobes may point: half a tile's width, and how far an eye
# goes before it takes other tiles.
_REACH = 0.25
# Polynomials of where in the reach a lobe points.
_DEGREE = 4
# Mean square of a transfer's coefficients by band, of bakes; from band 3 on a power of 1 + l.
_FIRST, _LATER = (0.57, 0.28, 0.056), (0.45, -3.3)
# Of light, beside those of the transfer, one number more for so many.
_SHARE = 4
_POLES, _SWEEPS = 64, 2


class LocalRule(NamedTuple):
    """∫ L O lobe(B·ω) dω ≈ Σ_ng (Σ_m (M L)_m core_mgn) p_g(B) (A O)_n, for B around +z.

    p_g are the monomials of x and y of B over `reach`, by `monomials`; the core is a sum over the
    lobe's zonal coefficients.
    """

    rows: Float[np.ndarray, "n k"]  # A
    lights: Float[np.ndarray, "m k"]  # M
    core: Float[np.ndarray, "bands m g n"]
    reach: float


def check_rule(count: int, exponent: float) -> None:
    check_size("components", count)
    check_number("exponent", exponent, above=-1.0)


@read_only_cache(maxsize=32)
def local_rule(degree: int, count: int, exponent: float) -> LocalRule:
    """A rule of `count` numbers of the transfer for functions of a degree and an exponent.

    For a light of independent coefficients of equal variance, as a sun has them, a transfer whose
    bands have those of bakes, and B evenly spread within reach, the rule whose expected squared
    error is least: a truncated Tucker decomposition of ∫ y_k y_k' lobe(B·ω) dω, by alternating
    least squares (de Lathauwer et al. 2000), whose factor in B is a polynomial.
    """
    nodes, width = product_nodes(degree), num_coefficients(degree)
    points = disc(_POLES) * _REACH
    poles = np.concatenate([points, np.sqrt(1 - np.sum(points**2, axis=1))[:, None]], axis=1)
    bands = np.arange(degree + 1)
    each = legvander(np.clip(nodes.directions @ poles.T, -1, 1), degree)  # [node, pole, band]
    each *= np.sqrt((2 * bands + 1) / (4 * np.pi))
    lobes = each @ np.asarray(phong(exponent, degree, normalized=True), np.float64)
    power = _LATER[0] * (1.0 + bands) ** _LATER[1]
    power[:3] = _FIRST[: degree + 1]
    spread = np.sqrt(power)[degrees(degree)]
    weighted = spread[:, None] * nodes.project
    products = np.stack([(weighted * lobe) @ nodes.basis for lobe in lobes.T])  # [pole, O, L]
    count = min(count, width)
    of_light = _leading(np.sum(np.swapaxes(products, 1, 2) @ products, axis=0), width)
    of_light = of_light[:, : min(width, count + count // _SHARE)]
    of_transfer = np.zeros((width, count))
    for _ in range(_SWEEPS):
        part = products @ of_light
        of_transfer = _leading(np.sum(part @ np.swapaxes(part, 1, 2), axis=0), count)
        part = of_transfer.T @ products
        of_light = _leading(np.sum(np.swapaxes(part, 1, 2) @ part, axis=0), of_light.shape[1])
    fit = np.linalg.pinv(np.stack(monomials(*points.T / _REACH), axis=-1))  # [g, pole]
    fitted = np.tensordot(fit, np.moveaxis(each, 1, 0), 1)  # [g, node, band]
    left, right = of_light.T @ nodes.basis.T, (of_transfer.T @ weighted).T
    core = np.stack(
        [np.stack([(left * row) @ right for row in band]) for band in np.moveaxis(fitted, 2, 0)]
    )
    return LocalRule(
        of_transfer.T / spread, of_light.T, np.ascontiguousarray(np.swapaxes(core, 1, 2)), _REACH
    )


def _leading(gram: Float[np.ndarray, "k k"], count: int) -> Float[np.ndarray, "k n"]:
    return np.linalg.eigh(gram)[1][:, ::-1][:, :count]


def disc(count: int) -> Float[np.ndarray, "n 2"]:
    """Points spread evenly over the unit disc, in a spiral."""
    turns = np.arange(count) + 0.5
    radius, azimuth = np.sqrt(turns / count), np.pi * (3 - np.sqrt(5)) * turns
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth)], axis=-1)


def monomials(x, y, degree: int = _DEGREE) -> list:
    """x^i y^j up to a degree, as a list; of NumPy or JAX."""
    rows = [[x * 0 + 1]]
    for _ in range(degree):
        rows.append([*(x * one for one in rows[-1]), y * rows[-1][-1]])
    return [one for row in rows for one in row]
