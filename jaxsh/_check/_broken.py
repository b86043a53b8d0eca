"""Coefficients of a known light that follow no convention: what they do follow."""

import math
from dataclasses import replace

import numpy as np

from ._decide import Case, Choice, Decision, near_one
from ._known import around, convention_of, conversion, judge, residuals, same_layout
from ._matching import Match, constants, described, match
from ._search import numbers, sizes
from ._space import Space, space
from ._turn import look_for_turn
from ._verdict import Verdict
from ._window import absolute, doubtful_window, look_for_window, named, said
from ._words import factor, facts, percent

# Single coefficients are looked at up to this degree, with the first tolerance that says something.
_MATCHED = 3
_TOLERANCES = 4e-3, 0.02, 0.06
_CHANCE = 1e-3
# What is no further off may be noise, and is further than so few coefficients allow.
_NEAR = 0.2
# Named conventions are as good as the best within this factor.
_ALIKE = 1.5
# A turn by any angle is believed where it leaves no more than this of the error.
_MUCH_BETTER = 0.3
# Below this error nothing is left for a window to explain.
_EXACT = 0.01


def windowed(
    found: list[Case], decision: Decision, table: Space, *, strength: bool
) -> tuple[Verdict | None, str]:
    """The verdict on a light of which each degree has a factor, where that explains much more.

    Where a window known by name explains nearly as much as no window, that is put in words only.
    """
    if decision.best.error <= _EXACT:
        return None, ""
    doubt = doubtful_window(decision.best, table) if decision.fits else ""
    seen = look_for_window(found, table)
    if seen is None or seen.error > _MUCH_BETTER * decision.best.error:
        return None, doubt
    relative = seen.factors / seen.factors[0]
    kind, quantity = named(relative, seen.error)
    if kind == "none":
        return None, doubt
    at = seen.at
    if quantity:
        at = at._replace(quantity=table.quantities.index(quantity))
    choice = Choice(seen.case, at, seen.error, absolute(seen, quantity))
    convention = convention_of(choice, table)
    words = facts(convention, gray=seen.case.reading.hides_layout)
    if not quantity:
        words.pop("quantity", None)
    scale = 1.0 if not strength or near_one(choice.scale, seen.error) else choice.scale
    call = conversion(choice, convention, scale, table)
    call = around(call, f'{{}} / harmonics.window("{kind}", {table.degree})') if kind else ""
    verdict = Verdict(
        decided=bool(kind),
        summary=", ".join(words.values()),
        agree=tuple(
            name
            for name, other in table.named.items()
            if kind and table.map[other] == table.map[at] and same_layout(name, seen.case.reading)
        ),
        found=convention,
        scale=scale,
        residual=seen.error,
        residuals=residuals(found, table),
        faults=(said(relative, kind, quantity, seen.error),),
        conversion=call,
    )
    return verdict, ""


def explain(found: list[Case], decision: Decision, table: Space, *, strength: bool) -> Verdict:
    """The verdict where no combination fits."""
    best = decision.best
    notes = [f"the nearest convention is {percent(best.error)} off"]
    broken = _broken(found, table)
    if broken is not None:
        case, matched, small = broken
        layout = case.reading.layout
        convention = small.convention(matched.at, layout)
        words = facts(convention, gray=case.reading.hides_layout)
        wrong = len(matched.faults)
        faults = described(
            list(matched.faults), constants(convention.normalization, small.degree), small.degree
        )
        faults += [fault for fault in (case.reading.said, case.light.said) if fault]
        return Verdict(
            decided=False,
            summary=f"{', '.join(words.values())}, but for {wrong} of {len(matched.right)} "
            "coefficients",
            found=convention,
            scale=1.0 if abs(matched.scale - 1) < 0.02 else matched.scale,
            residual=best.error,
            residuals=residuals(found, table),
            faults=tuple(faults),
            notes=tuple(notes),
        )
    # Among all directions of one height some turn fits each.
    turn = look_for_turn(found, table) if strength else None
    if turn is not None and turn.decision.best.error < _MUCH_BETTER * best.error:
        verdict = judge(found, turn.decision, table, strength=strength)
        angle = math.degrees(turn.angle)
        return replace(
            verdict,
            decided=False,
            faults=(
                f"turned by {angle:.1f}° about z, from x towards y, beside what was given",
                *verdict.faults,
            ),
            conversion=around(verdict.conversion, f"harmonics.rotate_z({{}}, {-turn.angle:.4f})"),
        )
    if best.error <= _NEAR:
        return _by_chance(best, decision, found, table)
    powers = _powers(found)
    if powers:
        notes.append(powers)
    return Verdict(
        decided=False,
        summary="no convention fits: it is another light, too noisy, or has more than one fault",
        residuals=residuals(found, table),
        notes=tuple(notes),
        open=(
            "is it this light? If so, the basis that made the coefficients, given as a function, "
            "shows each fault",
        ),
    )


def _by_chance(best: Choice, decision: Decision, found: list[Case], table: Space) -> Verdict:
    """The verdict where a fit is good enough for noise, and not good enough to be no chance."""
    errors = residuals(found, table)
    convention = convention_of(best, table)
    near = tuple(
        name
        for name, error in errors.items()
        if error <= _ALIKE * best.error and same_layout(name, best.case.reading)
    )
    words = ", ".join(facts(convention, gray=best.case.reading.hides_layout).values())
    return Verdict(
        decided=False,
        summary=f"{words}, or by chance",
        agree=near,
        found=convention,
        scale=1.0 if near_one(best.scale, best.error) else best.scale,
        residual=best.error,
        residuals=errors,
        open=(
            f"with so few coefficients something fits to {percent(best.error)} by chance; "
            f"within {percent(decision.limit)} of the light, or up to a higher degree, they tell",
        ),
    )


def _broken(found: list[Case], table: Space) -> tuple[Case, Match, Space] | None:
    """The case with the most coefficients right, where so many are by no chance."""
    degree = min(table.degree, _MATCHED)
    whole = math.isqrt(found[0].reading.channels.shape[1]) - 1
    small = space(degree, whole)
    count = (degree + 1) ** 2
    plain = [case for case in found if not case.light.said and not case.reading.said] or found
    for tolerance in _TOLERANCES:
        best = None
        for case in plain:
            light = case.light.coefficients[:, :count]
            matched = match(case.reading.channels, light, small, tolerance)
            if best is None or matched.right.sum() > best[1].right.sum():
                best = case, matched
        assert best is not None
        right = int(best[1].right.sum())
        each = numbers(best[0].light.coefficients) / best[0].light.coefficients.shape[1]
        chance = math.log(small.maps * len(plain) * math.comb(count, right)) + each * (
            right - 1
        ) * math.log(tolerance)
        if right < count and 3 * right >= 2 * count and chance < math.log(_CHANCE):
            return best[0], best[1], small
    return None


def _powers(found: list[Case]) -> str:
    """Read the power of each degree, which no turn changes."""
    for case in found:
        if case.light.said or case.reading.said:
            continue
        light = sizes(case.light.coefficients)
        given = sizes(case.reading.channels)[: len(light)]
        if len(given) < 3 or light.min() <= 0:
            continue
        ratio = given / light
        if np.ptp(ratio) < 0.05 * ratio.max():
            return (
                "the power of each degree is that of the light: its directions are turned, by no "
                "quarter turns"
            )
        said = ", ".join(factor(float(one)) for one in ratio / ratio[0])
        return f"relative to the light its degrees have the sizes {said}"
    return ""
