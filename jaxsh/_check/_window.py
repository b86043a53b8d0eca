"""Lights whose degrees were multiplied each by a number: by a window, or by a lobe's kernel."""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..harmonics import degrees, window
from ._decide import LIKELY, Case, Choice, beside
from ._search import FLOOR, numbers, threshold
from ._space import Combination, Space, irradiance_factors
from ._words import factor, percent

# How much larger the error of every other convention must be.
_CLEAR = 1.5
_KINDS = "none", "hann", "lanczos", "positive"
# Factors this near are one.
_SAME = 0.01


class Windowed(NamedTuple):
    """A combination, and the number by which each degree of the light was multiplied."""

    case: Case
    at: Combination
    error: float
    factors: Float[np.ndarray, " bands"]


def look_for_window(found: list[Case], space: Space) -> Windowed | None:
    """Find the one combination that fits with a factor for each degree, if there is one."""
    plain = [case for case in found if case.cost == 0]
    if not plain or space.degree < 2:
        return None
    case = min(plain, key=lambda one: float(one.fits.error.min()))
    degree, light = space.degree, case.light.coefficients
    # What is constant within each degree, as Schmidt's, is in the factors.
    first = np.arange(degree + 1) ** 2
    l = degrees(degree)
    kept = [0]
    for n, norm in enumerate(space.norm_table):
        relative = norm / space.norm_table[0]
        if np.abs(relative / relative[first][l] - 1).max() > 1e-9:
            kept.append(n)
    ordered = np.moveaxis(case.reading.channels[:, space.order_table[:, : len(l)]], 1, 0)
    brought = ordered[:, None] / space.norm_table[kept][None, :, None]
    turned = np.einsum("aij,cj->aci", space.turned, light)
    product = np.einsum("onck,ack->onak", brought, turned, optimize=True)
    signed = product[:, :, None] * space.phase_table[:, None]
    dot = np.add.reduceat(signed, first, axis=-1)  # (O, N, S, A, degrees)
    power = np.add.reduceat(np.sum(light**2, axis=0), first)
    size = np.sum(brought**2, axis=(-2, -1))[:, :, None, None]
    factors = np.maximum(dot, 0) / np.maximum(power, 1e-30)
    rest = np.maximum(size - np.sum(factors * np.maximum(dot, 0), axis=-1), 0)
    shape = np.sum(factors[..., 1:] ** 2 * power[1:], axis=-1)
    error = np.sqrt(rest / np.maximum(shape, 1e-30)) + np.where(shape > 0, 0, np.inf)
    count = numbers(light) - degree
    cost = space.cost[:, kept, :, :, :].min(-1)
    score = 0.5 * count * np.log(np.minimum(error, 1e3) ** 2 + FLOOR**2) + cost
    o, n, s, a = map(int, np.unravel_index(int(score.argmin()), score.shape))
    best = float(error[o, n, s, a])
    maps = space.map[..., 0][:, kept]
    other = float(error[maps != maps[o, n, s, a]].min())
    limit = threshold(count, space.maps)
    if best > limit or other < _CLEAR * max(best, FLOOR):
        return None
    return Windowed(
        case, Combination(o, kept[n], s, a, 0), max(best, case.reading.apart), factors[o, n, s, a]
    )


def kernels(degree: int) -> dict[tuple[str, str], Float[np.ndarray, " bands"]]:
    """Factors of each degree by window and quantity; irradiance is that over π."""
    steps = np.arange(degree + 1)
    over_pi = irradiance_factors(degree) / np.pi
    return {
        (kind, quantity): kernel * np.asarray(window(kind, degree), np.float64)[steps**2]
        for quantity, kernel in (("radiance", np.ones(degree + 1)), ("irradiance", over_pi))
        for kind in _KINDS
    }


def named(relative: Float[np.ndarray, " bands"], error: float) -> tuple[str, str]:
    """Say what factors relative to the first are: the nearest window, and before it the kernel.

    Names neither where none is near, and the window `"none"` where the kernel alone is nearest.
    """
    apart = {
        key: float(np.abs(relative - known).max())
        for key, known in kernels(len(relative) - 1).items()
    }
    nearest = min(apart, key=lambda key: apart[key])
    return nearest if apart[nearest] <= max(_SAME, error) else ("", "")


def doubtful_window(best: Choice, space: Space) -> str:
    """Say which window, in place of the quantity that was found, fits about as well."""
    if space.degree < 2:
        return ""
    given, _ = beside(best, space)
    light = best.case.light.coefficients @ space.turned[best.at.placement].T
    count, l = max(numbers(light), numbers(given)), degrees(space.degree)
    likely: dict[str, float] = {}
    for (kind, quantity), kernel in kernels(space.degree).items():
        wanted = light * kernel[l]
        scale = float(np.sum(given * wanted) / np.sum(wanted**2))
        error = float(np.linalg.norm(given - scale * wanted))
        error /= max(abs(scale) * float(np.linalg.norm(wanted[:, 1:])), 1e-30)
        worse = count * math.log(math.hypot(error, FLOOR) / math.hypot(best.error, FLOOR))
        if kind != "none" and scale > 0 and worse <= LIKELY:
            likely[f"{quantity} under the window {kind!r} fits to {percent(error)}"] = error
    return min(likely, key=lambda said: likely[said], default="")


def said(relative: Float[np.ndarray, " bands"], kind: str, quantity: str, error: float) -> str:
    """The factors in words."""
    numbers_ = ", ".join(factor(float(one), 0.0) for one in relative)
    if kind:
        more = " after the clamped cosine" if quantity == "irradiance" else ""
        return f"its degrees are multiplied by {numbers_}: the window {kind!r}{more}"
    lobe = ""
    if 0.5 < relative[1] < 1:  # cos^n, normalized: (n+1)/(n+2), n/(n+3), …
        exponent = (2 * relative[1] - 1) / (1 - relative[1])
        if abs(relative[2] - exponent / (exponent + 3)) <= max(_SAME, error):
            lobe = f": as of a lobe cosⁿ with n = {exponent:.3g}"
    return f"its degrees are multiplied by {numbers_}{lobe}"


def absolute(windowed: Windowed, quantity: str) -> float:
    """The scale, beside a light's own strength, of a radiance or an irradiance."""
    first = float(windowed.factors[0])
    return first / math.pi if quantity == "irradiance" else first
