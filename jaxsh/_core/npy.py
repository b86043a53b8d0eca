"""Read NumPy's file formats, at no more memory than a file can mean."""

import io
import math
import sys
import warnings
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .words import reason

_ROOM = 1 << 26  # bytes that a small archive may unpack to


class NpyHeader(NamedTuple):
    """Holds what the header of a .npy file says, and where its numbers start."""

    shape: tuple[int, ...]
    by_columns: bool
    dtype: np.dtype
    place: int


def npy_header(data: bytes) -> NpyHeader:
    """Read the header of a .npy file; raises `ValueError` for a damaged one."""
    stream = io.BytesIO(data)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of headers that Python 2 wrote
            version = np.lib.format.read_magic(stream)
            if version == (1, 0):
                shape, by_columns, dtype = np.lib.format.read_array_header_1_0(stream)
            else:
                shape, by_columns, dtype = np.lib.format.read_array_header_2_0(stream)
    except Exception as error:  # the header is Python text, and its parser may raise anything
        raise ValueError(f"damaged or not a .npy file: {reason(error)}") from error
    # True and -1 are whole numbers in Python text.
    if any(type(n) is not int or n < 0 for n in shape):
        raise ValueError(f"damaged: its shape is {reason(str(shape))}")
    return NpyHeader(shape, by_columns, dtype, stream.tell())


def from_npy(data: bytes) -> np.ndarray:
    """Give the array of a .npy file, read-only; its numbers may be in either order of bytes.

    Raises `ValueError` for a damaged header, for objects, and where the numbers are not as many as
    the shape says: NumPy itself asks for the memory first, and ignores what follows.
    """
    header = npy_header(data)
    if header.dtype.hasobject:
        raise ValueError("it holds Python objects, not numbers")
    count, body = math.prod(header.shape), memoryview(data)[header.place :]
    size = count * header.dtype.itemsize
    if len(body) != size:
        raise ValueError(
            f"damaged: shape {reason(str(header.shape))} takes {size} bytes, but {len(body)} are "
            "there"
        )
    numbers = np.frombuffer(body, header.dtype) if size else np.empty(count, header.dtype)
    return numbers.reshape(header.shape, order="F" if header.by_columns else "C")


def npz_names(path: Path) -> list[str]:
    """List the arrays of an .npz file; raises `ValueError` where it is no archive."""
    if not zipfile.is_zipfile(path):
        raise ValueError("not an archive, or a truncated one")
    with zipfile.ZipFile(path) as archive:
        return [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]


def from_npz(path: Path, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Give those arrays of an .npz file that are there.

    A damaged archive may raise anything. Raises `ValueError` for one that announces more than its
    bytes can mean.
    """
    with zipfile.ZipFile(path) as archive:
        members = set(archive.namelist())
        stored = {name: f"{name}.npy" for name in names if f"{name}.npy" in members}
        entries = [archive.getinfo(file) for file in stored.values()]
        size, held = sum(entry.file_size for entry in entries), path.stat().st_size
        # What the directory says is asked for from the memory before anything is read.
        if any(entry.compress_size > held for entry in entries):
            raise ValueError(f"its directory announces more than the {held} bytes that are there")
        if size > 10 * held + _ROOM:
            raise ValueError(f"it unpacks to {size} bytes out of {held}, which is not plausible")
        return {name: from_npy(archive.read(file)) for name, file in stored.items()}


def text_of(array: np.ndarray) -> str:
    """Print an array; raises `ValueError` for text that is none, of which NumPy makes a string.

    Such a string is an error of the interpreter wherever it is looked at.
    """
    if array.dtype.kind == "U" and array.dtype.itemsize:
        codes = np.frombuffer(array.tobytes(), np.dtype("u4").newbyteorder(array.dtype.byteorder))
        if codes.max(initial=0) > sys.maxunicode:
            raise ValueError("its text is none")
    return str(array)
