"""Decides from the errors of all combinations what is certain, and what is open."""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ._given import Light, Reading
from ._search import FLOOR, Fits, fit, numbers, threshold
from ._space import Combination, Space

# A combination is out of the question where it is so much less likely, as a logarithm, …
LIKELY = 8.0
# … and, where it is hardly less plain, its error is larger by this factor, whatever is the number
# of coefficients.
_WORSE, _AS_PLAIN = 1.3, 4.0
# What a scale costs that is none of a named convention.
_COST_OF_SCALE = 6.0
# A light from another direction has two numbers of its own only, and 48 placements to fall near:
# at this error, an angle of a degree or two, one in some hundreds does.
_MOST_OF_A_DIRECTION = 0.05
# Below this cost a combination is a named one.
_NAMED = 2.0
# The largest number of other maps that are looked at.
_MOST_GROUPS = 40


class Case(NamedTuple):
    """One reading of the array beside one light, with the errors of all combinations."""

    reading: Reading
    light: Light
    fits: Fits

    @property
    def cost(self) -> float:
        return self.reading.cost + self.light.cost


class Choice(NamedTuple):
    """A combination of a case: one convention, with its error and scale."""

    case: Case
    at: Combination
    error: float
    scale: float


class Decision(NamedTuple):
    """The likeliest choice, those with other maps that remain, and whether any of them fits."""

    best: Choice
    others: tuple[Choice, ...]
    fits: bool
    limit: float


def cases(readings: list[Reading], lights: dict[int, list[Light]], space: Space) -> list[Case]:
    """Fit each reading to each light of as many channels."""
    found = []
    for reading in readings:
        for light in lights.get(len(reading.channels), []):
            fits = fit(reading.channels, light.coefficients, space)
            found.append(Case(reading, light, fits.further(reading.apart)))
    return found


def decide(
    found: list[Case], space: Space, *, free_scale: bool = False, tried: int = 1
) -> Decision:
    """Choose among all combinations of all cases, the best of so many times `tried`."""
    count = max(numbers(case.light.coefficients) for case in found)
    scores = np.stack([_score(case, space, count) for case in found])
    number, *at = np.unravel_index(int(scores.argmin()), scores.shape)
    best = _choice(found[number], Combination(*map(int, at)))
    costs = np.stack([space.cost + case.cost for case in found])
    if costs[number, *best.at] < _NAMED:  # among named ones less fits by chance
        named = {int(space.map[at]) for at in space.named.values()}
        limit = threshold(count, len(named) * len(found) * tried)
    else:
        limit = threshold(count, space.maps * len(found) * tried)
    if free_scale:
        limit = min(limit, _MOST_OF_A_DIRECTION)
    if best.error > limit:  # none of them fits
        plain = _plainest(best.case, int(space.map[best.at]), space, free_scale)
        return Decision(plain, (), False, limit)
    errors = np.stack([case.fits.error for case in found])
    # Errors that differ from channel to channel tell more than those that all channels share.
    given, wanted = beside(best, space)
    apart = max(count, numbers(given - best.scale * wanted))
    scores = np.stack([_score(case, space, apart) for case in found])
    near = errors <= _WORSE * math.hypot(best.error, FLOOR)
    near &= costs <= costs[number, *best.at] + _AS_PLAIN
    near |= scores - scores[number, *best.at] <= LIKELY
    near &= np.isfinite(errors)
    groups: dict[tuple[str, str, int], Choice] = {}
    places = np.argwhere(near)
    for place in places[np.argsort(scores[near])]:
        case, at = found[place[0]], Combination(*map(int, place[1:]))
        key = (case.reading.layout, case.reading.said, int(space.map[at]))
        if key not in groups and len(groups) < _MOST_GROUPS:
            groups[key] = _plainest(case, int(space.map[at]), space, free_scale)
    first, *others = groups.values()
    return Decision(first, tuple(others), True, limit)


def beside(choice: Choice, space: Space) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients as given and as the light has them, (C, K), where they can be compared."""
    at, case = choice.at, choice.case
    factors = space.norm_table[at.normalization] * space.phase_table[at.phase]
    wanted = case.light.coefficients @ space.turned[at.placement].T
    given = case.reading.channels[:, space.order_table[at.order]]
    return given / factors, wanted * space.quantity_table[at.quantity]


def _score(case: Case, space: Space, count: float) -> Float[np.ndarray, "o n s a q"]:
    squared = np.minimum(case.fits.error, 1e3) ** 2
    return 0.5 * count * np.log(squared + FLOOR**2) + space.cost + case.cost


def _choice(case: Case, at: Combination) -> Choice:
    return Choice(case, at, float(case.fits.error[at]), float(case.fits.scale[at]))


def _plainest(case: Case, number: int, space: Space, free_scale: bool) -> Choice:
    """Choose among all combinations that are one map: by the scale, then by the name."""
    members = [Combination(*map(int, at)) for at in np.argwhere(space.map == number)]

    def cost(at: Combination) -> float:
        off = not near_one(float(case.fits.scale[at]), float(case.fits.error[at]))
        return float(space.cost[at]) + (1.0 if free_scale else _COST_OF_SCALE) * off

    return _choice(case, min(members, key=cost))


def near_one(scale: float, error: float) -> bool:
    """A scale that is 1 but for what the errors of the fit do to it."""
    return bool(abs(scale - 1) <= min(0.1, max(0.02, 0.3 * error)))
