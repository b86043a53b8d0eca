"""Samples that come and go as objects move."""

import dataclasses
import operator

import numpy as np
from jaxtyping import ArrayLike, Bool, Float

from ._predict import Choice, Evaluate, Prediction, check_points, probes_of


@dataclasses.dataclass(frozen=True)
class Update:
    """What `update_samples` did: the samples now, those among them that are new, those gone.

    `points` are those kept, in their order, and then the `added`. `removed` marks the samples
    given that are no longer used. `error` is the relative RMS error predicted with `points`.
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
    probes: int = 128,
    seed: int = 0,
) -> Update:
    """Adds samples where the error is above a target, or removes those that are not needed.

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
      once, with the samples, the candidates and the probes.
    - `target`, and `release` below it (half of it if not given): relative RMS errors.
    - `limit`: the most samples that may come of adding.
    - `exponent`, `probes`, `seed`: as for `place_samples`.

    **Returns** an `Update`. One sample always stays. Not differentiable.

    Raises `ValueError` for shapes that do not fit, and a release not below the target.
    """
    points, candidates, positions = map(check_points, (points, candidates, positions))
    release = target / 2 if release is None else release
    if not 0 <= release < target:
        raise ValueError(f"expected 0 <= release < target, got {release} and {target}")
    pool = np.concatenate([points, candidates.astype(points.dtype)])
    prediction = Prediction.of(evaluate, pool, probes_of(positions, probes, seed), exponent)
    choice = Choice(prediction, list(range(len(points))))
    if choice.error > target:
        while choice.error > target and len(choice.chosen) < operator.index(limit):
            if not choice.add():
                break
    else:
        while choice.remove(release):
            pass
    kept = [i for i in choice.chosen if i < len(points)]
    removed = ~np.isin(np.arange(len(points)), kept)
    return Update(pool[choice.chosen], pool[choice.chosen[len(kept) :]], removed, choice.error)
