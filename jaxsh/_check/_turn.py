"""Lights turned about the vertical by any angle, as by a panorama whose middle is elsewhere."""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..harmonics import degrees, orders
from ._decide import Case, Decision, decide
from ._search import fit
from ._space import Space

# Quarter turns are among the axes: angles between are tried in steps of as many degrees.
_STEP, _QUARTER = 2.0, 90.0
_ROUNDS = 12


class Turned(NamedTuple):
    """The likeliest angle, in radians, and what is decided with the light turned by it."""

    angle: float
    decision: Decision


def turned_light(light: Float[np.ndarray, "c k"], angle: float) -> Float[np.ndarray, "c k"]:
    """Turn a light about z, from x towards y."""
    degree = math.isqrt(light.shape[1]) - 1
    l, m = degrees(degree), orders(degree)
    other = light[:, l * (l + 1) - m]
    return light * np.cos(m * angle) - other * np.sin(m * angle)


def look_for_turn(found: list[Case], space: Space) -> Turned | None:
    """Find the angle at which some combination fits, if there is one."""
    plain = [case for case in found if case.cost == 0]
    if not plain or space.degree < 1:
        return None

    def at(angle: float) -> list[Case]:
        cases = []
        for case in plain:
            light = turned_light(case.light.coefficients, np.radians(angle))
            fits = fit(case.reading.channels, light, space).further(case.reading.apart)
            cases.append(case._replace(light=case.light._replace(coefficients=light), fits=fits))
        return cases

    def error(angle: float) -> float:
        return min(float(case.fits.error.min()) for case in at(angle))

    tried = np.arange(0.0, _QUARTER, _STEP)
    best = float(tried[np.argmin([error(angle) for angle in tried])])
    low, high = best - _STEP, best + _STEP
    for _ in range(_ROUNDS):  # a golden section
        first, second = high - (high - low) * 0.618, low + (high - low) * 0.618
        if error(first) < error(second):
            high = second
        else:
            low = first
    angle = (low + high) / 2
    decision = decide(at(angle), space, tried=len(tried))
    if not decision.fits:
        return None
    return Turned(math.radians(angle), decision)
