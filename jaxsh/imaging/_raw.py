"""Pictures stored as plain floats: .pfm and .npy. Every byte is accounted for."""

import io
import math
import re

import numpy as np
from jaxtyping import Float, Shaped

# Width, height and scale in text, then one newline and the floats.
_PFM = re.compile(rb"P([Ff])\s+(\d{1,9})\s+(\d{1,9})\s+([-+.\deE]{1,32})[ \t\r]*\n")


def read_pfm(data: bytes) -> Float[np.ndarray, "h w c"]:
    """A portable float map, color (PF) or gray (Pf), its rows turned to run downwards.

    The sign of the header's scale says the order of bytes; its size is a unit and is not applied.
    """
    header = _PFM.match(data)
    if header is None:
        raise ValueError("damaged or not a .pfm file: no header of type, size and scale")
    kind, width, height, scale = header.groups()
    try:
        scale = float(scale)
    except ValueError:
        scale = math.nan
    if scale == 0 or not math.isfinite(scale):
        raise ValueError(f"damaged: its scale is {header[4].decode()}, not a number other than 0")
    shape = (int(height), int(width), 3 if kind == b"F" else 1)
    numbers = _numbers(data[header.end() :], np.dtype("<f4" if scale < 0 else ">f4"), shape)
    return numbers.reshape(shape)[::-1]


def read_npy(data: bytes) -> Shaped[np.ndarray, "h w c"]:
    """A NumPy file of float16, 32 or 64 with shape (h, w, 3) or (h, w)."""
    stream = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(stream)
        if version == (1, 0):
            shape, by_columns, dtype = np.lib.format.read_array_header_1_0(stream)
        else:
            shape, by_columns, dtype = np.lib.format.read_array_header_2_0(stream)
    except Exception as error:  # the header is Python text, and its parser may raise anything
        reason = str(error).strip().split("\n")[0]
        raise ValueError(f"damaged or not a .npy file: {reason}") from error
    if dtype.kind != "f" or dtype.itemsize > 8:
        raise ValueError(f"needs float16, float32 or float64, got {dtype}")
    if len(shape) not in (2, 3) or (len(shape) == 3 and shape[2] not in (1, 3)):
        raise ValueError(f"needs shape (h, w, 3) or (h, w), got {shape}")
    numbers = _numbers(data[stream.tell() :], dtype, shape)
    pixels = numbers.reshape(shape, order="F" if by_columns else "C")
    return pixels if len(shape) == 3 else pixels[..., None]


def _numbers(body: bytes, dtype: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    size = math.prod(shape) * dtype.itemsize
    if min(shape) < 1:
        raise ValueError(f"a picture needs pixels, got shape {shape}")
    if len(body) != size:
        raise ValueError(f"damaged: shape {shape} takes {size} bytes, but {len(body)} are there")
    return np.frombuffer(body, dtype)
