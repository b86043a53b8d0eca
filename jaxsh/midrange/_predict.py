"""The error that a choice of samples will have, from the light at candidates and at probes."""

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from ..harmonics import clamped_cosine, convolve, degree_of
from ._expansion import Expansion, extrapolate

Evaluate = Callable[[Float[np.ndarray, "n 3"]], Expansion]

_CORE = 1e-3  # of the probes' extent: what is nearer than this to a sample is at it


@dataclasses.dataclass(frozen=True)
class Prediction:
    """What each of n candidates says about each of Q probes, beside what is so there.

    All is irradiance: coefficients times λ_l, so that the sum of squares is the mean over all
    normals, but for a factor. `powers` are the weights of eq. 16 before they are divided by their
    sum.
    """

    said: Float[np.ndarray, "n q k"]
    exact: Float[np.ndarray, "q k"]
    powers: Float[np.ndarray, "n q"]

    @classmethod
    def of(
        cls, evaluate: Evaluate, points: np.ndarray, probes: np.ndarray, exponent: float
    ) -> "Prediction":
        light = evaluate(np.concatenate([points, probes]))
        wanted = (len(points) + len(probes),)
        if light.point.shape[:-1] != wanted:
            raise ValueError(f"expected expansions {wanted}, got {light.point.shape[:-1]}")
        around = jax.tree.map(lambda leaf: leaf[: len(points), None], light)
        said = extrapolate(around, jnp.asarray(probes, light.terms.dtype)[None])
        exact = light.coefficients[len(points) :]
        squared = np.sum((points[:, None].astype(float) - probes[None]) ** 2, axis=-1)
        core = _CORE * np.linalg.norm(np.ptp(probes.astype(float), axis=0))
        squared = squared + max(core, np.finfo(float).tiny) ** 2
        powers = (squared.min(axis=0) / squared) ** (exponent / 2)
        return cls(_irradiance(said), _irradiance(exact), powers)

    def error(self, chosen: list[int], more: np.ndarray | None = None) -> np.ndarray:
        """Relative RMS error of the blend of those chosen, and one of each of `more` in turn."""
        total, share = self._blend(chosen)
        if more is None:
            total, share = total[None], share[None]
        else:
            total = total + self.powers[more, :, None] * self.said[more]
            share = share + self.powers[more]
        wrong = total / np.maximum(share, np.finfo(float).tiny)[..., None] - self.exact
        wrong = np.sqrt(np.sum(wrong**2, axis=(-2, -1)))
        size = np.sqrt(np.sum(self.exact**2))
        return np.where(wrong > 0, wrong / max(size, np.finfo(float).tiny), 0)

    def _blend(self, chosen: list[int]) -> tuple[np.ndarray, np.ndarray]:
        powers = self.powers[chosen]
        return np.einsum("nq,nqk->qk", powers, self.said[chosen]), powers.sum(axis=0)


class Choice:
    """A set of candidates that grows, shrinks and changes, with its error."""

    def __init__(self, prediction: Prediction, chosen: list[int] | None = None):
        self.prediction = prediction
        self.chosen = list(chosen or [])
        self.error = float(prediction.error(self.chosen)[0]) if self.chosen else np.inf

    def add(self) -> bool:
        """The candidate that helps most; false where none does."""
        return self._improve(self.chosen)

    def exchange(self) -> None:
        """One sample for another, while that helps."""
        while any(
            self._improve(self.chosen[:i] + self.chosen[i + 1 :]) for i in range(len(self.chosen))
        ):
            pass

    def remove(self, bound: float) -> bool:
        """The sample that is missed least, if the error stays within the bound."""
        without = [self.chosen[:i] + self.chosen[i + 1 :] for i in range(len(self.chosen))]
        errors = [float(self.prediction.error(rest)[0]) for rest in without if rest]
        if not errors or min(errors) > bound:
            return False
        self.chosen, self.error = without[int(np.argmin(errors))], min(errors)
        return True

    def _improve(self, kept: list[int]) -> bool:
        rest = np.setdiff1d(np.arange(len(self.prediction.said)), self.chosen)
        if len(rest) == 0:
            return False
        errors = self.prediction.error(kept, rest)
        if not errors.min() < self.error * (1 - 1e-9):
            return False
        self.chosen, self.error = [*kept, int(rest[np.argmin(errors)])], float(errors.min())
        return True


def probes_of(positions: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Some of the positions, at random."""
    rows = np.random.default_rng(seed).permutation(len(positions))[:count]
    return positions[rows]


def check_points(positions: Float[ArrayLike, "v 3"]) -> Float[np.ndarray, "v 3"]:
    """As a NumPy array; raises `ValueError` unless (V, 3) with V >= 1 and finite."""
    positions = np.asarray(positions)
    if positions.ndim != 2 or positions.shape[1] != 3 or len(positions) == 0:
        raise ValueError(f"expected positions (V, 3), V >= 1, got shape {positions.shape}")
    if not np.issubdtype(positions.dtype, np.floating) or not np.isfinite(positions).all():
        raise ValueError("expected positions that are finite floating-point numbers")
    return positions


def _irradiance(light) -> np.ndarray:
    """(..., 3 K) of coefficients times λ_l."""
    cosine = clamped_cosine(degree_of(light.shape[-1]))
    product = np.asarray(convolve(light, cosine), np.float64)
    return product.reshape(*product.shape[:-2], -1)
