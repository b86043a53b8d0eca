"""Coefficients of a light of which nothing is known: what it cannot be in.

A light is nowhere negative, so its coefficients are sums of the basis at directions with weights of
at least zero. Whether there are such weights is a non-negative least squares problem. No rotation
or reflection changes the answer, so axes and signs are beyond it.
"""

import math

import numpy as np
from jaxtyping import Float
from scipy.optimize import nnls

from ..sphere import fibonacci
from ._given import Reading
from ._known import same_layout
from ._placements import values
from ._search import sizes
from ._space import Combination, Space, space
from ._verdict import Verdict

# Higher degrees add rows that hardly exclude anything.
_MOST = 3
_DIRECTIONS = 600
# What is further than this from every light is none.
_FAR = 0.02
# Degree 3 of irradiance is zero; of a light's own it is not so small beside degree 2.
_NOTHING = 1e-3


def check_alone(readings: list[Reading]) -> Verdict:
    """The verdict on coefficients alone, which is never decided."""
    possible, errors = [], {}
    for reading in readings:
        whole = math.isqrt(reading.channels.shape[1]) - 1
        degree = min(whole, _MOST)
        table = space(degree, whole)
        known: dict[tuple[int, int, int], float] = {}
        for name, at in table.named.items():
            if not same_layout(name, reading):
                continue
            key = at.order, at.normalization, at.quantity
            if key not in known:
                known[key] = _distance(reading, at, table)
            errors[name] = min(known[key], errors.get(name, math.inf))
    possible = tuple(name for name, error in errors.items() if error <= _FAR)
    excluded = [name for name in errors if name not in possible]
    notes = []
    if excluded:
        notes.append(f"no light that is nowhere negative has these in {', '.join(excluded)}")
    if zero := _no_third(readings):
        notes.append(zero)
    if not errors:
        summary = "no named convention has coefficients of this shape"
    elif possible:
        summary = (
            f"{len(possible)} of {len(errors)} named conventions of this shape give a "
            "light that is nowhere negative"
        )
    else:
        summary = "in no named convention is this a light that is nowhere negative"
    return Verdict(
        decided=False,
        summary=summary,
        agree=possible,
        residuals=errors,
        notes=tuple(notes),
        open=(
            "axes, signs and scale, of which coefficients alone say nothing; give the picture or "
            "the direction that they were made of, or the basis as a function",
        ),
    )


def _distance(reading: Reading, at: Combination, table: Space) -> float:
    """Measure how far coefficients are from those of the nearest light, relatively."""
    count = (table.degree + 1) ** 2
    places = table.order_table[at.order]
    brought = reading.channels[:, places] / table.norm_table[at.normalization]
    cone = _cone(table.degree) * table.quantity_table[at.quantity][:, None]
    worst = 0.0
    for channel in brought:
        size = np.linalg.norm(channel)
        if size > 0:
            worst = max(worst, nnls(cone, channel / size, maxiter=50 * count)[1])
    return worst


def _cone(degree: int) -> Float[np.ndarray, "k n"]:
    directions = np.asarray(fibonacci(_DIRECTIONS).directions, np.float64)
    return values(directions, degree).T


def _no_third(readings: list[Reading]) -> str:
    for reading in readings:
        degree = math.isqrt(reading.channels.shape[1]) - 1
        if degree < 4:
            continue
        size = sizes(reading.channels)
        if size[3] <= _NOTHING * size[2] and size[4] > _NOTHING * size[2]:
            return "degree 3 is zero and degree 4 is not: irradiance, as no light's own are so"
    return ""
