"""Where to take samples."""

import operator
import warnings
from typing import Literal

import numpy as np
from jaxtyping import ArrayLike, Float
from scipy.cluster.vq import kmeans2, vq

from ._predict import Choice, Evaluate, Prediction, check_points, probes_of

_TRIES = 4


def place_samples(
    positions: Float[ArrayLike, "v 3"],
    count: int,
    *,
    method: Literal["kmeans", "farthest", "greedy"] = "kmeans",
    evaluate: Evaluate | None = None,
    target: float | None = None,
    exponent: float = 6.0,
    probes: int = 128,
    candidates: int = 64,
    seed: int = 0,
) -> Float[np.ndarray, "s 3"]:
    """Points for at most `count` samples of the light, for an object with these positions.

    Annen et al. 2004 place samples "using Sloan et al.'s method", which is k-means, and leave
    how many and where else to future work.

    **Arguments**

    - `positions`: (V, 3), the object's vertices or any set of points that stands for it.
    - `method`:
      "kmeans": the means of clusters. One sample is the centroid.
      "farthest": the position nearest to the centroid, then always the one farthest from those
      chosen. Every position is near some sample, as near as for any choice to a factor of two.
      "greedy": out of `candidates` means of clusters, always the one with which the blend
      (eqs. 15, 16) has the least error at `probes` of the positions; after each, samples are
      exchanged while that helps. Stops when the error is at most `target`, or at `count`, where
      it is also tried from those of "kmeans" on; so at the probes it is never worse.
    - `evaluate`: for "greedy": the expansions of the light around points (n, 3), exact or
      captured. It is called once, with all probes and candidates.
    - `target`: for "greedy": relative RMS error of the irradiance, over probes and normals.
    - `exponent`: b of eq. 16 that the samples will be blended with.
    - `seed`: of k-means and of the choice of probes.

    **Returns** the points (S, 3), NumPy, in the dtype of the positions. S = `count` but for
    "greedy" with a target that fewer meet. Not differentiable.

    Raises `ValueError` for shapes and options that do not fit, and for more samples than there
    are different positions.
    """
    positions = check_points(positions)
    distinct = len(np.unique(positions, axis=0))
    if not 1 <= operator.index(count) <= distinct:
        raise ValueError(f"expected 1 to {distinct} samples (distinct positions), got {count}")
    if (method == "greedy") != (evaluate is not None) or (evaluate is None and target is not None):
        raise ValueError('expected evaluate with the method "greedy" and target only with it')
    if method == "kmeans":
        return _kmeans(positions, count, seed)
    if method == "farthest":
        return _farthest(positions, count)
    if method != "greedy":
        raise ValueError(f'expected method "kmeans", "farthest" or "greedy", got {method!r}')
    assert evaluate is not None
    clusters = _kmeans(positions, count, seed)
    pool = np.concatenate([clusters, _kmeans(positions, min(candidates, distinct), seed)])
    prediction = Prediction.of(evaluate, pool, probes_of(positions, probes, seed), exponent)
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
