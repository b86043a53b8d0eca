"""Single coefficients or functions that break a convention, and what is wrong with each."""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from ..harmonics import Convention, degrees, orders
from ..harmonics._convention import scales
from ._space import Combination, Space
from ._words import factor

# Of the size of a typical coefficient, what is an error of a small one.
_SMALL = 0.05
# How many coefficients one unit of a combination's cost is worth: two flipped signs are plainer
# than axes that nobody has and one flipped sign.
_EXOTIC = 0.5


class Match(NamedTuple):
    """The combination with the most coefficients as they should be."""

    at: Combination
    scale: float
    right: Bool[np.ndarray, " k"]
    faults: tuple["Fault", ...]


class Fault(NamedTuple):
    """One coefficient, by its place in ours, and what it is instead."""

    at: int
    kind: str  # "sign", "factor", "place" or "other"
    value: float = 0.0
    other: int = -1
    parts: str = ""


def described(faults: list[Fault], constants: np.ndarray | None, degree: int) -> list[str]:
    """Faults in words, those of one kind together."""
    l, m = degrees(degree), orders(degree)
    said = []
    flipped = [one.at for one in faults if one.kind == "sign"]
    if flipped:
        said.append(f"sign of {_listed(flipped, l, m)} flipped")
    done = set()
    for one in faults:
        if one.kind == "place" and one.at not in done:
            back = next((f for f in faults if f.at == one.other and f.other == one.at), None)
            done |= {one.at, one.other} if back else {one.at}
            sign = ", with a minus sign" if one.value < 0 else ""
            if back:
                said.append(f"{_name(one.at, l, m)} and {_name(one.other, l, m)} exchanged{sign}")
            else:
                said.append(
                    f"{_name(one.at, l, m)} is what {_name(one.other, l, m)} should be{sign}"
                )
        elif one.kind == "factor":
            constant = "" if constants is None else _constant(one, constants)
            said.append(
                f"{_name(one.at, l, m)} is off by a factor {factor(one.value, 2e-3)}{constant}"
            )
    rest = [one for one in faults if one.kind == "other"]
    said += [f"{_name(one.at, l, m)} is {one.parts}" for one in rest if one.parts]
    if bare := [one.at for one in rest if not one.parts]:
        said.append(f"{_listed(bare, l, m)} fits nothing")
    return said


def _constant(fault: Fault, constants: np.ndarray) -> str:
    right = constants[fault.at]
    return f": a constant {right * fault.value:.4g} in place of {right:.4g}"


def constants(normalization: str, degree: int) -> np.ndarray | None:
    """The numbers before 1, y, z, x, xy, yz, 3z²−1, xz, x²−y² that a basis of degree 2 has."""
    if degree > 2:
        return None
    polynomial = scales(Convention(normalization="polynomial"), degree)
    return scales(Convention(normalization=normalization), degree) / polynomial


def _name(at: int, l: np.ndarray, m: np.ndarray) -> str:
    return f"l={l[at]}, m={m[at]}".replace("-", "−")


def _listed(places: list[int], l: np.ndarray, m: np.ndarray) -> str:
    """Places as "l=1, m=±1; l=2, m=0"."""
    words = []
    for degree in sorted({int(l[at]) for at in places}):
        here = sorted({int(m[at]) for at in places if l[at] == degree}, key=lambda o: (abs(o), o))
        both = [o for o in here if o > 0 and -o in here]
        single = [str(o).replace("-", "−") for o in here if abs(o) not in both]
        words.append(f"l={degree}, m={', '.join([*single, *(f'±{o}' for o in both)])}")
    return "; ".join(words)


def match(
    given: Float[np.ndarray, "c slots"],
    light: Float[np.ndarray, "c k"],
    space: Space,
    tolerance: float,
) -> Match:
    """Find the combination that most coefficients follow, and how the others break it."""
    count = light.shape[-1]
    ordered = np.moveaxis(given[:, space.order_table[:, :count]], 1, 0)
    turned = np.einsum("aij,cj->aci", space.turned, light)
    most, best, rows = -np.inf, None, None
    for n, norm in enumerate(space.norm_table):
        brought = (ordered / norm)[:, None]
        for s, phase in enumerate(space.phase_table):
            for q, quantity in enumerate(space.quantity_table):
                predicted = (turned * (phase * quantity))[None]
                for scale in _scales(brought, predicted):
                    right = _right(brought, predicted * scale[..., None, None], tolerance)
                    right &= (scale > 0)[..., None]
                    cost = space.cost[:, n, s, :, q]
                    value = right.sum(-1) - _EXOTIC * cost
                    o, a = np.unravel_index(int(value.argmax()), value.shape)
                    if value[o, a] > most:
                        at = Combination(int(o), n, s, int(a), q)
                        most = value[o, a]
                        best = at, float(scale[o, a]), right[o, a]
                        rows = brought[o, 0] / scale[o, a], predicted[0, a]
    assert best is not None
    assert rows is not None
    at, scale, right = best
    wrong = np.flatnonzero(~right)
    faults = tuple(_fault(int(k), wrong, rows[0], rows[1], tolerance) for k in wrong)
    return Match(at, scale, right, faults)


def _scales(brought, predicted):
    """The scale of the constant, and the median of those of all coefficients: one is right."""
    dot = np.sum(brought * predicted, axis=-2)
    power = np.broadcast_to(np.sum(predicted**2, axis=-2), dot.shape)
    ratio = np.abs(dot) / np.maximum(power, 1e-30)
    yield dot[..., 0] / np.maximum(power[..., 0], 1e-30)
    large = power > 1e-6 * power.max(-1, keepdims=True)
    yield np.nanmedian(np.where(large, ratio, np.nan), axis=-1)


def _right(brought, predicted, tolerance: float):
    power = np.sum(predicted**2, axis=-2)
    typical = np.sqrt(power[..., 1:].mean(-1, keepdims=True)) if power.shape[-1] > 1 else 0.0
    apart = np.sqrt(np.sum((brought - predicted) ** 2, axis=-2))
    return apart <= tolerance * (np.sqrt(power) + _SMALL * typical)


def _fault(k: int, wrong: np.ndarray, given, right, tolerance: float) -> Fault:
    """Find what coefficient k is, of rows (C, K) that are given and ought to be."""

    def near(a, b):
        return np.linalg.norm(a - b) <= 2 * tolerance * np.linalg.norm(b)

    mine, wanted = given[:, k], right[:, k]
    if near(-mine, wanted):
        return Fault(k, "sign")
    for other in wrong:
        for sign in (1.0, -1.0):
            if other != k and np.linalg.norm(mine) > 0 and near(sign * mine, right[:, other]):
                return Fault(k, "place", sign, int(other))
    power = float(wanted @ wanted)
    ratio = float(mine @ wanted) / power if power > 0 else 0.0
    if power > 0 and np.linalg.norm(mine - ratio * wanted) <= 2 * tolerance * np.linalg.norm(mine):
        return Fault(k, "factor", ratio)
    return Fault(k, "other", parts=_parts(mine, right) if len(right) == right.shape[1] else "")


def _parts(function, basis) -> str:
    """A function as a sum of those that it ought to be one of, where it is one."""
    weights = np.linalg.solve(basis, function)
    if np.linalg.norm(function) < 1e-9:
        return "zero"
    large = np.flatnonzero(np.abs(weights) > 0.02 * np.abs(weights).max())
    degree = math.isqrt(len(weights)) - 1
    l, m = degrees(degree), orders(degree)
    terms = [f"{weights[i]:.3g} of ({_name(int(i), l, m)})" for i in large[:4]]
    return "a sum: " + " + ".join(terms) + (" + …" if len(large) > 4 else "")
