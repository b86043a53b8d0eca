"""The picture that a data window leaves of a display window."""

import numpy as np
from jaxtyping import Float


def fit_window(
    pixels: Float[np.ndarray, "h w c"],
    corner: tuple[int, int],
    display: tuple[int, int, int, int],
    fill: bool,
) -> Float[np.ndarray, "rows columns c"]:
    """Cut or fill pixels, the first of which is at `corner`, to a window (y, x, height, width).

    Raises `ValueError` where pixels are missing and are not to be black.
    """
    y, x, height, width = display
    top, left = corner[0] - y, corner[1] - x
    bottom, right = top + pixels.shape[0], left + pixels.shape[1]
    if (top, left, bottom, right) == (0, 0, height, width):
        return pixels
    rows = slice(max(top, 0), min(bottom, height))
    columns = slice(max(left, 0), min(right, width))
    inside = pixels[
        max(-top, 0) : max(-top, 0) + max(rows.stop - rows.start, 0),
        max(-left, 0) : max(-left, 0) + max(columns.stop - columns.start, 0),
    ]
    if inside.shape[:2] == (height, width):
        return inside
    if not inside.size:
        raise ValueError("nothing of the picture is stored: its windows do not overlap")
    if not fill:
        raise ValueError(
            f"only a part of the picture is stored: rows {rows.start} to {rows.stop} of {height}, "
            f"columns {columns.start} to {columns.stop} of {width}; read it with repair=True to "
            "take the rest for black"
        )
    out = np.zeros((height, width, pixels.shape[2]), np.float32)
    out[rows, columns] = inside
    return out
