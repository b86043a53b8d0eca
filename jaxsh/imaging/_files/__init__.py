"""Picture files: one reader a format, each giving upright pixels in linear Rec. 709 floats."""

from pathlib import Path

import numpy as np

from ._color import check_encoding, decoded
from ._openimageio import Picture, read_display, read_exr, refuse_encoding
from ._radiance import read_radiance
from ._raw import read_npy, read_pfm

__all__ = [
    "FORMATS",
    "Picture",
    "check_encoding",
    "decoded",
    "read_picture",
]

_RADIANCE = (".hdr", ".pic", ".rgbe", ".xyze")
_DISPLAY = (".png", ".jpg", ".jpeg", ".tif", ".tiff")
FORMATS = (".exr", *_RADIANCE, ".pfm", ".npy", *_DISPLAY)


def read_picture(path: Path, encoding: str | None, layer: str | None, fill: bool) -> Picture:
    """Read float32 pixels, row 0 on top. Raises `ValueError` for an incomplete picture.

    `fill` takes pixels that a file names but does not hold for black. The error does not name the
    file; that is for the caller, as is a missing file.
    """
    suffix = path.suffix.lower()
    if layer is not None and suffix != ".exr":
        raise ValueError(f"only .exr pictures have layers: layer must be None, got {layer!r}")
    try:
        if suffix in _DISPLAY:
            return read_display(path, encoding)
        if suffix == ".exr":
            refuse_encoding(encoding)
            return read_exr(path, layer, fill)
        if suffix in _RADIANCE:
            refuse_encoding(encoding)
            return Picture(read_radiance(path))
        pixels = (read_npy if suffix == ".npy" else read_pfm)(path.read_bytes())
        if pixels.dtype.kind == "u":
            return Picture(_three(decoded(pixels, encoding)))
        refuse_encoding(encoding)
        # What float32 cannot hold becomes infinite, and is met as such; a NaN may be of any kind.
        with np.errstate(over="ignore", invalid="ignore"):
            return Picture(_three(pixels.astype(np.float32)))
    except UnicodeDecodeError as error:  # names in the header, or the complaint about them
        raise ValueError("damaged: its header is not text") from error
    except MemoryError as error:
        raise ValueError("damaged, or too large for memory") from error


def _three(pixels: np.ndarray) -> np.ndarray:
    return np.broadcast_to(pixels, (*pixels.shape[:2], 3))
