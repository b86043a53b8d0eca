"""File formats read byte by byte: .pfm and .npy, and where the pixels of an .hdr file end."""

import io
import math
import re

import numpy as np
from jaxtyping import Float, Shaped

# Width, height and scale in text, then one newline and the floats.
_PFM = re.compile(rb"P([Ff])\s+(\d{1,9})\s+(\d{1,9})\s+([-+.\deE]{1,32})[ \t\r]*\n")


def read_pfm(data: bytes) -> Float[np.ndarray, "h w c"]:
    """Read a portable float map, color (PF) or gray (Pf), its rows turned to run downwards.

    The sign of the header's scale gives the order of bytes; its size is a unit and is not applied.
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
    """Read a NumPy file of float16, 32 or 64 with shape (h, w, 3) or (h, w)."""
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


def check_length(data: bytes, height: int, width: int) -> None:
    """Refuse an .hdr file that goes on after its last pixel, as one does whose height is wrong.

    Decoders stop after the rows that the header announces, whatever follows. `data` is a file that
    one has read to its end without complaint.
    """
    try:
        place = data.index(b"\n", data.index(b"\n\n") + 2) + 1  # after the header and the size
        for _ in range(height):
            place = _after_row(data, place, width)
    except (IndexError, ValueError) as error:
        raise ValueError("damaged: its header or its rows do not end where they should") from error
    if place != len(data):
        raise ValueError(f"damaged: {width} × {height} pixels end at byte {place} of {len(data)}")


def _after_row(data: bytes, place: int, width: int) -> int:
    start = data[place : place + 4]
    coded = 8 <= width <= 0x7FFF and start[:2] == b"\2\2" and start[2] < 128
    if not coded:
        return place + 4 * width
    place += 4
    for _ in range(4):  # red, green, blue and exponent, each in runs and literals
        column = 0
        while column < width:
            count = data[place]
            run = count > 128
            column += count - 128 if run else count
            place += 2 if run else count + 1
    return place
