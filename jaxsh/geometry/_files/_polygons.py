"""Hold what the parsers of all formats give: polygons as the file says them, uncleaned."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from .._base_color import BaseColor


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
    materials: tuple[BaseColor, ...] = ()
    found: tuple[str, ...] = ()  # phrases for the one warning: what was ignored, and how often
