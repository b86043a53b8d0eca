"""Mitsuba's container of named arrays, "tensor_file" version 1.0, all of it little-endian."""

import pathlib
import struct

import numpy as np

_MAGIC = b"tensor_file\x00\x01\x00"
_DTYPES = dict(enumerate(("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f2", "f4", "f8"), 1))


def read_tensors(path: pathlib.Path) -> dict[str, np.ndarray]:
    """Arrays by name. Raises `ValueError` that names the file where it is not one or is damaged."""
    data = path.read_bytes()
    if not data.startswith(_MAGIC):
        raise ValueError(f"{path}: not a tensor file of version 1.0")
    try:
        return _read(data)
    except (struct.error, ValueError, KeyError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: damaged tensor file ({error})") from error


def _read(data: bytes) -> dict[str, np.ndarray]:
    """A count, then for each: length and name, rank, type, offset, extents."""
    (count,), at = struct.unpack_from("<I", data, len(_MAGIC)), len(_MAGIC) + 4
    tensors = {}
    for _ in range(count):
        (length,) = struct.unpack_from("<H", data, at)
        name = data[at + 2 : at + 2 + length].decode()
        at += 2 + length
        rank, kind, offset = struct.unpack_from("<HBQ", data, at)
        shape = struct.unpack_from(f"<{rank}Q", data, at + 11)
        at += 11 + 8 * rank
        dtype = np.dtype("<" + _DTYPES[kind])
        flat = np.frombuffer(data, dtype, int(np.prod(shape)), offset)
        tensors[name] = flat.reshape(shape)
    return tensors
