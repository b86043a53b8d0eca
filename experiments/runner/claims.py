"""What a paper says, held against what was measured."""

import dataclasses
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from .errors import UserError, unknown
from .places import Place, Row

FILE = "paper.toml"

Holds = Literal["holds", "does not hold", "open"]


@dataclasses.dataclass(frozen=True)
class Claim:
    """A sentence and the bound that it puts on a number.

    `measure` is a place (see `places`); `minus` or `over`, another, is taken off it or divides it.
    `preset` is the only one whose results can judge it, "" where any can.
    """

    says: str
    where: str
    measure: Place
    what: str  # the number, in words
    at_least: float | None = None
    at_most: float | None = None
    minus: Place | None = None
    over: Place | None = None
    scale: float = 1.0
    unit: str = ""
    digits: int | None = None
    preset: str = ""
    our_bound: bool = False  # the paper puts no number to its sentence
    note: str = ""

    @property
    def experiments(self) -> list[str]:
        """What its number is taken from."""
        places = (self.measure, self.minus, self.over)
        return list(dict.fromkeys(place.experiment for place in places if place))

    @property
    def bound(self) -> str:
        """The bound in words."""
        ends = (("at least", self.at_least), ("at most", self.at_most))
        said = " and ".join(f"{word} {self.say(end)}" for word, end in ends if end is not None)
        return f"{said} (our bound)" if self.our_bound else said

    def say(self, value: float) -> str:
        """A number of its kind, with the unit."""
        number = f"{value:.3g}" if self.digits is None else f"{value:.{self.digits}f}"
        return f"{number}{'' if self.unit == '°' else ' '}{self.unit}".rstrip()


@dataclasses.dataclass(frozen=True)
class Paper:
    """A folder of experiments: what it is about, and what is claimed."""

    folder: Path
    title: str
    cited: str
    year: int
    claims: tuple[Claim, ...] = ()


@dataclasses.dataclass(frozen=True)
class Verdict:
    """Whether a claim holds, and by how much; why not known, where it is open."""

    claim: Claim
    holds: Holds
    measured: str = ""
    margin: str = ""
    preset: str = ""


def read(folder: Path) -> Paper:
    """What `paper.toml` in the folder says; a bare paper without it."""
    path = folder / FILE
    if not path.exists():
        return Paper(folder, folder.name, folder.name, 9999)
    where = f"{folder.name}/{FILE}"
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise UserError(f"{where}: {error}") from None
    claims = content.pop("claims", [])
    for key in content:
        if key not in ("title", "cited", "year"):
            raise unknown("key", key, ("title", "cited", "year", "claims"), where)
    try:
        return Paper(folder, **content, claims=tuple(_claim(one, where) for one in claims))
    except TypeError as error:
        raise UserError(f"{where}: {error}") from None


def _claim(values: dict[str, Any], where: str) -> Claim:
    fields = [field.name for field in dataclasses.fields(Claim)]
    for key in values:
        if key not in fields:
            raise unknown("key", key, fields, where)
    said = repr(values.get("says", "a claim"))
    if "at_least" not in values and "at_most" not in values:
        raise UserError(f"{where}: {said} has neither at_least nor at_most")
    if "minus" in values and "over" in values:
        raise UserError(f"{where}: {said} has both minus and over")
    for key in ("at_least", "at_most", "scale"):
        if not isinstance(values.get(key, 0), int | float):
            raise UserError(f"{where}: {said}: {key} should be a number, not {values[key]!r}")
    filled: dict[str, Any] = dict(values)
    for key in ("measure", "minus", "over"):
        if key in values:
            filled[key] = Place.read(values[key])
    try:
        return Claim(**filled)
    except TypeError as error:
        raise UserError(f"{where}: {said}: {error}") from None


def judge(claim: Claim, rows: Mapping[str, Sequence[Row]], presets: Mapping[str, str]) -> Verdict:
    """Hold the claim against the rows of the experiments, by name, that have results."""
    missing = [name for name in claim.experiments if name not in rows]
    if missing:
        return Verdict(claim, "open", margin=f"no results of {', '.join(missing)}")
    preset = presets[claim.measure.experiment]
    if claim.preset and any(presets[name] != claim.preset for name in claim.experiments):
        return Verdict(claim, "open", margin=f"only the preset {claim.preset} can tell")
    try:
        value = claim.measure.value(rows[claim.measure.experiment]) * claim.scale
        if claim.minus:
            value -= claim.minus.value(rows[claim.minus.experiment]) * claim.scale
        if claim.over:
            value /= claim.over.value(rows[claim.over.experiment])
    except (TypeError, ValueError, ZeroDivisionError) as error:
        return Verdict(claim, "open", margin=f"not measured with these settings ({error})")
    beyond = [
        margin
        for end, margin in (
            (claim.at_least, value - (claim.at_least or 0.0)),
            (claim.at_most, (claim.at_most or 0.0) - value),
        )
        if end is not None
    ]
    least = min(beyond)
    return Verdict(
        claim,
        "holds" if least >= 0 else "does not hold",
        claim.say(value),
        _margin(claim, value, least),
        preset,
    )


def _margin(claim: Claim, value: float, least: float) -> str:
    """By how much: the distance to the nearer bound, and how many times where that tells more."""
    said = f"by {claim.say(abs(least))}" if abs(least) < float("inf") else ""
    if least != least:
        return "not a number"
    ends = [end for end in (claim.at_least, claim.at_most) if end is not None]
    if len(ends) == 1 and claim.unit != "dB" and min(ends[0], value) > 0:
        times = max(value / ends[0], ends[0] / value)
        if times >= 2:
            count = f"{float(f'{times:.2g}'):,.0f}" if times >= 10 else f"{times:.2g}"
            return f"{count} times {'more' if value > ends[0] else 'less'}"
    return said
