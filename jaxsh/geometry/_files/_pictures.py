"""Read pictures that a mesh file names, from beside it."""

import io
import warnings
from pathlib import Path, PurePosixPath

import numpy as np
from jaxtyping import UInt8

from ..._core.words import reason
from ._gltf_pictures import as_rgba

# A byte seldom gives more than ten pixels; more are for plain pictures of moderate size.
_PLAIN, _PER_BYTE = 22_000_000, 16


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
    from PIL import Image

    place = beside(path, name)
    if place is None:
        found.append(f"the picture {name!r} is not there")
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of large pictures: their size is checked here
            data = place.read_bytes()
            image = Image.open(io.BytesIO(data))
            width, height = image.size
            if width * height > _PLAIN + _PER_BYTE * len(data):
                raise ValueError(
                    f"{width} × {height} pixels are out of proportion to {len(data)} bytes"
                )
            image.load()
            return as_rgba(image)
    except Exception as error:  # decoders may raise anything where a picture is damaged
        found.append(f"the picture {name!r} cannot be read ({reason(error)})")
        return None
