"""Coefficients of a light that is known, from a picture or a direction: the verdict."""

import math
import re
from dataclasses import replace

import numpy as np

from ..harmonics import Convention, conventions
from ._decide import Case, Choice, Decision, beside, near_one
from ._given import Reading
from ._matching import Fault, constants, described
from ._space import Combination, Space
from ._verdict import Verdict
from ._words import factor, facts, percent

# How many other conventions a report lists.
_SHOWN = 3
# From this error on one coefficient is looked for that has nearly all of it.
_EXACT, _NEARLY_ALL = 3e-4, 0.98


def convention_of(choice: Choice, space: Space) -> Convention:
    """The choice as a `Convention`; a named one itself where it is that."""
    found = space.convention(choice.at, choice.case.reading.layout)
    for known in conventions().values():
        if replace(found, about=known.about, degree=known.degree) == known and fits_degree(
            known, space
        ):
            return known
    return found


def fits_degree(convention: Convention, space: Space) -> bool:
    """True where a convention goes up to this degree."""
    return convention.degree is None or convention.degree >= space.degree


def judge(
    found: list[Case], decision: Decision, space: Space, *, strength: bool, basis: bool = False
) -> Verdict:
    """Put a decision whose best choice fits into words.

    `strength` where the light's own is known, so that a scale says something; `basis` where the
    functions of a basis are what was given.
    """
    best, others = decision.best, decision.others
    convention = convention_of(best, space)
    gray = best.case.reading.hides_layout
    said = facts(convention, gray=gray, basis=basis)
    known = strength or best.case.reading.one_channel
    scale = 1.0 if near_one(best.scale, best.error) or not known else best.scale
    agree, nearly = _named(best, space, strength)
    notes, open_, faults = [], [], []
    _say_case(best.case, faults, notes)
    if scale != 1.0 and strength:
        faults.append(
            f"off by a factor {factor(scale)}"
            + ("" if basis else ": an exposure, or a constant left out")
        )
    if not strength:
        notes.append(
            "what differs by a scale only, as irradiance and irradiance/π, cannot be told apart "
            "where the strength of the light is not known"
        )
    if convention.phase == "condon-shortley" and space.degree > 0:
        notes.append(f"the same conversion: {_twin(best, convention, space)}")
    if basis:
        notes.append("a basis does not show layout and quantity: radiance or irradiance")
    elif gray:
        notes.append("one channel does not show whether channels or coefficients come first")
    if broken := _one_broken(best, space):
        faults.append(broken)
    if others:
        words = [facts(convention_of(other, space), gray=gray, basis=basis) for other in others]
        certain = {
            key: word for key, word in said.items() if all(o.get(key) == word for o in words)
        }
        unsure = [key for key in said if key not in certain]
        for other, word in list(zip(others, words, strict=True))[:_SHOWN]:
            differs = [word[key] for key in word if word[key] != said.get(key)]
            if "order" in said and "order" not in word:
                differs.append("m from −l to l")
            open_.append(f"{', '.join(differs)} fits as well, to {percent(other.error)}")
        if len(others) > _SHOWN:
            open_.append(f"and {len(others) - _SHOWN} more do")
        open_.append(_remedy(best.case, unsure, space, strength))
        summary = ", ".join(certain.values()) or "no fact is certain"
        summary = f"{summary}; open: {', '.join(unsure)}" if unsure else summary
    else:
        summary = ", ".join(said.values())
    return Verdict(
        decided=not others,
        summary=summary,
        agree=agree,
        nearly=nearly,
        found=convention,
        scale=scale,
        residual=best.error,
        residuals=residuals(found, space),
        faults=tuple(faults),
        open=tuple(open_),
        notes=tuple(notes),
        conversion=conversion(best, convention, scale, space, basis),
    )


def _one_broken(best: Choice, space: Space) -> str:
    """The one coefficient in which nearly all of the error is, where there is one."""
    count = (space.degree + 1) ** 2
    if best.error < _EXACT or count < 9:
        return ""
    brought, wanted = beside(best, space)
    power, dot = np.sum(wanted**2, axis=0), np.sum(wanted * brought, axis=0)
    # The scale without the coefficient that is wrong is not that of all.
    scale = float(np.median((dot / np.maximum(power, 1e-30))[power > 1e-6 * power.max()]))
    apart = np.sum((brought - scale * wanted) ** 2, axis=0)
    worst = int(apart.argmax())
    if apart[worst] < _NEARLY_ALL * apart.sum() or power[worst] == 0:
        return ""
    ratio = float(dot[worst] / power[worst] / scale)
    fault = Fault(worst, "sign" if abs(ratio + 1) < 0.02 else "factor", ratio)
    table = constants(space.normalizations[best.at.normalization], space.degree)
    return described([fault], table, space.degree)[0]


def _twin(best: Choice, convention: Convention, space: Space) -> str:
    """The other name of a map: the sign (-1)^m is half a turn about the polar axis."""
    at = best.at
    for place in np.flatnonzero(
        space.map[at.order, at.normalization, 0, :, at.quantity] == (space.map[at])
    ):
        twin = space.convention(at._replace(phase=0, placement=int(place)), convention.layout)
        said = facts(twin)
        return f"{said['phase']}, {said['axes']}"
    return ""


def residuals(found: list[Case], space: Space) -> dict[str, float]:
    """The least error of each named convention, in any layout."""
    return {
        name: min(float(case.fits.error[at]) for case in found) for name, at in space.named.items()
    }


def conversion(
    best: Choice, convention: Convention, scale: float, space: Space, basis: bool = False
) -> str:
    """The call that converts to our convention."""
    given = "coefficients"
    reading = best.case.reading
    if reading.said:
        given += ".reshape(-1)"
    name = next((f'"{name}"' for name, known in conventions().items() if known == convention), None)
    # Of a basis so many times as large the coefficients are so many times as small.
    divided = "" if scale == 1.0 else f" {'*' if basis else '/'} {scale:.4g}"
    hint = "" if name else ", with found = verdict.found"
    if convention.quantity != "radiance" and space.degree > 2:
        hint += ", after truncating to degree 2: irradiance has no light of degree 3, 5, …"
    return f'harmonics.convert({given}, {name or "found"}, "jaxsh"){divided}{hint}'


def around(call: str, form: str) -> str:
    """Put a call into a form like "f({})"; the hint behind the call stays behind."""
    code, *hint = re.split("(, (?:with found|after truncating).*)", call, maxsplit=1)
    return form.format(code) + "".join(hint)


def _say_case(case: Case, faults: list[str], notes: list[str]) -> None:
    if case.reading.said:
        faults.append(f"the array lies {case.reading.said}")
    if case.light.said.startswith("gray"):
        notes.append(case.light.said)
    elif case.light.said:
        faults.append(case.light.said)


def same_layout(name: str, reading: Reading) -> bool:
    """True where nothing shows that a named convention has another layout than what was given."""
    layout = conventions()[name].layout
    hidden = reading.hides_layout and layout != "cosine-sine"
    return (layout == reading.layout or hidden) and not reading.said


def _named(best: Choice, space: Space, strength: bool) -> tuple[tuple[str, ...], dict[str, str]]:
    """Named conventions that agree, and those that do but for one thing."""
    agree, scaled, laid, turned = [], {}, {}, {}
    reading = best.case.reading
    for name, at in space.named.items():
        layout, other = conventions()[name].layout, not same_layout(name, reading)
        if space.map[at] == space.map[best.at]:
            scale = float(best.case.fits.scale[at])
            off = strength and not near_one(scale, best.error)
            if not off and not other:
                agree.append(name)
            elif not other:
                scaled[name] = f"but for a scale of {factor(scale)}"
            elif not off:
                laid[name] = f"but for the layout, which is {layout}"
        elif not other and _but_for_axes(at, best, space):
            turned[name] = "but for the axes"
    nearly = scaled | laid
    return tuple(agree), nearly if agree or nearly else turned


def _but_for_axes(at: Combination, best: Choice, space: Space) -> bool:
    number = space.map[best.at]
    same = np.flatnonzero(space.map[at.order, at.normalization, at.phase, :, at.quantity] == number)
    return any(
        near_one(float(best.case.fits.scale[at._replace(placement=int(place))]), best.error)
        for place in same
    )


def _remedy(case: Case, unsure: list[str], space: Space, strength: bool) -> str:
    """Say what would decide."""
    wanted = []
    if not strength:
        wanted.append("a direction whose x, y and z all differ")
    if space.degree < 2:
        wanted.append("coefficients of degree 2")
    if strength and len(case.reading.channels) == 1:
        wanted.append("coefficients of a colored light")
    if strength and "axes" in unsure:
        wanted.append("a picture without symmetry")
    wanted.append("the basis as a function")
    return f"{' or '.join(wanted[:3])} would decide it"


def furnace(found: list[Case], space: Space) -> Verdict:
    """The verdict of a light that is the same from all sides: only one constant is seen."""
    case = found[0]
    given, light = case.reading.channels[:, 0], case.light.coefficients[:, 0]
    ratio = float(given @ light / (light @ light))
    spread = float(np.linalg.norm(given - ratio * light) / np.linalg.norm(given))
    rest = float(np.abs(case.reading.channels[:, 1:]).max(initial=0.0) / np.abs(given).max())
    agree = []
    for name, at in space.named.items():
        constant = space.norm_table[at.normalization, 0] * space.quantity_table[at.quantity, 0]
        if near_one(ratio / constant, spread):
            agree.append(name)
    faults = []
    if rest > 0.01:
        faults.append(
            f"a constant light has no coefficients but the first, and the largest here is "
            f"{percent(rest)} of it"
        )
    elif not agree:
        faults.append(
            f"no convention has {factor(ratio * math.sqrt(4 * math.pi))} for a light of radiance 1"
        )
    return Verdict(
        decided=False,
        summary=f"a light of radiance 1 has {factor(ratio * math.sqrt(4 * math.pi))} here",
        agree=() if faults else tuple(agree),
        faults=tuple(faults),
        open=(
            "a constant light is the same in all axes, signs and orders; a picture with something "
            "in it, or a direction, would tell them",
        ),
    )
