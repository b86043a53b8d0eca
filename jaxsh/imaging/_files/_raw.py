"""File formats that are numbers behind a header: .pfm and .npy."""

import math
import re

import numpy as np
from jaxtyping import Float, Shaped

from ..._core.npy import npy_header

# Width, height and scale in text, then one newline and the floats.
_GAP = rb"(?:\s|#[^\n]*\n)+"  # comments are not in the format, and are in files
_PFM = re.compile(
    rb"P(F4|F|f)%b(\d{1,9})%b(\d{1,9})%b([-+.\deE]{1,32})[ \t\r]*\n" % (_GAP, _GAP, _GAP)
)
_CHANNELS = {b"F": 3, b"f": 1, b"F4": 4}


def read_pfm(data: bytes) -> Float[np.ndarray, "h w c"]:
    """Read a portable float map, color (PF, PF4) or gray (Pf), its rows turned to run downwards.

    Alpha is left out. The sign of the header's scale gives the order of bytes; its size is a unit
    and is not applied.
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
    shape = (int(height), int(width), _CHANNELS[kind])
    numbers = _numbers(data[header.end() :], np.dtype("<f4" if scale < 0 else ">f4"), shape)
    return numbers.reshape(shape)[::-1, :, :3]


def read_npy(data: bytes) -> Shaped[np.ndarray, "h w c"]:
    """Read a NumPy file of float16, 32 or 64, uint8 or uint16, with shape (h, w, 3) or (h, w)."""
    shape, by_columns, dtype, place = npy_header(data)
    if dtype.itemsize > {"f": 8, "u": 2}.get(dtype.kind, 0):
        raise ValueError(f"needs float16, float32, float64, uint8 or uint16, got {dtype}")
    if len(shape) not in (2, 3) or (len(shape) == 3 and shape[2] not in (1, 3)):
        first = len(shape) == 3 and shape[0] in (1, 3)
        hint = ": channels come last, see numpy.moveaxis" if first else ""
        raise ValueError(f"needs shape (h, w, 3) or (h, w), got {shape}{hint}")
    numbers = _numbers(data[place:], dtype, shape)
    pixels = numbers.reshape(shape, order="F" if by_columns else "C")
    return pixels if len(shape) == 3 else pixels[..., None]


def _numbers(body: bytes, dtype: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    size = math.prod(shape) * dtype.itemsize
    if min(shape) < 1:
        raise ValueError(f"a picture needs pixels, got shape {shape}")
    # A line end or many zeros are padding. Anything else behind them says that the shape is wrong
    # or that bytes too many stand before it: the last of a number often is zero.
    padding = body[size:]
    padded = padding in (b"", b"\n", b"\r\n") or (len(padding) >= 16 and not padding.strip(b"\0"))
    if len(body) < size or not padded:
        raise ValueError(f"damaged: shape {shape} takes {size} bytes, but {len(body)} are there")
    return np.frombuffer(body[:size], dtype)
