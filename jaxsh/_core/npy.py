"""Read NumPy's file format from memory, at no more memory than the file has."""

import io
import math
import warnings
from typing import NamedTuple

import numpy as np

from .words import reason


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
