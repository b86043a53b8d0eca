"""Read NumPy's file format from memory, at no more memory than the file has."""

import io
import math
import warnings

import numpy as np

from .words import reason


def from_npy(data: bytes) -> np.ndarray:
    """Give the array of a .npy file, read-only; its numbers may be in either order of bytes.

    Raises `ValueError` for a damaged header, for objects, and where the numbers are not as many as
    the shape says: NumPy itself asks for the memory first, and ignores what follows.
    """
    stream = io.BytesIO(data)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of headers that Python 2 wrote
            version = np.lib.format.read_magic(stream)
            read = {
                (1, 0): np.lib.format.read_array_header_1_0,
                (2, 0): np.lib.format.read_array_header_2_0,
            }
            if version not in read:
                raise ValueError(f"version {version[0]}.{version[1]} is not read")
            shape, by_columns, dtype = read[version](stream)
    except Exception as error:  # the header is Python text, and its parser may raise anything
        raise ValueError(f"damaged or not a .npy file: {reason(error)}") from error
    if dtype.hasobject:
        raise ValueError("it holds Python objects, not numbers")
    body = memoryview(data)[stream.tell() :]
    size = math.prod(shape) * dtype.itemsize
    # A header is Python text: True and -1 are numbers there.
    if any(type(n) is not int or n < 0 for n in shape) or len(body) != size:
        raise ValueError(f"damaged: shape {shape} takes {size} bytes, but {len(body)} are there")
    numbers = np.frombuffer(body, dtype) if size else np.empty(math.prod(shape), dtype)
    return numbers.reshape(shape, order="F" if by_columns else "C")
