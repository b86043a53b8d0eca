"""Decode and encode pictures with Pillow, and find those that a mesh file names."""

import io
import warnings
from pathlib import Path, PurePosixPath

import numpy as np
from jaxtyping import UInt8

from ..._core.words import reason

# A byte seldom gives more than ten pixels; more are for plain pictures of moderate size.
_PLAIN, _PER_BYTE = 22_000_000, 16
_ROWS = 256


class Decoder:
    """Decodes pictures as 8-bit RGBA, no more pixels in all than is in proportion to their bytes.

    `formats` are names of Pillow's, None for all that it reads.
    """

    def __init__(self, formats: tuple[str, ...] | None = None):
        self._formats = formats
        self._pixels = 0

    def decode(self, data: bytes, others: int = 0) -> UInt8[np.ndarray, "h w 4"]:
        """Decode a picture; `others` are the bytes of what else is decoded.

        Raises `ValueError` for too many pixels; Pillow may raise anything where bytes are damaged.
        """
        from PIL import Image

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of large pictures: their size is checked here
            image = Image.open(io.BytesIO(data), formats=self._formats)
            width, height = image.size
            self._pixels += width * height
            if self._pixels > _PLAIN + _PER_BYTE * (len(data) + others):
                raise ValueError(
                    f"{width} × {height} pixels are out of proportion to {len(data)} bytes"
                )
            image.load()
            return as_rgba(image)


def as_rgba(image) -> UInt8[np.ndarray, "h w 4"]:
    """Convert to 8-bit RGBA, some rows at a time to need little memory."""
    width, height = image.size
    pixels = np.empty((height, width, 4), np.uint8)
    for top in range(0, height, _ROWS):
        rows = image.crop((0, top, width, min(top + _ROWS, height)))
        if rows.mode.startswith("I"):  # 16-bit gray, which Pillow would clip
            gray = (np.asarray(rows).astype(np.uint32) + 128) // 257
            pixels[top : top + _ROWS] = np.stack([gray] * 3 + [np.full_like(gray, 255)], axis=2)
        else:
            if rows.mode == "CMYK":
                rows = rows.convert("RGB")
            pixels[top : top + _ROWS] = np.asarray(rows.convert("RGBA"))
    return pixels


def png(picture: UInt8[np.ndarray, "h w 4"]) -> bytes:
    """Give the bytes of an 8-bit PNG, without alpha where that is 255 throughout."""
    from PIL import Image

    opaque = (picture[..., 3] == 255).all()
    out = io.BytesIO()
    Image.fromarray(picture[..., :3] if opaque else picture).save(out, "PNG")
    return out.getvalue()


def beside(path: Path, name: str) -> Path | None:
    """Find a file that another names: by its relative path, else by its last part alone."""
    named = PurePosixPath(name.strip().strip('"').replace("\\", "/"))
    for choice in (path.parent / named, path.parent / named.name):
        try:
            if not (named.is_absolute() and choice == named) and choice.is_file():
                return choice
        except (OSError, ValueError):  # no name of a file
            pass
    return None


def read_picture(path: Path, name: str, found: list[str]) -> UInt8[np.ndarray, "h w 4"] | None:
    """Decode a picture that the file `path` names, as 8-bit RGBA; None, and why, where it fails."""
    place = beside(path, name)
    if place is None:
        found.append(f"the picture {name!r} is not there")
        return None
    try:
        return Decoder().decode(place.read_bytes())
    except Exception as error:  # decoders may raise anything where a picture is damaged
        found.append(f"the picture {name!r} cannot be read ({reason(error)})")
        return None
