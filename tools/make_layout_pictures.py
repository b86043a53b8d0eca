"""Draws what each layout and orientation of a light probe looks like: docs/images/layouts_*.png.

`PYTHONPATH=tests/imaging python tools/make_layout_pictures.py` in the checkout. The world is a cube
whose walls are named by our axes, seen from its center. The pictures are painted by the tests'
formulas, which do not share code with the package, and read back to see that they agree.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
import painters  # pyright: ignore[reportMissingImports]  # from tests/imaging
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from jaxsh import imaging

OUTPUT = Path(__file__).parents[1] / "docs" / "images"

# Each wall: our axis, up on it for one who looks at it, color, name.
_WALLS = [
    ((1, 0, 0), (0, 0, 1), (0.95, 0.62, 0.60), "+x"),
    ((-1, 0, 0), (0, 0, 1), (0.62, 0.85, 0.86), "−x"),
    ((0, 1, 0), (0, 0, 1), (0.66, 0.87, 0.64), "+y"),
    ((0, -1, 0), (0, 0, 1), (0.88, 0.70, 0.90), "−y"),
    ((0, 0, 1), (1, 0, 0), (0.66, 0.75, 0.97), "+z"),
    ((0, 0, -1), (-1, 0, 0), (0.95, 0.88, 0.60), "−z"),
]
_WALL = 256  # pixels along a wall's side
# Figures: file, and rows of pictures (layout, orientation, rows of a picture or of a face).
_FIGURES = {
    "layouts_lat_long.png": [
        [("lat-long", o, 160) for o in ("jaxsh", "debevec", "blender")],
        [("lat-long", o, 160) for o in ("mitsuba", "openexr", "nvdiffrec")],
    ],
    "layouts_probes.png": [
        [("angular-map", "jaxsh", 256), ("angular-map", "-z", 256), ("angular-map", "+z", 256)],
        [("horizontal-cross", "jaxsh", 96), ("vertical-cross", "jaxsh", 96)],
    ],
    "layouts_cubes.png": [[("cube", o, 96) for o in ("jaxsh", "opengl", "direct3d", "openexr")]],
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=OUTPUT)
    output = parser.parse_args().output
    walls = np.stack([wall(color, name) for _, _, color, name in _WALLS])
    for name, rows in _FIGURES.items():
        for row in rows:
            for layout, orientation, size in row:
                check(walls, layout, orientation, size)
        draw(walls, rows).savefig(output / name, dpi=100)
        print(f"{name}: {(output / name).stat().st_size:,} bytes")


def wall(color: tuple[float, float, float], name: str) -> np.ndarray:
    """Paint a wall: its color, a frame, and its name, right side up."""
    figure = Figure((_WALL / 100, _WALL / 100), dpi=100, facecolor=color)
    figure.text(0.5, 0.46, name, size=60, ha="center", va="center")
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[..., :3] / 255
    frame = np.ones((_WALL, _WALL), bool)
    frame[4:-4, 4:-4] = False
    return np.where(frame[..., None], 0.35, pixels)


def world(walls: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Look at the walls along directions; white where there is no direction."""
    shown = np.ones(directions.shape)
    towards = np.stack([directions @ axis for axis, *_ in _WALLS], axis=-1)
    nearest = np.where(np.isnan(towards[..., 0]), -1, towards.argmax(axis=-1))
    for i, (axis, up, *_) in enumerate(_WALLS):
        here = nearest == i
        seen = directions[here] / (directions[here] @ axis)[:, None]
        u, v = seen @ np.cross(axis, up), -(seen @ np.array(up))
        column, row = (np.clip((p + 1) / 2 * _WALL, 0, _WALL - 1).astype(int) for p in (u, v))
        shown[here] = walls[i, row, column]
    return shown


def check(walls: np.ndarray, layout: str, orientation: str, size: int) -> None:
    """Read the picture back and compare it with the world in our own orientation."""
    picture = world(walls, painters.PAINTERS[layout, orientation](size))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.npy"
        np.save(path, picture)
        read = imaging.read_environment(path, layout=layout, orientation=orientation, height=160)
    expected = world(walls, painters.jaxsh_lat_long(160))
    error = np.abs(np.asarray(read) - expected).mean()
    # Blurred edges give up to 0.019; two walls exchanged at least 0.025, a mirrored world 0.10.
    if error > 0.02:
        raise SystemExit(f"{layout}, {orientation}: read back with a mean error of {error:.3f}")


def draw(walls: np.ndarray, rows: list[list[tuple[str, str, int]]]) -> Figure:
    pictures = [
        [
            (layout, orientation, world(walls, painters.PAINTERS[layout, orientation](size)))
            for layout, orientation, size in row
        ]
        for row in rows
    ]
    widest = max(sum(p.shape[1] + 24 for _, _, p in row) for row in pictures)
    heights = [max(p.shape[0] for _, _, p in row) + 40 for row in pictures]
    figure = Figure((widest / 100, sum(heights) / 100), dpi=100, facecolor="white")
    top = 0
    for row, height in zip(pictures, heights, strict=True):
        left = 12
        for layout, orientation, picture in row:
            rows_, columns, _ = picture.shape
            y = sum(heights) - top - 28 - rows_
            axes = figure.add_axes(
                (left / widest, y / sum(heights), columns / widest, rows_ / sum(heights))
            )
            axes.imshow(picture, interpolation="nearest")
            axes.set_axis_off()
            label = f'"{orientation}"' if layout in ("lat-long", "cube") else layout
            if layout == "angular-map":
                label = f'{layout}, "{orientation}"'
            figure.text(
                (left + columns / 2) / widest,
                1 - (top + 14) / sum(heights),
                label,
                size=9,
                ha="center",
                va="center",
            )
            left += columns + 24
        top += height
    return figure


if __name__ == "__main__":
    main()
