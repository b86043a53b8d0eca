"""Read STL, text or binary. Its normals are those of the facets and say nothing new."""

import re
from pathlib import Path

import numpy as np

from ..._core.text import Words, plain_text
from ._polygons import Polygons

_FACET = "facet normal ? ? ? outer loop vertex ? ? ? vertex ? ? ? vertex ? ? ? endloop endfacet"
_TEXT = re.compile(rb"\bfacet\b|^[ \t]*end[ \t]*solid", re.I | re.M)
_SOLID = re.compile(rb"(?m)^[ \t]*(end[ \t]*)?solid\b.*$")


def read_stl(path: Path, data: bytes) -> Polygons:
    """Read the facets of a text STL of any number of solids, or of a binary one.

    A file is binary where it is exactly as long as its number of facets says, or is no text.
    """
    count = int.from_bytes(data[80:84], "little")
    whole = 84 + 50 * count
    text = plain_text(data).lstrip()
    named = text[:5].lower() == b"solid"
    if len(data) != whole and named and _TEXT.search(text):
        return _text(text)
    if len(data) < max(whole, 84):
        raise ValueError(
            f"it is neither text nor as long as its number of facets: {count:,} of them take "
            f"{whole:,} bytes, but it has {len(data):,}"
        )
    facets = np.frombuffer(
        data, [("normal", "<f4", 3), ("corners", "<f4", 9), ("more", "<u2")], count, 84
    )
    found = []
    if more := int(np.count_nonzero(facets["more"])):
        found.append(f"attribute bytes of {more} facets ignored")
    if len(data) > whole:
        found.append(f"{len(data) - whole} bytes after the last facet ignored")
    with np.errstate(invalid="ignore"):  # NaN of any kind
        return _facets(facets["corners"].astype(np.float64), found)


def _text(text: bytes) -> Polygons:
    lower = text.lower()
    solids = [match[1] is None for match in _SOLID.finditer(lower)]
    if solids[-1]:
        raise ValueError("it breaks off before endsolid")
    # Names of solids may hold anything. Blanks keep lines and places.
    words = Words(_SOLID.sub(lambda match: b" " * len(match[0]), lower))
    form = _FACET.split()
    count, rest = divmod(len(words), len(form))
    grid = np.arange(count * len(form)).reshape(count, len(form))
    right = np.ones(count, bool)
    for column, word in enumerate(form):
        if word != "?":
            right &= words.equal(grid[:, column], word.encode())
    if rest or not right.all():
        at = int(right.argmin()) if not right.all() else count
        first = at * len(form)
        raise ValueError(f"its facets are damaged, first that of line {words.line(first)}")
    # The words of the three corners; those of the normal may be anything.
    corners = grid[:, [8, 9, 10, 12, 13, 14, 16, 17, 18]]
    return _facets(words.numbers(corners.ravel()).reshape(count, 9), [])


def _facets(corners: np.ndarray, found: list[str]) -> Polygons:
    count = len(corners)
    return Polygons(
        corners.reshape(-1, 3), np.arange(3 * count), np.full(count, 3), found=tuple(found)
    )
