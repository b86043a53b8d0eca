"""Decompress the vertex indices of EXT_meshopt_compression: lists of triangles, and sequences."""

import numpy as np
from jaxtyping import Int

_WRAP = 0xFFFFFFFF
_KEPT = 1000


def unpack_sequence(data: bytes, count: int) -> Int[np.ndarray, " n"]:
    """Read indices that each differ little from one of two earlier ones."""
    if data[0] != 0xD1:
        raise ValueError(f"they begin with {data[0]}")
    if count > len(data):
        raise IndexError
    reader, last = _Reader(data, 1), [0, 0]
    out = np.empty(count, np.int64)
    for i in range(count):
        code = reader.number()
        which = code & 1
        last[which] = (last[which] + _signed(code >> 1)) & _WRAP
        out[i] = last[which]
    return out


def unpack_triangles(data: bytes, count: int) -> Int[np.ndarray, " n"]:
    """Read triangles that mostly share an edge and a vertex with one of the last few."""
    if data[0] not in (0xE0, 0xE1):
        raise ValueError(f"they begin with {data[0]}")
    if count % 3:
        raise ValueError(f"{count} corners are not three for each triangle")
    number = count // 3
    if 1 + number + 16 > len(data):
        raise IndexError
    reader, pairs = _Reader(data[:-16], 1 + number), data[-16:]  # the pairs of codes most in use
    # Codes that step by one from the last free index, in the second version of the format.
    steps = {13: -1, 14: 1} if data[0] == 0xE1 else {}
    edges, vertices = [(0, 0)] * 16, [0] * 16  # the last few, newest at -1
    new = last = a = b = 0
    out: list[int] = []
    for code in data[1 : 1 + number]:
        edge, vertex = code >> 4, code & 15
        if edge < 15:
            a, b = edges[-1 - edge]
            codes = (vertex,)
        elif vertex < 14:
            codes = (0, pairs[vertex] >> 4, pairs[vertex] & 15)
        else:
            pair = reader.byte()
            new = new if pair else 0
            codes = (0 if vertex == 14 else 15, pair >> 4, pair & 15)
        found, fresh = [], []
        for one in codes:
            if one == 0:  # not seen before
                index = new
                new += 1
            elif edge < 15 and one in steps:
                index = last = (last + steps[one]) & _WRAP
            elif one == 15:  # far away
                index = last = (last + _signed(reader.number())) & _WRAP
            else:
                # Across an edge lies never the newest vertex: codes count from the next.
                found.append(vertices[-one - (edge < 15)])
                continue
            found.append(index)
            fresh.append(index)
        # Codes look at the vertices of the triangles before this one.
        vertices += fresh
        if edge < 15:
            (c,) = found
        else:
            a, b, c = found
            edges.append((b, a))
        edges += (c, b), (a, c)
        out += a, b, c
        if len(edges) > _KEPT:
            del edges[:-16], vertices[:-16]
    return np.array(out, np.int64)


def _signed(code: int) -> int:
    """Give the number whose sign is in the lowest bit."""
    return (code >> 1) ^ -(code & 1)


class _Reader:
    """Reads whole numbers of seven bits a byte."""

    def __init__(self, data: bytes, at: int):
        self._data = data
        self._at = at

    def byte(self) -> int:
        value = self._data[self._at]
        self._at += 1
        return value

    def number(self) -> int:
        value = 0
        for shift in range(0, 35, 7):
            byte = self.byte()
            value |= (byte & 127) << shift
            if byte < 128:
                return value & _WRAP
        raise ValueError("a number has more than 32 bits")
