"""Zip archives of NumPy arrays, as .npz files are."""

import functools
import struct
import zlib

import numpy as np
from fuzz_pictures import npy


def archive(members: dict[str, bytes]) -> bytes:
    """Put files into a zip archive as they are."""
    return _zip({name: (zlib.crc32(data), len(data), 0, data) for name, data in members.items()})


def compressed_archive(members: dict[str, bytes], zeros: dict[str, int]) -> bytes:
    """Put files into a zip archive, with arrays of so many rows of zeros, which pack well."""
    packed = {name: _packed(data) for name, data in members.items()}
    return _zip(packed | {name: _packed_zeros(rows) for name, rows in zeros.items()})


def _packed(data: bytes) -> tuple[int, int, int, bytes]:
    return zlib.crc32(data), len(data), 8, zlib.compress(data, 1, -15)


@functools.cache
def _packed_zeros(rows: int) -> tuple[int, int, int, bytes]:
    return _packed(npy(np.zeros((rows, 4), "f4")))


def _zip(members: dict[str, tuple[int, int, int, bytes]]) -> bytes:
    """Write an archive of (CRC, size, method, bytes), which zipfile would have to pack itself."""
    files, directory = b"", b""
    for name, (crc, size, method, data) in members.items():
        fields = (20, 0x800, method, 0, 0x21, crc, len(data), size, len(name.encode()), 0)
        directory += struct.pack("<4sH5HIIIHH", b"PK\1\2", 20, *fields)
        directory += struct.pack("<HHHII", 0, 0, 0, 0, len(files)) + name.encode()
        files += struct.pack("<4s5HIIIHH", b"PK\3\4", *fields) + name.encode() + data
    count = len(members)
    end = (b"PK\5\6", 0, 0, count, count, len(directory), len(files), 0)
    return files + directory + struct.pack("<4s4HIIH", *end)
