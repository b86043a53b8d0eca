"""Hold what a file of a light says, before anything is converted."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Shaped

from ..._core.checks import nearest
from ..._core.words import reason
from ...harmonics import Convention


class Stored(NamedTuple):
    """Holds coefficients as stored, and what the file itself says of them."""

    values: Shaped[np.ndarray, "..."]
    convention: str | Convention | None  # None where the file does not say
    layout: str | None = None  # the file's, whatever the convention
    rotation: Float[np.ndarray, "3 3"] | None = None  # of the light, in the file's axes
    single: bool = False  # the file holds one light, whatever its numbers' shape


def choose(what: str, names: Sequence[str], which: str | int | None, default: int | None) -> int:
    """Find the one of several things that is meant, by its place or its name.

    Raises `ValueError` where there is none such, or several and no default.
    """
    there = f"it holds {len(names)} {what} ({_listed(names)})"
    if which is None:
        if default is None and len(names) != 1:
            raise ValueError(f"{there}: say which by which=")
        return default or 0
    if isinstance(which, int):
        if not 0 <= which < len(names):
            raise ValueError(f"{there}, and which is {which}")
        return which
    if names.count(which) != 1:
        raise ValueError(
            f"{there}, {names.count(which) or 'none'} of them {which!r}{nearest(which, names)}"
        )
    return names.index(which)


def _listed(names: Sequence[str]) -> str:
    return reason(", ".join(repr(name) for name in names), 120) or "none"
