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


def at_corners(
    values: Float[np.ndarray, "n _"] | None, corners: Int[np.ndarray, " c"]
) -> Float[np.ndarray, "c _"] | None:
    """Give what vertices carry at the corners that name them."""
    if values is None or not len(values):
        return None
    return values[np.clip(corners, 0, len(values) - 1)]  # those outside are refused later


def without_points_and_lines(polygons: Polygons) -> Polygons:
    """Leave out faces of fewer than three corners, and say so."""
    keep = polygons.sizes >= 3
    few = int((~keep).sum())
    if not few:
        return polygons
    at = np.repeat(keep, polygons.sizes)

    def kept(rows: np.ndarray | None, which: np.ndarray) -> np.ndarray | None:
        return None if rows is None else rows[which]

    return polygons._replace(
        corners=polygons.corners[at],
        sizes=polygons.sizes[keep],
        normals=kept(polygons.normals, at),
        uv=kept(polygons.uv, at),
        colors=kept(polygons.colors, at),
        polygon_material=kept(polygons.polygon_material, keep),
        found=(*polygons.found, f"{few} faces of fewer than three corners ignored"),
    )


def unit(vectors: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Give vectors the length 1, NaN where they have no direction."""
    with np.errstate(invalid="ignore", divide="ignore"):
        # First by the largest component: squares of very long or short ones leave the range.
        scaled = vectors / np.abs(vectors).max(axis=-1, keepdims=True)
        scaled /= np.linalg.norm(scaled, axis=-1, keepdims=True)
        # Of length 1 to float32's rounding: kept to the bit.
        near = np.abs(scaled - vectors).max(axis=-1, keepdims=True) < 1e-6
        return np.where(near, vectors, scaled)


def unit_colors(colors: Float[np.ndarray, "n k"]) -> tuple[Float[np.ndarray, "n 4"], str | None]:
    """Give RGBA from three or four values each, and a phrase where they had to be guessed at.

    Whole numbers up to 255 that pass 1 are taken for bytes, others outside of 0 to 1 as they are.
    """
    finite = colors[np.isfinite(colors)]
    least, most = finite.min(initial=0), finite.max(initial=0)
    phrase = None
    if least >= 0 and 1 < most <= 255 and (finite == np.rint(finite)).all():
        colors = colors / 255
        phrase = "colors up to 255 taken for bytes"
    elif least < -1e-6 or most > 1 + 1e-6:
        below = " but for negative ones, which become 0" if least < 0 else ""
        phrase = f"colors from {least:.3g} to {most:.3g} taken as they are{below}"
    if colors.shape[1] == 3:
        colors = np.concatenate([colors, np.ones((len(colors), 1))], axis=1)
    return colors, phrase
