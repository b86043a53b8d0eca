"""Pictures turned upright."""

import numpy as np
from jaxtyping import Shaped

# EXIF's orientation: what the first row and the first column of the file show.
_EXIF = {1: "-Y +X", 2: "-Y -X", 3: "+Y -X", 4: "+Y +X", 5: "+X -Y", 6: "-X -Y", 7: "-X +Y"}
_EXIF[8] = "+X +Y"


def upright(pixels: Shaped[np.ndarray, "a b c"], order: str) -> Shaped[np.ndarray, "h w c"]:
    """Turn a picture so that rows run downwards and columns to the right.

    `order` is Radiance's: the axis along which the file's rows follow each other and the one along
    which a row runs, each with the sign of its direction, +Y upwards and +X to the right.
    """
    rows, columns = order.split()
    if rows[1] == "X":
        pixels, rows, columns = pixels.swapaxes(0, 1), columns, rows
    pixels = pixels[::-1] if rows == "+Y" else pixels
    return pixels[:, ::-1] if columns == "-X" else pixels


def order_of_exif(orientation: int) -> str:
    """Translate EXIF's and TIFF's orientation, 1 to 8; what is not one of them is taken for 1."""
    return _EXIF.get(orientation, _EXIF[1])
