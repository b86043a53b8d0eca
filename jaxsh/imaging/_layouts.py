"""Pictures of the whole sphere: their shapes, their used pixels, and where a direction is seen.

Each layout becomes tiles with a border of one pixel, so that bilinear look-up needs no cases, and
a function from directions to places on them. Directions are along the picture's own axes: to its
right, up, and towards its center; for the cube, the x, y and z of its face table.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

# (rows, columns) in units of the picture's cell, and the shape in words.
_SHAPES = {
    "lat-long": ((1, 2), "twice as wide as high"),
    "angular-map": ((1, 1), "as wide as high"),
    "horizontal-cross": ((3, 4), "four cells wide and three high"),
    "vertical-cross": ((4, 3), "three cells wide and four high"),
    "cube": ((6, 1), "six square faces, one below the other"),
}
_SLACK = 0.01
# (row, column) of the faces +x, -x, +y, -y, +z, -z, with +z in the middle of the cross.
_CELLS = {
    "horizontal-cross": ((1, 2), (1, 0), (0, 1), (2, 1), (1, 1), (1, 3)),
    "vertical-cross": ((1, 2), (1, 0), (0, 1), (2, 1), (1, 1), (3, 1)),
    "cube": ((0, 0), (1, 0), (2, 0), (3, 0), (4, 0), (5, 0)),
}
# The faces' outward axis and the directions of u (to the right) and v (down) on them, as in
# `sphere.cube_map`.
_FACES = np.array(
    [
        [(1, 0, 0), (0, 0, -1), (0, -1, 0)],
        [(-1, 0, 0), (0, 0, 1), (0, -1, 0)],
        [(0, 1, 0), (1, 0, 0), (0, 0, 1)],
        [(0, -1, 0), (1, 0, 0), (0, 0, -1)],
        [(0, 0, 1), (1, 0, 0), (0, -1, 0)],
        [(0, 0, -1), (-1, 0, 0), (0, -1, 0)],
    ],
    np.float32,
)

Places = tuple[Int[np.ndarray, " n"], Float[np.ndarray, " n"], Float[np.ndarray, " n"]]


class Tiles(NamedTuple):
    """Holds a picture of the sphere, ready to be looked up."""

    pixels: Float[np.ndarray, "tiles h w 3"]  # with a border of one pixel
    around: int  # pixels on a great circle
    # x, y, z of directions of any length -> tile, row and column, 0 at the first pixel's center
    locate: Callable[[np.ndarray, np.ndarray, np.ndarray], Places]


def face_directions(size: int) -> Float[np.ndarray, "6 size size 3"]:
    """Locate the pixels of six faces, along x, y and z of their table, at any length."""
    at = ((2 * np.arange(size) + 1) / size - 1)[:, None]
    along, right, down = _FACES.swapaxes(0, 1)[:, :, None, None].astype(np.float64)
    return along + at * right + at[:, None] * down


def check_shape(layout: str, height: int, width: int) -> None:
    """Refuse a picture that cannot be of that layout, and name the layout that it could be."""
    if _fits(layout, height, width):
        return
    others = [other for other in _SHAPES if _fits(other, height, width)]
    hint = f"; it has the shape of layout {others[0]!r}" if others else ""
    article = "an" if layout[0] == "a" else "a"
    raise ValueError(
        f"{article} {layout} picture is {_SHAPES[layout][1]}, not {width} × {height}{hint}"
    )


def used_pixels(layout: str, height: int, width: int) -> np.ndarray:
    """Mark the pixels used: False in a cross's empty cells and outside an angular map's circle."""
    if layout == "lat-long":
        return np.ones((height, width), bool)
    if layout == "angular-map":
        return _radius(height) <= 1
    used = np.zeros((height, width), bool)
    for cell in _cells(layout, height):
        used[cell] = True
    return used


def tiles(layout: str, image: Float[np.ndarray, "h w 3"], at_edges: bool = False) -> Tiles:
    """Cut the picture of a layout into tiles; pixels that are not used are not looked at.

    With `at_edges`, for "lat-long" and "cube", the outermost pixels are centered on the edges,
    and the cube's last two faces are -z and +z of the table.
    """
    if layout == "lat-long":
        return _lat_long_to_the_edge(image) if at_edges else _lat_long(image)
    if layout == "angular-map":
        return _angular_map(image)
    faces = np.stack([image[cell] for cell in _cells(layout, len(image))])
    if at_edges:
        return _cube_to_the_edge(faces[[0, 1, 2, 3, 5, 4]])
    if layout == "vertical-cross":
        faces[5] = faces[5, ::-1, ::-1]  # it goes on downwards, over the bottom to the back
    return _cube(faces)


def _fits(layout: str, height: int, width: int) -> bool:
    if layout == "lat-long":  # a column too many or few makes its pixels no square, and no harm
        return abs(width - 2 * height) <= _SLACK * width
    rows, columns = _SHAPES[layout][0]
    return height % rows == 0 and height * columns == width * rows


def _cells(layout: str, height: int) -> list[tuple[slice, slice]]:
    n = height // _SHAPES[layout][0][0]
    return [
        (slice(row * n, row * n + n), slice(column * n, column * n + n))
        for row, column in _CELLS[layout]
    ]


def _lat_long(image: np.ndarray) -> Tiles:
    height, width, _ = image.shape
    # Beyond the edge so much that half-way, on the pole, all columns meet in their mean.
    top, bottom = (2 * row.mean(axis=1, keepdims=True) - row for row in (image[:1], image[-1:]))
    rows = np.concatenate([top, image, bottom])
    pixels = np.concatenate([rows[:, -1:], rows, rows[:, :1]], axis=1)

    def locate(x, y, z):
        column = (np.arctan2(x, z) / (2 * np.pi) + 0.5) * width - 0.5
        row = np.arctan2(np.hypot(x, z), y) / np.pi * height - 0.5
        return np.zeros(len(x), np.int32), row, column

    return Tiles(pixels[None], width, locate)


def _lat_long_to_the_edge(image: np.ndarray) -> Tiles:
    """The first and last row are the poles, the first and last column one meridian."""
    height, width, _ = image.shape

    def locate(x, y, z):
        column = (np.arctan2(x, z) / (2 * np.pi) + 0.5) * (width - 1)
        row = np.arctan2(np.hypot(x, z), y) / np.pi * (height - 1)
        return np.zeros(len(x), np.int32), row, column

    pixels = np.pad(image, ((1, 1), (1, 1), (0, 0)), "edge")
    return Tiles(pixels[None], width, locate)


def _radius(size: int) -> np.ndarray:
    """Compute the radius of each pixel center in an angular map, 1 on its circle."""
    center = (2 * np.arange(size) + 1) / size - 1
    return np.hypot(center[:, None], center)


def _angular_map(image: np.ndarray) -> Tiles:
    """Debevec's light probe: at radius acos(z)/π from the center, z along the forward axis."""
    size = len(image)
    # The whole circle is one direction, straight back: what lies outside is taken from inside,
    # a pixel's half diagonal from the circle.
    center = (2 * np.arange(-1, size + 1) + 1) / size - 1
    radius = np.hypot(center[:, None], center)
    inwards = np.where(radius > 1, max(0.0, 1 - np.sqrt(2) / size) / np.maximum(radius, 1), 1)
    row, column = (
        np.clip(np.floor((p * inwards + 1) / 2 * size), 0, size - 1).astype(int)
        for p in (center[:, None], center)
    )
    pixels = image[row, column]

    def locate(x, y, z):
        aside = np.hypot(x, y)
        r = np.arctan2(aside, z) / np.pi
        aside = np.maximum(aside, np.finfo(aside.dtype).tiny)
        column = (1 + x / aside * r) / 2 * size - 0.5
        row = (1 - y / aside * r) / 2 * size - 0.5
        return np.zeros(len(x), np.int32), row, column

    return Tiles(pixels[None], size, locate)


def _cube(faces: Float[np.ndarray, "6 n n 3"]) -> Tiles:
    n = faces.shape[1]

    def locate(x, y, z):
        tile, v, u = _on_cube(x, y, z)
        return tile, (v + 1) / 2 * n - 0.5, (u + 1) / 2 * n - 0.5

    # The border of a face is what its neighbors show there.
    center = ((2 * np.arange(-1, n + 1) + 1) / n - 1).astype(np.float32)
    v, u = (grid.ravel() for grid in np.meshgrid(center, center, indexing="ij"))
    border = np.maximum(np.abs(u), np.abs(v)) > 1
    pixels = np.pad(faces, ((0, 0), (1, 1), (1, 1), (0, 0)))
    for face, (along, right, down) in enumerate(_FACES):
        directions = along + u[border, None] * right + v[border, None] * down
        tile, row, column = locate(*directions.T)
        row, column = (np.clip(np.rint(p), 0, n - 1).astype(int) for p in (row, column))
        pixels[face].reshape(-1, 3)[border] = faces[tile, row, column]
    return Tiles(pixels, 4 * n, locate)


def _cube_to_the_edge(faces: Float[np.ndarray, "6 n n 3"]) -> Tiles:
    n = faces.shape[1]

    def locate(x, y, z):
        tile, v, u = _on_cube(x, y, z)
        return tile, (v + 1) / 2 * (n - 1), (u + 1) / 2 * (n - 1)

    pixels = np.pad(faces, ((0, 0), (1, 1), (1, 1), (0, 0)), "edge")
    return Tiles(pixels, 4 * n, locate)


def _on_cube(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> Places:
    """The face that a direction meets, and where on it, v down and u to the right in [-1, 1]."""
    side = np.argmax(np.abs([x, y, z]), axis=0)
    along = np.choose(side, (x, y, z))
    size, behind = np.abs(along), along < 0
    sign = np.where(behind, np.float32(-1), np.float32(1))
    u = np.choose(side, (-z * sign, x, x * sign)) / size
    v = np.choose(side, (-y, z * sign, -y)) / size
    return 2 * side + behind, v, u
