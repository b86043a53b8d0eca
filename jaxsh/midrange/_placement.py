"""Places samples, and adds and removes them as objects move."""

import dataclasses
import warnings
from collections.abc import Callable
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Bool, Float

from .._core.checks import (
    as_host_float,
    check_choice,
    check_finite,
    check_function,
    check_number,
    check_size,
)
from ..harmonics import clamped_cosine, convolve, degree_of
from ._expansion import Expansion, extrapolate

Evaluate = Callable[[Float[np.ndarray, "n 3"]], Expansion]

_TRIES = 4
_CORE = 1e-3  # of the checks' extent: what is nearer than this to a sample is at it


def place_samples(
    positions: Float[ArrayLike, "v 3"],
    count: int,
    *,
    method: Literal["kmeans", "farthest", "greedy"] = "kmeans",
    evaluate: Evaluate | None = None,
    target: float | None = None,
    exponent: float = 6.0,
    checks: int = 128,
    candidates: int = 64,
    seed: int = 0,
) -> Float[np.ndarray, "s 3"]:
    """Choose points for at most `count` samples of the light around an object.

    Annen et al. 2004 place samples "using Sloan et al.'s method", which is k-means, and leave
    how many and where else to future work.

    **Arguments**

    - `positions`: (V, 3), the object's vertices or any set of points that stands for it.
    - `method`:
      "kmeans": the means of clusters. One sample is the centroid.
      "farthest": the position nearest to the centroid, then always the one farthest from those
      chosen. Every position is near some sample, as near as for any choice to a factor of two.
      "greedy": out of `candidates` means of clusters, always the one with which the blend
      (eqs. 15, 16) has the least error at `checks` of the positions; after each, samples are
      exchanged while that helps. Stops when the error is at most `target`, or at `count`, where
      it is also tried from those of "kmeans" on; so at the checks it is never worse.
    - `evaluate`: for "greedy": the expansions of the light around points (n, 3), exact or
      captured. It is called once, with all checks and candidates.
    - `target`: for "greedy": relative RMS error of the irradiance, over checks and normals.
    - `exponent`: b of eq. 16 that the samples will be blended with.
    - `seed`: of k-means and of the choice of checks.

    **Returns** the points (S, 3), NumPy, in the dtype of the positions. S = `count` but for
    "greedy" with a target that fewer meet. Runs on the host; not differentiable.

    Raises `ValueError` for shapes and options that do not fit, and for more samples than there
    are different positions.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import midrange
    >>> positions = np.random.default_rng(0).normal(size=(50, 3))
    >>> midrange.place_samples(positions, 4).shape
    (4, 3)
    """
    positions = check_points("positions", positions)
    check_choice("method", method, ("kmeans", "farthest", "greedy"))
    exponent = check_number("exponent", exponent, above=0.0)
    checks, seed = check_size("checks", checks), check_size("seed", seed, 0)
    candidates = check_size("candidates", candidates)
    if target is not None:
        target = check_number("target", target, least=0.0)
    if evaluate is not None:
        check_function("evaluate", evaluate)
    distinct = len(np.unique(positions, axis=0))
    if check_size("count", count) > distinct:
        raise ValueError(f"expected 1 to {distinct} samples (distinct positions), got {count}")
    if (method == "greedy") != (evaluate is not None) or (evaluate is None and target is not None):
        raise ValueError('expected evaluate with the method "greedy" and target only with it')
    if method == "kmeans":
        return _kmeans(positions, count, seed)
    if method == "farthest":
        return _farthest(positions, count)
    assert evaluate is not None
    clusters = _kmeans(positions, count, seed)
    pool = np.concatenate([clusters, _kmeans(positions, min(candidates, distinct), seed)])
    prediction = Prediction.of(evaluate, pool, drawn_positions(positions, checks, seed), exponent)
    choice = Choice(prediction)
    while len(choice.chosen) < count and choice.error > (0 if target is None else target):
        if not choice.add():
            break
        choice.exchange()
    if len(choice.chosen) == count:
        other = Choice(prediction, list(range(count)))
        other.exchange()
        choice = min(choice, other, key=lambda one: one.error)
    return pool[choice.chosen]


def _kmeans(positions: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Lloyd's iteration from k-means++, the best of a few tries."""
    from scipy.cluster.vq import kmeans2, vq  # dear to import, and needed by placement alone

    rng, points = np.random.default_rng(seed), positions.astype(np.float64)
    tries = []
    with warnings.catch_warnings():
        # A cluster that empties keeps its place, which serves as well.
        warnings.simplefilter("ignore", UserWarning)
        for _ in range(_TRIES):
            means, _ = kmeans2(points, count, iter=20, minit="++", rng=rng)
            tries.append((np.sum(vq(points, means)[1] ** 2), means))
    return min(tries, key=lambda one: one[0])[1].astype(positions.dtype)


def _farthest(positions: np.ndarray, count: int) -> np.ndarray:
    chosen = [int(np.argmin(np.sum((positions - positions.mean(axis=0)) ** 2, axis=1)))]
    squared = np.full(len(positions), np.inf)
    for _ in range(count - 1):
        offsets = positions - positions[chosen[-1]]
        squared = np.minimum(squared, np.sum(offsets**2, axis=1))
        chosen.append(int(np.argmax(squared)))
    return positions[chosen]


@dataclasses.dataclass(frozen=True)
class Prediction:
    """Compares the light that n candidates predict at Q checks with the light there.

    All is irradiance: coefficients times λ_l, so that the sum of squares is the mean over all
    normals, but for a factor. `powers` are the weights of eq. 16 before they are divided by their
    sum.
    """

    said: Float[np.ndarray, "n q k"]
    exact: Float[np.ndarray, "q k"]
    powers: Float[np.ndarray, "n q"]

    @classmethod
    def of(
        cls, evaluate: Evaluate, points: np.ndarray, checks: np.ndarray, exponent: float
    ) -> "Prediction":
        light = evaluate(np.concatenate([points, checks]))
        wanted = (len(points) + len(checks),)
        if light.point.shape[:-1] != wanted:
            raise ValueError(f"expected expansions {wanted}, got {light.point.shape[:-1]}")
        around = jax.tree.map(lambda leaf: leaf[: len(points), None], light)
        said = extrapolate(around, jnp.asarray(checks, light.terms.dtype)[None])
        exact = light.coefficients[len(points) :]
        squared = np.sum((points[:, None].astype(float) - checks[None]) ** 2, axis=-1)
        core = _CORE * np.linalg.norm(np.ptp(checks.astype(float), axis=0))
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
        """Add the candidate that helps most; false where none does."""
        return self._improve(self.chosen)

    def exchange(self) -> None:
        """Exchange one sample for another, while that helps."""
        while any(
            self._improve(self.chosen[:i] + self.chosen[i + 1 :]) for i in range(len(self.chosen))
        ):
            pass

    def remove(self, bound: float) -> bool:
        """Remove the sample that is missed least, if the error stays within the bound."""
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


def drawn_positions(positions: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Draw some of the positions at random."""
    rows = np.random.default_rng(seed).permutation(len(positions))[:count]
    return positions[rows]


def check_points(name: str, points: Float[ArrayLike, "v 3"]) -> Float[np.ndarray, "v 3"]:
    """Convert to NumPy; raises `ValueError` unless (V, 3) with V >= 1 and finite."""
    points = as_host_float(points, name)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) == 0:
        raise ValueError(f"expected {name} (V, 3), V >= 1, got shape {points.shape}")
    check_finite(name, points, wait=True)
    return points


def _irradiance(light) -> np.ndarray:
    """(..., 3 K) of coefficients times λ_l."""
    cosine = clamped_cosine(degree_of(light.shape[-1]))
    product = np.asarray(convolve(light, cosine), np.float64)
    return product.reshape(*product.shape[:-2], -1)


@dataclasses.dataclass(frozen=True)
class Update:
    """Reports the samples after `update_samples`: all of them, the new ones, those gone.

    `points` are those kept, in their order, and then the `added`. `removed` marks the samples
    given that are no longer used. `error` is the relative RMS error predicted with `points`.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import midrange
    >>> update = midrange.Update(np.zeros((2, 3)), np.zeros((1, 3)), np.array([False]), 0.1)
    >>> len(update.points), len(update.added)
    (2, 1)
    """

    points: Float[np.ndarray, "s 3"]
    added: Float[np.ndarray, "a 3"]
    removed: Bool[np.ndarray, " n"]
    error: float


def update_samples(
    points: Float[ArrayLike, "n 3"],
    candidates: Float[ArrayLike, "c 3"],
    positions: Float[ArrayLike, "v 3"],
    evaluate: Evaluate,
    *,
    target: float,
    release: float | None = None,
    limit: int = 16,
    exponent: float = 6.0,
    checks: int = 128,
    seed: int = 0,
) -> Update:
    """Add samples where the error is above a target, or remove those that are not needed.

    One step of an animation: what Annen et al. 2004 leave to future work. Where the predicted
    error (as in `place_samples`, "greedy") is above `target`, candidates are added, the best
    first, until it is not, none helps or `limit` is reached. Where it is not, samples are
    removed, the least missed first, while the error without them stays at most `release`. The
    two differ (hysteresis), so that a sample does not come and go with every frame.

    **Arguments**

    - `points` (N, 3), N >= 1: the samples so far, moved with the object if they ride on it.
    - `candidates` (C, 3): where samples may be added, such as `place_samples(positions, 64)`,
      moved likewise.
    - `positions`: (V, 3), the object's vertices as they are now.
    - `evaluate`: the expansions of the light as it is now around points (n, 3). It is called
      once, with the samples, the candidates and the checks.
    - `target`, and `release` below it (half of it if not given): relative RMS errors.
    - `limit`: the most samples that may come of adding.
    - `exponent`, `checks`, `seed`: as for `place_samples`.

    **Returns** an `Update`. One sample always stays. Runs on the host; not differentiable.

    Raises `ValueError` for shapes that do not fit, and a release not below the target.

    **Example**

    >>> import jax.numpy as jnp
    >>> import numpy as np
    >>> from jaxsh import midrange
    >>> ball = midrange.Sphere(jnp.array([0.0, 0, 4]), jnp.array(0.5), jnp.ones(3))
    >>> def evaluate(points):
    ...     return midrange.make_expansion(points, midrange.sphere_harmonics(ball, points, 1))
    >>> positions = np.random.default_rng(0).normal(size=(50, 3))
    >>> candidates = midrange.place_samples(positions, 8)
    >>> update = midrange.update_samples(
    ...     candidates[:1], candidates, positions, evaluate, target=0.1, limit=3
    ... )
    >>> len(update.points), update.removed
    (3, array([False]))
    """
    points = check_points("points", points)
    candidates, positions = (
        check_points(name, value)
        for name, value in (("candidates", candidates), ("positions", positions))
    )
    check_function("evaluate", evaluate)
    exponent = check_number("exponent", exponent, above=0.0)
    checks, seed = check_size("checks", checks), check_size("seed", seed, 0)
    limit, target = check_size("limit", limit), check_number("target", target, least=0.0)
    release = target / 2 if release is None else check_number("release", release)
    if not 0 <= release < target:
        raise ValueError(f"expected 0 <= release < target, got {release} and {target}")
    pool = np.concatenate([points, candidates.astype(points.dtype)])
    prediction = Prediction.of(evaluate, pool, drawn_positions(positions, checks, seed), exponent)
    choice = Choice(prediction, list(range(len(points))))
    if choice.error > target:
        while choice.error > target and len(choice.chosen) < limit:
            if not choice.add():
                break
    else:
        while choice.remove(release):
            pass
    kept = [i for i in choice.chosen if i < len(points)]
    removed = ~np.isin(np.arange(len(points)), kept)
    return Update(pool[choice.chosen], pool[choice.chosen[len(kept) :]], removed, choice.error)
