"""Picture files: every pixel of R, G and B in linear floats, or none."""

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ._raw import check_length, read_npy, read_pfm

FORMATS = (".exr", ".hdr", ".pfm", ".npy")
# The best that the compression of these formats can do is some hundred numbers in a byte.
_MAX_NUMBERS_PER_BYTE = 2048
_MAX_PIXELS = 1 << 28  # 3 GB of them


def read_pixels(path: Path) -> Float[np.ndarray, "h w 3"]:
    """Read float32 pixels as stored, row 0 on top. Raises `ValueError` for an incomplete picture.

    The error does not name the file; that is for the caller, as is a missing file.
    """
    suffix = path.suffix.lower()
    try:
        if suffix in (".pfm", ".npy"):
            pixels = (read_pfm if suffix == ".pfm" else read_npy)(path.read_bytes())
            # What float32 cannot hold becomes infinite, and is met as such.
            with np.errstate(over="ignore"):
                pixels = pixels.astype(np.float32)
            return np.broadcast_to(pixels, (*pixels.shape[:2], 3))
        pixels = _decode(path)
        if suffix == ".hdr":
            check_length(path.read_bytes(), *pixels.shape[:2])
        return pixels
    except UnicodeDecodeError as error:  # names in the header, or the complaint about them
        raise ValueError("damaged: its header is not text") from error
    except MemoryError as error:
        raise ValueError("damaged, or too large for memory") from error


def _decode(path: Path) -> np.ndarray:
    """Decode by OpenImageIO, which may stop halfway and report it later."""
    try:
        import OpenImageIO as oiio
    except ImportError as error:
        raise ImportError(
            f"{path}: reading {path.suffix} needs the package OpenImageIO, which cannot be "
            "imported here; .pfm and .npy are read without it"
        ) from error

    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise ValueError(f"damaged or not a {path.suffix} file: {_first_line(oiio.geterror())}")
    try:
        spec = source.spec()
        _check_form(spec, path.stat().st_size)
        channels = _channels(list(spec.channelnames))
        pixels = source.read_image(0, 0, 0, spec.nchannels, oiio.FLOAT)
        problem = _first_line(source.geterror())
    finally:
        source.close()
    if pixels is None or problem:
        raise ValueError(f"damaged or truncated: {problem or 'no pixels'}")
    return pixels[..., channels]


def _first_line(text: str) -> str:
    return text.strip().split("\n")[0]


def _check_form(spec: Any, size: int) -> None:
    pixels = spec.width * spec.height
    # A tile is held whole, however little of it the picture has.
    held = max(pixels, spec.tile_width * spec.tile_height)
    if held * spec.nchannels > _MAX_NUMBERS_PER_BYTE * size:
        raise ValueError(
            f"damaged: {spec.width} × {spec.height} pixels cannot be in a file of {size} bytes"
        )
    if held > _MAX_PIXELS:
        raise ValueError(
            f"{spec.width} × {spec.height} pixels are too many: at most {_MAX_PIXELS} are read"
        )
    if spec.deep or spec.depth > 1:
        raise ValueError("deep and volume pictures are not light probes")
    window = (spec.x, spec.y, spec.width, spec.height)
    whole = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    if window != whole:
        raise ValueError(f"only a part of the picture is stored: {window} of {whole}")
    if spec.getattribute("Orientation") not in (None, 1):
        raise ValueError("rows must run downwards and columns to the right")


def _channels(names: list[str]) -> list[int]:
    """Find R, G, B; one gray channel stands for all three."""
    found = {name.upper(): i for i, name in reversed(list(enumerate(names)))}
    if all(c in found for c in "RGB"):
        return [found[c] for c in "RGB"]
    colors = [i for i, name in enumerate(names) if name.upper() not in ("A", "Z")]
    if len(colors) == 1:
        return colors * 3
    raise ValueError(f"needs channels R, G, B or a single one, got {names}")
