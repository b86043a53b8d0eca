"""Few numbers of light and transfer that glossy light is made of, around a tile's middle."""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.polynomial.legendre import legvander

from .._core.checks import check_number, check_size
from .._core.host import read_only_cache
from ..harmonics import degrees, num_coefficients, phong
from ..transfer._glossy_kernels import product_nodes
from ._tiling import NUM_TILES

# How far, in radians, an eye goes from a set's view by default, and at most: beyond, tiles are too
# wide for any rule.
REACH, FARTHEST = 0.25, 0.5
# Where lobes point, as a sine of the angle to a tile's middle, is spread normally about it: by the
# tile's own width, and by that share of the eye's way. Fitted up to so many deviations.
_WIDTH, _OF_THE_WAY, _DEVIATIONS = 0.12, 0.65, 2.0
# Mean square of a transfer's coefficients by band, of bakes; from band 3 on a power of 1 + l.
_FIRST, _LATER = (0.57, 0.28, 0.056), (0.45, -3.3)
# Of light, beside those of the transfer, one number more for so many.
_SHARE = 4
_POLES, _SWEEPS = 72, 2
# What is lost by leaving out numbers, relative to light and transfer as they are expected, where
# their count is not said; a multiple of so many.
_LOST, _MULTIPLE = 0.024, 4
# Polynomials of where a lobe points, up to such a degree, and then the functions that are sums of
# them, may lose so much, squared, beside what the numbers lose, or beside rounding.
_MOST, _BESIDE, _OF_FEW, _ROUNDED = 7, 0.05, 0.7, 1e-4
# Lobes whose degree deviates so much take the usual number of tiles, sharper ones more, by a power.
_BLUNT, _SHARPER, _MOST_TILES = 6.5, 2.5, 1200


class LocalRule(NamedTuple):
    """∫ L O lobe(B·ω) dω ≈ Σ_ng (Σ_m (M L)_m core_mgn) f_g(B) (A O)_n, for B around +z.

    f_g are sums of the monomials of x and y of B over `reach`, by `monomials`; the core is a sum
    over the lobe's zonal coefficients.
    """

    rows: Float[np.ndarray, "n k"]  # A
    lights: Float[np.ndarray, "m k"]  # M
    core: Float[np.ndarray, "bands m g n"]
    functions: Float[np.ndarray, "g monomials"]
    reach: float  # of the functions


def check_rule(count: int | None, exponent: float, reach: float) -> None:
    if count is not None:
        check_size("components", count)
    check_number("exponent", exponent, above=-1.0)
    check_number("reach", reach, least=0.0, most=FARTHEST)


@read_only_cache(maxsize=32)
def local_rule(degree: int, count: int | None, exponent: float, reach: float) -> LocalRule:
    """A rule of `count` numbers of the transfer for functions of a degree and an exponent.

    For a light of independent coefficients of equal variance, as a sun has them, a transfer whose
    bands have those of bakes, and B normally spread for an eye that goes as far as `reach`, the
    rule whose expected squared error is least: a truncated Tucker decomposition of
    ∫ y_k y_k' lobe(B·ω) dω, by alternating least squares (de Lathauwer et al. 2000), whose factors
    in B are polynomials. Without a `count` it has as many as leave an error of 2.4 %.
    """
    nodes, width = product_nodes(degree), num_coefficients(degree)
    deviation = math.hypot(_WIDTH, _OF_THE_WAY * reach)
    across = disc(_POLES) * _DEVIATIONS
    share = np.exp(-np.sum(across**2, axis=1))
    share = np.sqrt(share / np.sum(share))
    points = across * deviation
    poles = np.concatenate([points, np.sqrt(1 - np.sum(points**2, axis=1))[:, None]], axis=1)
    bands = np.arange(degree + 1)
    each = legvander(np.clip(nodes.directions @ poles.T, -1, 1), degree)  # [node, pole, band]
    each *= np.sqrt((2 * bands + 1) / (4 * np.pi)) * share[:, None]
    lobes = each @ np.asarray(phong(exponent, degree, normalized=True), np.float64)
    power = _LATER[0] * (1.0 + bands) ** _LATER[1]
    power[:3] = _FIRST[: degree + 1]
    spread = np.sqrt(power)[degrees(degree)]
    weighted = spread[:, None] * nodes.project
    products = np.stack([(weighted * lobe) @ nodes.basis for lobe in lobes.T])  # [pole, O, L]
    of_light, tail = _leading(np.sum(np.swapaxes(products, 1, 2) @ products, axis=0))
    if count is None:
        tails = tail, _leading(np.sum(products @ np.swapaxes(products, 1, 2), axis=0))[1]
        count = _enough(*tails)
    count = min(count, width)
    lights = _of_light(count, width)
    of_light, of_transfer, part = of_light[:, :lights], np.zeros((width, count)), products
    for _ in range(_SWEEPS):
        part = products @ of_light
        of_transfer = _leading(np.sum(part @ np.swapaxes(part, 1, 2), axis=0))[0][:, :count]
        part = of_transfer.T @ products
        of_light = _leading(np.sum(np.swapaxes(part, 1, 2) @ part, axis=0))[0][
            :, : of_light.shape[1]
        ]
    kept = (part @ of_light).reshape(len(points), -1)
    functions, fit = _functions(across / _DEVIATIONS, share, kept, np.sum(products**2))
    fitted = np.tensordot(fit, np.moveaxis(each, 1, 0), 1)  # [g, node, band]
    left, right = of_light.T @ nodes.basis.T, (of_transfer.T @ weighted).T
    core = np.stack(
        [np.stack([(left * row) @ right for row in band]) for band in np.moveaxis(fitted, 2, 0)]
    )
    return LocalRule(
        of_transfer.T / spread,
        of_light.T,
        np.ascontiguousarray(np.swapaxes(core, 1, 2)),
        functions,
        _DEVIATIONS * deviation,
    )


def _leading(gram: Float[np.ndarray, "k k"]):
    """Returns the eigenvectors, the largest first, and the sum of the eigenvalues from each on."""
    values, vectors = np.linalg.eigh(gram)
    return vectors[:, ::-1], np.cumsum(np.maximum(values, 0))[::-1]


def _of_light(count: int, width: int) -> int:
    return min(width, count + count // _SHARE)


def _enough(of_light, of_transfer) -> int:
    """Finds how many numbers lose no more than is allowed."""
    width, total = len(of_light), of_light[0]
    of_light, of_transfer = np.append(of_light, 0), np.append(of_transfer, 0)
    for count in range(_MULTIPLE, width, _MULTIPLE):
        if of_light[_of_light(count, width)] + of_transfer[count] <= _LOST**2 * total:
            return count
    return width


def _functions(points, share, kept, total) -> tuple[np.ndarray, np.ndarray]:
    """Finds the few polynomials that the values at the poles are sums of, and what gives the sums.

    Returns the polynomials as sums of monomials, and the rows that take values to factors.
    """
    squares = np.sum(kept**2)
    lost = max(total - squares, _ROUNDED**2 * total)
    degree = 1
    while True:
        powers = np.stack(monomials(points[:, 0], points[:, 1], degree), axis=-1)
        across, back = np.linalg.qr(powers * share[:, None])
        inside = across.T @ kept
        beside = squares - np.sum(inside**2)
        if beside <= _BESIDE * lost or degree == _MOST:
            break
        degree += 1
    left, tails = _leading(inside @ inside.T)
    tails = np.append(tails, 0)
    count = int(np.argmax(beside + tails <= max(_OF_FEW * lost, beside))) or 1
    left = left[:, :count]
    return np.linalg.solve(back, left).T, (across @ left).T


def num_tiles_for(degree: int, exponent: float) -> int:
    """Returns how many tiles are narrow enough for a lobe."""
    bands = np.arange(degree + 1)
    energy = (2 * bands + 1) * np.asarray(phong(exponent, degree, normalized=True), np.float64) ** 2
    deviation = math.sqrt(np.sum(bands * (bands + 1) * energy) / np.sum(energy))
    return min(round(NUM_TILES * max(deviation / _BLUNT, 1) ** _SHARPER), _MOST_TILES)


def disc(count: int) -> Float[np.ndarray, "n 2"]:
    """Points spread evenly over the unit disc, in a spiral."""
    turns = np.arange(count) + 0.5
    radius, azimuth = np.sqrt(turns / count), np.pi * (3 - np.sqrt(5)) * turns
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth)], axis=-1)


def monomials(x, y, degree: int) -> list:
    """x^i y^j up to a degree, as a list; of NumPy or JAX."""
    rows = [[x * 0 + 1]]
    for _ in range(degree):
        rows.append([*(x * one for one in rows[-1]), y * rows[-1][-1]])
    return [one for row in rows for one in row]


def degree_of_monomials(count: int) -> int:
    return (math.isqrt(8 * count + 1) - 3) // 2
