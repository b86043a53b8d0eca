"""What the parsers of all formats give: polygons as the file says them, before any cleaning."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, UInt8


class FileMaterial(NamedTuple):
    """Holds the base color of a part of the surface: factor times texture, as the file says it."""

    name: str = ""
    factor: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)  # linear RGBA
    texture: UInt8[np.ndarray, "h w 4"] | None = None  # sRGB-encoded, row 0 at v = 1 (the top)
    double_sided: bool = False


class Polygons(NamedTuple):
    """Holds the polygons of a file in file order, in its own axes and units, nothing dropped.

    Polygon i owns the next `sizes[i]` entries of `corners`. What differs from corner to corner
    (normals, UV, colors) is stored per corner, NaN where the file gives none for it; None where it
    gives none at all.
    """

    positions: Float[np.ndarray, "n 3"]  # float64
    corners: Int[np.ndarray, " c"]  # rows of `positions`, all polygons in a row
    sizes: Int[np.ndarray, " p"]  # corners of each polygon, >= 3
    normals: Float[np.ndarray, "c 3"] | None = None
    uv: Float[np.ndarray, "c 2"] | None = None  # v upwards: (0, 0) is the lower left of the picture
    colors: Float[np.ndarray, "c 4"] | None = None  # RGBA in [0, 1], in the encoding of the file
    polygon_material: Int[np.ndarray, " p"] | None = None  # row of `materials`, -1 for none
    materials: tuple[FileMaterial, ...] = ()
    found: tuple[str, ...] = ()  # phrases for the one warning: what was ignored, and how often
