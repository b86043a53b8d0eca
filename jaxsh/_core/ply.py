"""Read the header of a PLY file, and its elements as columns of numbers."""

import re
from typing import NamedTuple

import numpy as np

from .ranges import ranges
from .text import Words, decode, plain_text

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}


class Property(NamedTuple):
    name: str
    kind: str  # of its numbers, as NumPy writes it
    size: str = ""  # of the number of numbers, for a list


class Element(NamedTuple):
    name: str
    rows: int
    properties: list[Property]


class Header(NamedTuple):
    elements: list[Element]
    order: str  # "<" or ">" for binary, "" for text
    comments: list[str]
    ignored: int  # lines that say nothing known
    body: memoryview  # of the file, which may be large


class Lists(NamedTuple):
    """Holds the lists of all rows of an element, one behind the other."""

    sizes: np.ndarray
    values: np.ndarray


Columns = dict[str, np.ndarray | Lists]


def read_header(data: bytes) -> Header:
    """Read the header line by line: a comment may hold any word of it."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    end = re.match(rb"ply[ \t]*(\r\n|\n|\r)", data)
    if not end:
        raise ValueError("it does not begin with 'ply'")
    elements: list[Element] = []
    order, comments, ignored, at = None, [], 0, end.end()
    while True:
        stop = data.find(end[1], at)
        if stop < 0:
            raise ValueError("its header is not whole")
        line = decode(data[at:stop]).strip()
        at = stop + len(end[1])
        match line.split():
            case ["end_header"]:
                break
            case [] | ["obj_info", *_]:
                pass
            case ["comment", *_]:
                comments.append(line[7:].strip())
            case ["format", "ascii", *_]:
                order = ""
            case ["format", "binary_little_endian", *_]:
                order = "<"
            case ["format", "binary_big_endian", *_]:
                order = ">"
            case ["element", name, count] if count.isascii() and count.isdigit():
                elements.append(Element(name.lower(), int(count), []))
            case ["property", "list", size, kind, name] if (
                elements and _TYPES.get(size, "f")[0] != "f" and kind in _TYPES
            ):
                elements[-1].properties.append(Property(name.lower(), _TYPES[kind], _TYPES[size]))
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1].properties.append(Property(name.lower(), _TYPES[kind]))
            case ["element" | "property" | "format", *_]:
                raise ValueError(
                    f"its header has the line {line[:60]!r}, which is no format, number of "
                    f"elements or type that PLY has"
                )
            case _:  # a comment broken in two, say
                ignored += 1
    if order is None:
        raise ValueError("its header names no format")
    return Header(elements, order, comments, ignored, memoryview(data)[at:])


def read_elements(header: Header, found: list[str]) -> dict[str, Columns]:
    """Read all elements; of two with one name or two such properties the first stays."""
    read: dict[str, Columns] = {}
    if header.order == "":
        words = Words(plain_text(bytes(header.body)))
        announced = sum(element.rows for element in header.elements if element.properties)
        if len(words.first) < announced:
            raise ValueError(f"it announces {announced} lines of data, but has {len(words.first)}")
        row = 0
        for element in header.elements:
            if element.properties:
                read.setdefault(element.name, _text_columns(words, element, row, found))
                row += element.rows
    else:
        at = 0
        for element in header.elements:
            columns, at = _binary_columns(header, element, at)
            read.setdefault(element.name, columns)
    return read


def _text_columns(words: Words, element: Element, row: int, found: list[str]) -> Columns:
    first = words.first[row : row + element.rows]
    end = first + words.counts[row : row + element.rows]
    numbers = words.numbers(np.arange(first[0], end[-1])) if len(first) else np.zeros(0)
    base = first[0] if len(first) else 0
    at, columns = first.copy(), {}

    def check(wrong: np.ndarray) -> None:
        if wrong.any():
            row = int(wrong.argmax())
            raise ValueError(
                f"row {row} of its element {element.name!r} has {end[row] - first[row]} values, "
                "which is not what its header says"
            )

    for name, kind, size in element.properties:
        check(at >= end)
        values = numbers[at - base]
        at += 1
        if size:
            whole = (values >= 0) & (values <= end - at) & (values == np.rint(values))
            check(~whole)
            sizes = values.astype(np.int64)
            values = Lists(sizes, _typed(numbers[ranges(at - base, sizes)], kind))
            at += sizes
        else:
            values = _typed(values, kind)
        columns.setdefault(name, values)
    if more := int((at < end).sum()):
        found.append(f"further values of {more} rows of {element.name!r} ignored")
    return columns


def _typed(values: np.ndarray, kind: str) -> np.ndarray:
    """Give text's numbers the type that the header says, where they fit: colors depend on it."""
    if kind[0] == "f":
        return values
    limits = np.iinfo(kind)
    fits = (values >= limits.min) & (values <= limits.max) & (values == np.rint(values))
    return values.astype(kind) if fits.all() else values


def _binary_columns(header: Header, element: Element, at: int) -> tuple[Columns, int]:
    """Read an element that begins at a byte of the body; tell where the next one does."""
    body, properties = header.body, element.properties
    kinds = [np.dtype(header.order + (p.size or p.kind)) for p in properties]
    least = sum(kind.itemsize for kind in kinds)
    if least * element.rows > len(body) - at:
        raise ValueError(
            f"it announces {element.rows} rows of {element.name!r}, which take {least} bytes or "
            f"more each, but {len(body) - at} bytes are left"
        )
    lengths = _list_sizes(header, element, at)
    if isinstance(lengths, list):  # the same in all rows
        fields = []
        for i, (p, length) in enumerate(zip(properties, lengths, strict=True)):
            fields.append((f"{i}", kinds[i]))
            if p.size:
                fields.append((f"{i} list", np.dtype(header.order + p.kind), (length,)))
        if not fields:
            return {}, at
        rows = np.frombuffer(body, np.dtype(fields), element.rows, at)
        columns: Columns = {}
        for i, (p, length) in enumerate(zip(properties, lengths, strict=True)):
            values = rows[f"{i}"]
            if p.size:
                sizes = np.full(element.rows, length)
                values = Lists(sizes, rows[f"{i} list"].reshape(-1))
            columns.setdefault(p.name, values)
        return columns, at + rows.nbytes
    return _scattered(header, element, *lengths)


def _list_sizes(header: Header, element: Element, at: int):
    """Give the size of each list property where all rows have that of the first.

    Otherwise the byte where each property of each row begins, and where the last one ends.
    """
    lists = [p for p in element.properties if p.size]
    if not lists or not element.rows:
        return [0] * len(element.properties)
    starts, end = _walk(header, element, at, rows=1)
    steps = [
        (_count_at(header, p, int(start)) if p.size else 0)
        for p, start in zip(element.properties, starts[0], strict=True)
    ]
    stride = end - at
    if stride * element.rows <= len(header.body) - at:
        alike = True
        for p, start in zip(element.properties, starts[0], strict=True):
            if p.size:
                kind = np.dtype(header.order + p.size)
                sizes = np.ndarray((element.rows,), kind, header.body, int(start), (stride,))
                alike = alike and bool((sizes == sizes[0]).all())
        if alike:
            return steps
    return _walk(header, element, at, rows=element.rows)


def _count_at(header: Header, p: Property, at: int) -> int:
    width = int(p.size[1])
    order = "big" if header.order == ">" else "little"
    return int.from_bytes(header.body[at : at + width], order, signed=p.size[0] == "i")


def _walk(header: Header, element: Element, at: int, *, rows: int) -> tuple[np.ndarray, int]:
    """Find the byte where each property of each row begins, one after the other."""
    body, end = header.body, len(header.body)
    order = "big" if header.order == ">" else "little"
    steps = [
        (int(p.size[1]) if p.size else 0, p.size[:1] == "i", int(p.kind[1]))
        for p in element.properties
    ]
    starts, row = [], 0
    for row in range(rows):
        for counted, signed, width in steps:
            starts.append(at)
            if counted:
                count = int.from_bytes(body[at : at + counted], order, signed=signed)
                at += counted + (count * width if count > 0 else 0)
                if count < 0:
                    at = end + 1
            else:
                at += width
        if at > end:
            raise ValueError(f"it breaks off in row {row} of {rows} of {element.name!r}")
    return np.array(starts, np.int64).reshape(rows, len(steps)), at


def _scattered(
    header: Header, element: Element, starts: np.ndarray, end: int
) -> tuple[Columns, int]:
    body = np.frombuffer(header.body, np.uint8)

    def gathered(at: np.ndarray, kind: str) -> np.ndarray:
        kind_of = np.dtype(header.order + kind)
        return body[at[:, None] + np.arange(kind_of.itemsize)].reshape(-1).view(kind_of)

    columns: Columns = {}
    for p, at in zip(element.properties, starts.T, strict=True):
        values = gathered(at, p.size or p.kind)
        if p.size:
            sizes = values.astype(np.int64)
            width = int(p.kind[1])
            places = ranges(np.zeros_like(sizes), sizes) * width
            first = np.repeat(at + int(p.size[1]), sizes)
            values = Lists(sizes, gathered(first + places, p.kind))
        columns.setdefault(p.name, values)
    return columns, end
