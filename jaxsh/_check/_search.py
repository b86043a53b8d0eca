"""Errors of each combination of facts beside coefficients: all of them at once, by inner products.

A combination says: u = κ · (order, sign, normalization) of (quantity of (axes of light)). What is
given is brought back as far as that divides by nothing that may be zero, u / (sign · normalization)
in the basis' own order, and compared there, where the basis is orthonormal, with the quantity of
the light in the other's axes. The scale κ is the best one.
"""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..harmonics import degrees
from ._space import Space

# Relative errors below this are of projections (weights of pixels, resampling), not of conventions.
FLOOR = 3e-3
# How probable a fit as good as the best may be by chance.
_CHANCE = 1e-3
# Above this no fit is called one, however many numbers there are.
_MOST = 0.35


class Fits(NamedTuple):
    """Errors of all combinations: ‖u − κ m‖ / ‖κ m‖, where m's degree 0 does not count below."""

    # (orders, normalizations, signs, placements, quantities)
    error: Float[np.ndarray, "o n s a q"]
    scale: Float[np.ndarray, "o n s a q"]

    def further(self, apart: float) -> "Fits":
        """The same with an error more, of what no combination explains."""
        return Fits(np.hypot(self.error, apart), self.scale)


def fit(given: Float[np.ndarray, "c slots"], light: Float[np.ndarray, "c k"], space: Space) -> Fits:
    """Fit all combinations to coefficients of a known light."""
    count = light.shape[-1]
    # (orders, C, K), then all normalizations: (O, N, C, K).
    ordered = np.moveaxis(given[:, space.order_table[:, :count]], 1, 0)
    brought = ordered[:, None] / space.norm_table[None, :, None]
    turned = np.einsum("aij,cj->aci", space.turned, light)
    product = np.einsum("onck,ack->onak", brought, turned, optimize=True)
    dot = np.einsum(
        "onak,sk,qk->onsaq", product, space.phase_table, space.quantity_table, optimize=True
    )
    size = np.einsum("onck,onck->on", brought, brought)[:, :, None, None, None]
    power = np.einsum("ack,qk->aqk", turned**2, space.quantity_table**2)
    whole, shape = power.sum(-1), power[..., 1:].sum(-1)
    tiny = np.finfo(np.float64).tiny
    scale = dot / np.maximum(whole, tiny)
    rest = np.maximum(size - scale * dot, 0.0)
    norm = scale**2 * shape
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        error = np.sqrt(rest / norm)
    error[~np.isfinite(error) | (scale <= 0)] = math.inf
    return Fits(error, scale)


def numbers(given: Float[np.ndarray, "c k"]) -> float:
    """Count independent numbers: nearly gray channels count as hardly more than one.

    K times the participation ratio of the channels, (tr G)² / tr G² of their Gram matrix.
    """
    shape = given[:, 1:]
    gram = shape @ shape.T
    total = np.sum(gram**2)
    ratio = np.trace(gram) ** 2 / total if total > 0 else 1.0
    return float(ratio * given.shape[1])


def sizes(channels: Float[np.ndarray, "c k"]) -> Float[np.ndarray, " bands"]:
    """Measure each degree of all channels together, which no turn changes."""
    l = degrees(math.isqrt(channels.shape[1]) - 1)
    return np.sqrt(np.bincount(l, weights=np.sum(channels**2, axis=0)))


def threshold(count: float, maps: int) -> float:
    """The error below which a fit of the best of `maps` combinations is none of chance.

    A random direction in `count` dimensions lies within the angle e of a given one with a
    probability of about e^(count−1).
    """
    free = max(count - 1.0, 1.0)
    return min(_MOST, math.exp((math.log(_CHANCE) - math.log(maps)) / free))
