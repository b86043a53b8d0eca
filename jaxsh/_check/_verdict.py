"""The answer of a check."""

from dataclasses import dataclass, field

from ..harmonics import Convention
from ._words import factor, percent


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Says what convention coefficients are in; made by `check`, and printed as a short report.

    - `decided`: whether one conversion to jaxsh explains what was given and no other does.
    - `summary`: the verdict in words: "Condon–Shortley, z up, orthonormal, radiance".
    - `agree`: names of `harmonics.conventions()` that agree in everything that could be seen.
    - `nearly`: further names that agree but for the one thing said.
    - `found`: the convention, for `harmonics.convert(coefficients, found, "jaxsh")`; None where
      nothing fits.
    - `scale`: what was given is so many times as large as that convention says.
    - `residual`: the error of that convention, relative to the light without its constant part.
    - `residuals`: that of each named convention, with the best scale.
    - `faults`: what is wrong by that convention, in words.
    - `open`: what cannot be told, and what would decide it.
    - `notes`: what else was seen.
    - `conversion`: the call that converts to our convention; empty where there is none.

    **Example**

    >>> import numpy as np
    >>> import jaxsh
    >>> picture = np.random.default_rng(0).uniform(size=(16, 32, 3))
    >>> light = jaxsh.sphere.project_lat_long(picture, degree=2)
    >>> verdict = jaxsh.check(light, picture)
    >>> verdict.decided, verdict.agree[0], verdict.scale
    (True, 'jaxsh', 1.0)
    """

    decided: bool
    summary: str
    agree: tuple[str, ...] = ()
    nearly: dict[str, str] = field(default_factory=dict)
    found: Convention | None = None
    scale: float = 1.0
    residual: float = float("inf")
    residuals: dict[str, float] = field(default_factory=dict)
    faults: tuple[str, ...] = ()
    open: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    conversion: str = ""

    def __str__(self) -> str:
        lines = [f"{'found' if self.decided else 'undecided'}: {self.summary}"]
        if self.agree:
            lines.append(f"agree: {', '.join(self.agree)}")
        for but in dict.fromkeys(self.nearly.values()):
            alike = [name for name, other in self.nearly.items() if other == but]
            lines.append(f"nearly: {', '.join(alike)}, {but}")
        if self.found is not None:
            lines.append(f"residual: {percent(self.residual)}")
        if self.scale != 1.0:
            lines.append(f"scale: {factor(self.scale)} times what that convention has")
        lines += [f"fault: {one}" for one in self.faults]
        lines += [f"open: {one}" for one in self.open]
        lines += [f"note: {one}" for one in self.notes]
        if self.conversion:
            likely = "" if self.decided else ", by the likeliest"
            lines.append(f"to convert{likely}: {self.conversion}")
        return "\n".join(lines)
