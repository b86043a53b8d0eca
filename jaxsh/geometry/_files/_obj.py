"""Read Wavefront OBJ: polygons with normals, UV and materials, vertices with colors."""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._core.ranges import ranges
from ..._core.text import JOINT, Words, decode, parse, plain_text, without_comment
from ._mtl import Materials
from ._polygons import Polygons, unit_colors

# Every statement of the format (Wavefront's appendix B1): a damaged "f" must not pass for another.
_STATEMENTS = re.compile(
    "v|vt|vn|vp|deg|bmat|step|cstype|p|l|f|curv|curv2|surf|parm|trim|hole|scrv|sp|end|con|g|s|mg|o|"
    "bevel|c_interp|d_interp|lod|usemap|maplib|usemtl|mtllib|shadow_obj|trace_obj|ctech|stech|"
    "bsp|bzp|cdc|cdp|res|call|csh|fo|t|vw"
)
# Not in 1.#IND and the like, which some systems print for a value that is none.
_COMMENT = re.compile(rb"(?<!1\.)#|#(?!(?:qnan|snan|ind|inf))", re.I)
# Statements that are left out, and said so.
_OTHERS = {
    "p": "points",
    "l": "lines",
    "curv": "curves",
    "curv2": "curves on surfaces",
    "surf": "surfaces",
    "call": "calls of other files",
    "usemap": "texture maps without a material",
    # Additions of other programs.
    "t": "tags of subdivision",
    "vw": "skin weights",
}


def read_obj(path: Path, data: bytes) -> Polygons:
    """Read the polygons of an OBJ file, of all its objects and groups.

    Vertices may have a color behind x y z (red, green, blue). Materials are looked for beside the
    file. What Wavefront's format has besides polygons is counted and left out.
    """
    text = plain_text(data) + b"\n"
    # Both leave all other words at their places.
    plain = re.sub(rb"#[^\n]*", _blanks, text)
    plain = re.sub(rb"\\[ \t]*\n", lambda m: b" " * (len(m[0]) - 1) + JOINT, plain)
    words, found = Words(plain), []
    kinds = _kinds(words)
    positions, colors = _vertices(words, kinds["v"], found)
    faces = _faces(words, kinds, len(positions), found)
    at = faces.vertex
    normals = _rows(words, kinds["vn"], 3, faces.normal, "vn")
    uv = _rows(words, kinds["vt"], 2, faces.uv, "vt")
    material, materials = _materials(path, words, text, kinds, found)
    _say_groups(words, kinds["s"], normals is not None, found)
    found += [
        f"{len(kinds[name])} {what} ignored" for name, what in _OTHERS.items() if len(kinds[name])
    ]
    return Polygons(
        positions,
        at,
        faces.sizes,
        normals,
        uv,
        None if colors is None else colors[at],
        material,
        materials,
        tuple(found),
    )


def _blanks(match: re.Match[bytes]) -> bytes:
    """Give blanks for what stands from # to the end of a line, as far as it is a comment."""
    begin, end = match.span()
    comment = _COMMENT.search(match.string, begin, end)
    at = comment.start() if comment else end
    return match.string[begin:at] + b" " * (end - at)


def _kinds(words: Words) -> dict[str, np.ndarray]:
    """Tell for each statement of interest which lines hold it; count or refuse the others."""
    kinds = {name: words.equal(words.first, name.encode()) for name in ("v", "vt", "vn", "f", "s")}
    kinds["f"] |= words.equal(words.first, b"fo")  # the same in old files
    rest = np.ones(len(words.first), bool)
    for lines in kinds.values():
        rest &= ~lines
    others: dict[str, list[int]] = {}
    for line in np.flatnonzero(rest).tolist():
        at = int(words.first[line])
        name = words.word(at)
        if not _STATEMENTS.fullmatch(name):
            raise ValueError(f"line {words.line(at)} begins with {name!r}, which is no statement")
        others.setdefault(name, []).append(line)
    for name in ("usemtl", "mtllib", *_OTHERS):
        kinds[name] = np.array(others.get(name, []), np.int64)
    return kinds


def _vertices(words: Words, lines: np.ndarray, found: list[str]):
    first, counts = words.first[lines] + 1, words.counts[lines] - 1
    _check_counts(words, first, counts, 3, "v")
    # x y z, perhaps w, which matters to curves alone; or x y z and a color of three or four.
    widths = np.where((counts == 6) | (counts == 7), counts, 3)
    numbers = words.numbers(ranges(first, widths))
    begin = np.cumsum(widths) - widths
    positions = numbers[begin[:, None] + np.arange(3)]
    if more := int((~np.isin(counts, (3, 4, 6, 7))).sum()):
        found.append(f"further values of {more} vertices ignored")
    weighted = counts == 4
    if weighted.any() and (lost := int((words.numbers(first[weighted] + 3) != 1).sum())):
        found.append(f"weights w of {lost} vertices ignored")
    colored = widths > 3
    if not colored.any():
        return positions, None
    colors = np.full((len(positions), 4), np.nan)
    colors[colored, :3] = numbers[begin[colored, None] + np.arange(3, 6)]
    alpha = widths == 7
    colors[alpha, 3] = numbers[begin[alpha] + 6]
    colors, phrase = unit_colors(colors)
    found += [phrase] if phrase else []
    return positions, colors


def _check_counts(words: Words, first, counts, least: int, name: str) -> None:
    if (counts < least).any():
        at = int((counts < least).argmax())
        raise ValueError(
            f"line {words.line(int(first[at]) - 1)} has {counts[at]} values after {name!r}"
        )


def _rows(words: Words, lines: np.ndarray, width: int, at: np.ndarray, name: str):
    """Give for each corner the row that it names of one kind of line, NaN for none (-1)."""
    if not (at >= 0).any():
        return None
    first, counts = words.first[lines] + 1, words.counts[lines] - 1
    # A texture may have one coordinate only; the second is zero then.
    least = 1 if name == "vt" else width
    _check_counts(words, first, counts, least, name)
    taken = np.minimum(counts, width)
    numbers = words.numbers(ranges(first, taken))
    rows = np.zeros((len(first) + 1, width))
    begin = np.cumsum(taken) - taken
    for column in range(width):
        has = np.flatnonzero(taken > column)
        rows[has, column] = numbers[begin[has] + column]
    rows[-1] = np.nan
    return rows[at]


class _Faces(NamedTuple):
    sizes: np.ndarray
    vertex: np.ndarray
    uv: np.ndarray  # -1 for none
    normal: np.ndarray  # -1 for none


def _faces(words: Words, kinds: dict[str, np.ndarray], vertices: int, found: list[str]) -> _Faces:
    """Read what the corners of all faces name, counted from 0."""
    lines = kinds["f"]
    sizes = words.counts[lines] - 1
    _check_counts(words, words.first[lines] + 1, sizes, 3, "f")
    at = words.in_lines(lines, skip=1)
    text = words.joined(at)
    slashes = text.count(b"/")
    # How many numbers each corner has between its slashes; one left out stands as 0, for none.
    fields = np.ones(len(at), np.int64)
    if slashes:
        slash = np.flatnonzero(words.bytes == ord("/"))
        owner = np.searchsorted(words.starts, slash, "right") - 1
        fields += np.bincount(owner, minlength=len(words))[at]
        for gap in (b"//", b"/ ", b"/\n", b"/\t", b"/\v", b"/\f"):
            text = text.replace(gap, b"/0" + gap[1:])
        if text.endswith(b"/"):
            text += b"0"
        text = text.replace(b"/", b" ")
    numbers = parse(text, int(fields.sum()), np.int64)
    if numbers is None or (fields > 3).any():
        raise ValueError(_wrong_corner(words, at))
    begin = np.cumsum(fields) - fields
    named = np.zeros((len(at), 3), np.int64)
    for column in range(3):
        has = fields > column
        named[has, column] = numbers[begin[has] + column]
    line = np.repeat(np.flatnonzero(lines), sizes)
    for column, kind in enumerate(("v", "vt", "vn")):
        so_far = np.cumsum(kinds[kind])
        index = named[:, column]
        # Negative ones count back from the last so far.
        index = np.where(index < 0, index + so_far[line] + 1, index)
        total = int(so_far[-1]) if len(so_far) else 0
        wrong = (index > total) | (index < 0) | ((index == 0) & (named[:, column] < 0))
        if column > 0:
            if lost := int(wrong.sum()):
                what = "texture coordinates" if kind == "vt" else "normals"
                found.append(f"{lost} corners name {what} that are not there")
            index = np.where(wrong, 0, index)
        elif (wrong | (index == 0)).any():
            wrong |= index == 0
            corner = int(wrong.argmax())
            raise ValueError(
                f"line {words.line(int(at[corner]))} names {kind} {named[corner, column]}, but "
                f"there are {total}"
            )
        named[:, column] = index - 1
    return _Faces(sizes, *np.ascontiguousarray(named.T))


def _wrong_corner(words: Words, at: np.ndarray) -> str:
    """Say which corner is none: one was found to be."""
    for corner in at.tolist():
        if not re.fullmatch(r"[-+]?\d+(/([-+]?\d+)?(/([-+]?\d+)?)?)?", words.word(corner), re.A):
            return f"line {words.line(corner)}: {words.word(corner)!r} is no corner of a face"
    return "its faces hold numbers that are too large"


def _materials(path: Path, words: Words, text: bytes, kinds, found: list[str]):
    """Read which material each face has: that of the last `usemtl` before it."""
    if not len(kinds["usemtl"]):
        return None, ()

    def names(kind: str) -> list[str]:
        starts = words.starts[words.first[kinds[kind]]] + len(kind)
        lines = (text[start : text.find(b"\n", start)] for start in starts.tolist())
        return [decode(line).strip() for line in lines]

    materials = Materials(path, names("mtllib"), found)
    used = (without_comment(name) for name in names("usemtl"))
    rows = np.array([-1, *(materials.row(name) for name in used)])
    last = np.searchsorted(kinds["usemtl"], np.flatnonzero(kinds["f"]))
    return rows[last], materials.table()


def _say_groups(words: Words, lines: np.ndarray, normals: bool, found: list[str]) -> None:
    """Say that smoothing groups are not looked at, where nothing else tells the hard edges."""
    named = lines & (words.counts > 1)
    groups = {words.word(int(at) + 1) for at in words.first[named]}
    if len(groups) > 1 and not normals:
        found.append(f"{len(groups)} smoothing groups ignored")
