"""Decompress what EXT_meshopt_compression and KHR_meshopt_compression pack.

Source: the bitstreams and filters in the text of both extensions (Khronos).
"""

import numpy as np
from jaxtyping import UInt8

from ..._core.gltf import Document
from ..._core.json_fields import Fields, shown, text, whole
from ._gltf_meshopt_filters import FILTERS
from ._gltf_meshopt_indices import unpack_sequence, unpack_triangles

# Bits of each delta in a group of 16, by the two bits in its header: version 0, and version 1
# where the control bits of the byte are 0 and 1.
_BITS = ((0, 2, 4, 8), (0, 1, 2, 4), (1, 2, 4, 8))
_NO_DELTAS, _PLAIN = 2, 3  # other values of the control bits
# How many values in a byte say that the delta follows in a byte of its own.
_ESCAPES = {
    1: bytes(value.bit_count() for value in range(256)),
    2: bytes(sum(value >> shift & 3 == 3 for shift in (0, 2, 4, 6)) for value in range(256)),
    4: bytes((value >> 4 == 15) + (value & 15 == 15) for value in range(256)),
}
_SHIFTS = {1: (0, 1, 2, 3, 4, 5, 6, 7), 2: (6, 4, 2, 0), 4: (4, 0)}


def unpack(document: Document, packed: memoryview, fields: Fields, owner: str) -> memoryview:
    """Give the bytes of a compressed bufferView; `fields` are those of the extension."""
    count, stride = whole(fields, "count", owner), whole(fields, "byteStride", owner)
    mode, kind = text(fields, "mode", owner), text(fields, "filter", owner) or "NONE"
    document.unpack(len(packed), count * stride, owner)
    if kind != "NONE" and (mode != "ATTRIBUTES" or kind not in FILTERS):
        raise ValueError(f"{owner} has the filter {shown(kind)} in mode {shown(mode)}")
    data = bytes(packed)
    try:
        if mode == "ATTRIBUTES":
            rows = _unpack_attributes(data, count, stride)
            values = rows if kind == "NONE" else FILTERS[kind](rows)
        elif mode in ("TRIANGLES", "INDICES"):
            if stride not in (2, 4):
                raise ValueError(f"indices have 2 or 4 bytes, not {stride}")
            read = unpack_triangles if mode == "TRIANGLES" else unpack_sequence
            values = read(data, count).astype(f"<u{stride}")
        else:
            raise ValueError(f"it has the mode {shown(mode)}")
    except IndexError:
        raise ValueError(f"{owner}: its compressed bytes break off") from None
    except ValueError as error:
        raise ValueError(f"{owner}: its compressed bytes are damaged: {error}") from None
    return memoryview(values.tobytes())


def _unpack_attributes(data: bytes, count: int, stride: int) -> UInt8[np.ndarray, "n s"]:
    if stride % 4 or not 4 <= stride <= 256:
        raise ValueError(f"the stride of vertices is {stride}, not a multiple of 4 up to 256")
    if data[0] not in (0xA0, 0xA1):
        raise ValueError(f"they begin with {data[0]}")
    version = data[0] & 15
    tail = stride + version * stride // 4
    first = np.frombuffer(data[-tail:][:stride], np.uint8)
    modes = data[-tail:][stride:] if version else bytes(stride // 4)
    deltas, end = _read_deltas(data, count, stride, version)
    if end + max(tail, 24 if version else 32) != len(data):
        raise ValueError(f"they are {len(data)} bytes, of which {end} are used")
    rows = np.empty((count, stride), np.uint8)
    for byte, mode in zip(range(0, stride, 4), modes, strict=True):
        kind = mode & 3
        if kind == 3:
            raise ValueError(f"bytes {byte} to {byte + 3} have an unknown kind of difference")
        # Differences of 8, 16 or 32 bits, of successive vertices and so sums down the column.
        dtype = np.dtype(("<u1", "<u2", "<u4")[kind])
        change = np.ascontiguousarray(deltas[byte : byte + 4, :count].T).view(dtype)
        start = np.ascontiguousarray(first[byte : byte + 4]).view(dtype)
        if kind == 2:
            turn = mode >> 4
            change = (change >> turn) | (change << ((32 - turn) % 32))
            column = np.bitwise_xor.accumulate(change, axis=0) ^ start
        else:
            change = (change >> 1) ^ -(change & 1)  # the sign is in the lowest bit
            column = np.cumsum(change, axis=0, dtype=dtype) + start
        rows[:, byte : byte + 4] = np.ascontiguousarray(column).view(np.uint8).reshape(-1, 4)
    return rows


def _read_deltas(
    data: bytes, count: int, stride: int, version: int
) -> tuple[UInt8[np.ndarray, "s n"], int]:
    """Give the deltas of each byte of a vertex, filled up to groups of 16, and where they end."""
    block = min(8192 // stride & ~15, 256)
    deltas = np.zeros((stride, -(-count // 16) * 16), np.uint8)
    # Where the groups of each width lie: in the bytes, and in `deltas`.
    groups: dict[int, list[tuple[int, int, int]]] = {1: [], 2: [], 4: [], 8: []}
    at = 1
    for base in range(0, count, block):
        size = min(block, count - base)
        number = -(-size // 16)
        control = at
        at += version * stride // 4
        for byte in range(stride):
            choice = data[control + byte // 4] >> 2 * (byte % 4) & 3 if version else 0
            if choice == _NO_DELTAS:
                continue
            if choice == _PLAIN:
                deltas[byte, base : base + size] = _bytes(data, at, size)
                at += size
                continue
            header, widths = at, _BITS[version + choice]
            at += -(-number // 4)
            for group in range(number):
                bits = widths[data[header + group // 4] >> 2 * (group % 4) & 3]
                if bits:
                    groups[bits].append((at, byte, base + 16 * group))
                    if bits < 8:
                        at += sum(data[at : at + 2 * bits].translate(_ESCAPES[bits]))
                    at += 2 * bits
                    if at > len(data):
                        raise IndexError
    stored = np.frombuffer(data, np.uint8)
    for bits, places in groups.items():
        if places:
            where, rows, columns = np.array(places).T
            values = _read_groups(stored, where, bits)
            deltas[rows[:, None], columns[:, None] + np.arange(16)] = values
    return deltas, at


def _bytes(data: bytes, at: int, size: int) -> UInt8[np.ndarray, " n"]:
    if at + size > len(data):
        raise IndexError
    return np.frombuffer(data, np.uint8, size, at)


def _read_groups(stored: np.ndarray, where: np.ndarray, bits: int) -> UInt8[np.ndarray, "g 16"]:
    """Read groups of 16 deltas of some bits; the largest value stands for a byte that follows."""
    packed = stored[where[:, None] + np.arange(2 * bits)]
    if bits == 8:
        return packed
    shifts = np.array(_SHIFTS[bits], np.uint8)
    most = 2**bits - 1
    values = (packed[:, :, None] >> shifts & most).reshape(-1, 16)
    escapes = values == most
    follows = where[:, None] + 2 * bits + np.cumsum(escapes, axis=1) - 1
    values[escapes] = stored[follows[escapes]]
    return values
