"""Read and write the text that Filament's cmgen prints: three numbers a line, and what they are."""

import math
import re
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..._core.text import decode, plain_text
from ..._core.words import reason
from ._stored import Stored

# What a line's comment says behind its label, and the convention that this is.
SAYS = {
    "filament": ", irradiance, pre-scaled base",
    "filament-irradiance": ", irradiance",
    "filament-sh": "",
}
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*(e[-+]?\d+)?|\.\d+(e[-+]?\d+)?|nan|inf)", re.I)
_COMMENT = re.compile(r"//|#")
_LABEL = re.compile(r"L\d")
_MOST = 10_000  # lines: degree 99


def read_cmgen(path: Path, which: str | int | None) -> Stored:
    """Read a text of three numbers a line, in brackets or not, commented or not."""
    if which is not None:
        raise ValueError(f"a .txt holds one light: which must be None, got {which!r}")
    rows, said = [], set()
    for number, line in enumerate(plain_text(path.read_bytes()).split(b"\n"), 1):
        numbers, *comment = _COMMENT.split(decode(line), maxsplit=1)
        if not numbers.strip():
            continue
        words = _words(numbers)
        if len(words) != 3 or not all(map(_NUMBER.fullmatch, words)):
            raise ValueError(
                f"line {number} should hold three numbers, got {reason(numbers.strip(), 40)!r}"
            )
        if len(rows) == _MOST:
            raise ValueError(f"it has more than {_MOST} lines of numbers, expected one light")
        said.add(_said(len(rows), number, comment[0].strip() if comment else ""))
        rows.append([float(word) for word in words])
    if not rows:
        raise ValueError("it holds no numbers")
    if len(said) > 1:
        raise ValueError(
            "its comments contradict each other: "
            f"{', '.join(sorted(str(name or 'no convention') for name in said))}"
        )
    return Stored(np.array(rows), said.pop(), "channels-last")


def _words(line: str) -> list[str]:
    """Split at blanks and commas, without the brackets around all and what follows them."""
    line = line.strip().rstrip(",;").rstrip()
    if line[:1] + line[-1:] in ("()", "[]", "{}"):
        line = line[1:-1]
    return line.replace(",", " ").split()


def _said(place: int, number: int, comment: str) -> str | None:
    """Give the convention that the comment of a coefficient names, None where it names none."""
    if not _LABEL.match(comment):
        return None
    for convention, words in SAYS.items():
        if comment == label(place) + words:
            return convention
    raise ValueError(
        f"line {number} should be {label(place)} of cmgen, but its comment is "
        f"{reason(comment, 60)!r}"
    )


def label(place: int) -> str:
    """Name a coefficient as cmgen does: L00, L1-1, L10, …"""
    l = math.isqrt(place)
    return f"L{l}{place - l * l - l}"


def cmgen_file(values: Float[np.ndarray, "k 3"], convention: str) -> bytes:
    """Give a text as cmgen prints it, with as many digits as the numbers have."""
    digits = 9 if values.dtype == np.float32 else 17
    lines = [
        f"({', '.join(f'{value:.{digits}g}' for value in row)}); // {label(i)}{SAYS[convention]}\n"
        for i, row in enumerate(values.tolist())
    ]
    return "".join(lines).encode()
