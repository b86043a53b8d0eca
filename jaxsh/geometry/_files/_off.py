"""Read OFF, text or binary, with normals, colors and UV."""

import re
from pathlib import Path

import numpy as np

from ..._core.ranges import ranges
from ..._core.text import Words, plain_text
from ._polygons import Polygons, at_corners, unit_colors, without_points_and_lines

_HEADER = re.compile(
    rb"\s*(?:#[^\n]*\n\s*)*(?P<uv>ST)?(?P<color>C)?(?P<normal>N)?(?P<four>4)?(?P<n>n)?OFF"
    rb"(?P<binary>[ \t]+BINARY[^\n]*\n)?"
)


def read_off(path: Path, data: bytes) -> Polygons:
    """Read the polygons of an OFF file; the counts may follow its first word on the same line.

    Vertices hold x y z, then a normal where the header has an N, red, green, blue and perhaps alpha
    where it has a C, and two texture coordinates where it has ST. A face may end in a color of its
    own, which is taken where vertices have none.
    """
    header = _HEADER.match(data)
    if header and header["binary"]:
        _refuse_dimensions(header)
        return _binary(data[header.end() :], header)
    text = plain_text(data)
    header = _HEADER.match(text)
    if header:
        _refuse_dimensions(header)
        # The header gives way to blanks, so that lines can be counted.
        text = re.sub(rb"[^\n]", b" ", header[0]) + text[header.end() :]
    if b"#" in text:
        text = re.sub(rb"#[^\n]*", b"", text)
    return _text(Words(text), header)


def _refuse_dimensions(header: re.Match) -> None:
    if header["four"] or header["n"]:
        raise ValueError(f"{header[0].split()[-1].decode()} has points of other than 3 dimensions")


def _text(words: Words, header: re.Match | None) -> Polygons:
    lines = len(words.first)
    if not lines or words.counts[0] not in (2, 3):
        raise ValueError("it does not begin with its numbers of vertices, faces and edges")
    vertices, faces, *_ = words.numbers(np.arange(words.counts[0]), np.int64).tolist()
    if vertices < 0 or faces < 0 or lines < 1 + vertices + faces:
        raise ValueError(f"it announces {vertices + faces + 1} lines of data, but has {lines}")
    found = []
    if lines > 1 + vertices + faces:
        found.append(f"{lines - 1 - vertices - faces} lines after the last face ignored")
    positions, normals, uv, colors = _vertices(words, slice(1, 1 + vertices), header, found)
    first, counts = (a[1 + vertices : 1 + vertices + faces] for a in (words.first, words.counts))
    sizes = words.numbers(first, np.int64)
    short = sizes + 1 > counts
    if (short | (sizes < 0)).any():
        at = int(np.argmax(short | (sizes < 0)))
        raise ValueError(
            f"line {words.line(int(first[at]))} announces {sizes[at]} corners, but has "
            f"{counts[at] - 1} values"
        )
    corners = words.numbers(ranges(first + 1, sizes), np.int64)
    more = counts - 1 - sizes
    colored = (more == 3) | (more == 4)
    if ignored := int(((more > 0) & ~colored).sum()):
        found.append(f"indices into a color map at {ignored} faces ignored")
    face_colors = None
    if colored.any():
        face_colors = np.full((faces, 4), np.nan)
        at = (first + 1 + sizes)[colored]
        face_colors[colored], phrase = _face_colors(words, at, more[colored])
        found += [phrase] if phrase else []
    return _polygons(positions, corners, sizes, normals, uv, colors, face_colors, found)


def _face_colors(words: Words, first: np.ndarray, counts: np.ndarray):
    """Read three or four values for each face: bytes where they are written without a point."""
    at = ranges(first, counts)
    begin = np.cumsum(counts) - counts
    values = words.numbers(at)
    points = np.concatenate([[0], np.cumsum(words.bytes == ord("."))])
    pointed = points[words.ends[at]] > points[words.starts[at]]
    whole = np.repeat(~np.logical_or.reduceat(pointed, begin), counts)
    # A file of 0 and 1 alone has no bytes.
    if (values[whole] > 1).any():
        values[whole] /= 255
    colors = np.ones((len(counts), 4))
    colors[:, :3] = values[begin[:, None] + np.arange(3)]
    alpha = counts == 4
    colors[alpha, 3] = values[begin[alpha] + 3]
    return unit_colors(colors)


def _vertices(words: Words, lines: slice, header: re.Match | None, found: list[str]):
    """Read the values of all vertices: positions, normals, UV and colors."""
    first, counts = words.first[lines], words.counts[lines]
    width = int(counts.min(initial=np.iinfo(np.int64).max)) if len(counts) else 3
    if width < 3:
        at = int(counts.argmin())
        raise ValueError(f"line {words.line(int(first[at]))} has {width} values for a vertex")
    table = words.numbers((first[:, None] + np.arange(width)).ravel()).reshape(-1, width)
    if (counts > width).any():
        found.append(f"further values of {int((counts > width).sum())} vertices ignored")
    return _columns(table, header, found)


def _columns(table: np.ndarray, header: re.Match | None, found: list[str]):
    has = {name: bool(header and header[name]) for name in ("normal", "color", "uv")}
    needed = 3 + 3 * has["normal"] + 2 * has["uv"]
    width = table.shape[1]
    color = min(width - needed, 4) if has["color"] else 0
    if width < needed or (has["color"] and color < 3):
        raise ValueError(f"its vertices have {width} values, too few for its header")
    if width > needed + color:
        found.append(f"{width - needed - color} further values of each vertex ignored")
    at = 3
    normals = table[:, at : at + 3] if has["normal"] else None
    at += 3 * has["normal"]
    colors = None
    if color:
        colors, phrase = unit_colors(table[:, at : at + color])
        found += [phrase] if phrase else []
    at += color
    return table[:, :3], normals, table[:, at : at + 2] if has["uv"] else None, colors


def _binary(data: bytes, header: re.Match) -> Polygons:
    """Read big-endian integers and floats of 32 bits."""
    if len(data) < 12:
        raise ValueError("it breaks off before its numbers of vertices and faces")
    vertices, faces, _ = (int(n) for n in np.frombuffer(data, ">i4", 3))
    width = 3 + 3 * bool(header["normal"]) + 4 * bool(header["color"]) + 2 * bool(header["uv"])
    numbers = np.frombuffer(data, ">i4", len(data) // 4)[3:]
    # A face takes two numbers at least: how many corners, and how many colors.
    if vertices < 0 or faces < 0 or len(numbers) < width * vertices + 2 * faces:
        raise ValueError(
            f"it announces {vertices} vertices and {faces} faces, but has {len(data)} bytes of them"
        )
    found = []
    with np.errstate(invalid="ignore"):  # NaN of any kind
        table = numbers[: width * vertices].view(">f4").astype(np.float64).reshape(-1, width)
    positions, normals, uv, colors = _columns(table, header, found)
    rest = numbers[width * vertices :].astype(np.int64)
    first, sizes, colored = _binary_faces(rest, faces)
    if ignored := int((colored > 0).sum()):
        found.append(f"colors of {ignored} faces ignored")
    corners = rest[ranges(first + 1, sizes)]
    return _polygons(positions, corners, sizes, normals, uv, colors, None, found)


def _binary_faces(rest: np.ndarray, faces: int):
    """Find where each face begins, its corners, and its values of color."""
    first, sizes, colored = (np.zeros(faces, np.int64) for _ in range(3))
    at, values, end = 0, rest.tolist(), len(rest)
    for face in range(faces):
        size = values[at] if at < end else -1
        behind = at + 1 + size
        color = values[behind] if size >= 0 and behind < end else -1
        if color < 0 or behind + color >= end:
            raise ValueError(f"it breaks off in face {face} of {faces}")
        first[face], sizes[face], colored[face] = at, size, color
        at = behind + 1 + color
    return first, sizes, colored


def _polygons(positions, corners, sizes, normals, uv, colors, face_colors, found) -> Polygons:
    """Spread what vertices or faces have over their corners; leave out points and lines."""
    if face_colors is not None and colors is not None:
        found.append("colors of faces ignored, since vertices have some")
    normals, uv, colors = (at_corners(values, corners) for values in (normals, uv, colors))
    if face_colors is not None and colors is None:
        colors = np.repeat(face_colors, sizes, axis=0)
    polygons = Polygons(positions, corners, sizes, normals, uv, colors, found=tuple(found))
    return without_points_and_lines(polygons)
