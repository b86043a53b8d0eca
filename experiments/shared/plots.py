"""Pictures and plots: views of a mesh, panels side by side, animations, logarithmic axes."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib

matplotlib.use("Agg")  # all pictures go to files
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Array, Float
from matplotlib.animation import PillowWriter
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import (
    FixedLocator,
    LogLocator,
    NullFormatter,
    NullLocator,
    StrMethodFormatter,
)

from jaxsh import geometry, imaging

_DPI = 100
GROUND = 0.0108  # around panels and behind objects, in exposed radiance

Rows = Sequence[Mapping[str, Any]]
Behind = float | Float[Array, "h w 3"]


class Panel(NamedTuple):
    """A picture, encoded for a screen, and the line above it."""

    image: Float[np.ndarray, "h w 3"]
    title: str = ""


class View(NamedTuple):
    """A mesh as a camera sees it, and the exposure at which it is shown."""

    mesh: geometry.Mesh
    raster: imaging.Raster
    exposure: float = 1.0

    @classmethod
    def of(
        cls,
        mesh: geometry.Mesh,
        camera: imaging.Camera,
        reference: Float[Array, "v 3"],
        *,
        samples: int = 1,
    ) -> "View":
        """Exposed so that the 99th percentile of the object's pixels under the reference is 1."""
        raster = imaging.rasterize(mesh, camera, samples=samples)
        seen = imaging.interpolate(raster, reference)
        return cls(mesh, raster, float(imaging.auto_exposure(seen, raster.mask)))

    def render(self, values: Float[Array, "v 3"], behind: Behind = 0.0) -> Float[Array, "h w 3"]:
        """Exposed radiance of the pixels, linear, before what is behind."""
        return imaging.interpolate(self.raster, self.exposure * values, behind)

    def shown(
        self, values: Float[Array, "v 3"], behind: Behind = GROUND
    ) -> Float[np.ndarray, "h w 3"]:
        return np.asarray(imaging.tone_map(self.render(values, behind)))

    def difference(
        self, values: Float[Array, "v 3"], reference: Float[Array, "v 3"], gain: float
    ) -> Float[np.ndarray, "h w 3"]:
        """The absolute difference, times `gain`, before black."""
        apart = jnp.abs(self.render(values) - self.render(reference))
        return np.asarray(imaging.tone_map(apart, gain))

    def psnr(
        self, values: Float[Array, "v 3"], reference: Float[Array, "v 3"]
    ) -> tuple[float, float]:
        """Of the object's pixels and of the whole picture; exposed, linear, clipped at the peak."""
        ours, exact = (jnp.clip(self.render(light), 0, 1) for light in (values, reference))
        of_object = imaging.psnr(ours, exact, self.raster.mask)
        return float(of_object), float(imaging.psnr(ours, exact))


def draw_panels(
    path: Path, rows: Sequence[Sequence[Panel]], *, ground: float = GROUND, letters: str = "white"
) -> None:
    """Draw panels of one size, pixel by pixel, each with its title above it."""
    height, width, _ = rows[0][0].image.shape
    columns = max(len(row) for row in rows)
    gap = max(3, width // 60)
    letter = max(11.0, 0.045 * width)  # height of the letters, in pixels
    above = [round(2.2 * letter) if any(panel.title for panel in row) else gap for row in rows]
    whole = columns * (width + gap) + gap, sum(above) + len(rows) * height + gap
    figure = plt.figure(figsize=(whole[0] / _DPI, whole[1] / _DPI), dpi=_DPI)
    figure.set_facecolor(str(float(imaging.srgb_encode(jnp.asarray(ground)))))  # a grey
    for i, row in enumerate(rows):
        for j, panel in enumerate(row):
            left, top = gap + j * (width + gap), sum(above[: i + 1]) + i * height
            figure.figimage(panel.image, left, whole[1] - top - height, origin="upper")
            at = (left + width / 2) / whole[0], 1 - (top - above[i] / 2) / whole[1]
            _title(figure, at, panel.title, letter, letters)
    save(figure, path)


def animate(path: Path, frames: Sequence[Sequence[Panel]]) -> None:
    """Write a GIF: in each frame panels side by side, their titles above them."""
    strips = [np.concatenate([panel.image for panel in frame], axis=1) for frame in frames]
    (height, width, _), count = strips[0].shape, len(frames[0])
    above = max(14, round(0.09 * height))
    figure = plt.figure(figsize=(width / _DPI, (height + above) / _DPI), dpi=_DPI)
    figure.set_facecolor("0.1")
    shown = figure.figimage(strips[0], 0, 0, origin="upper")
    middle = 1 - above / 2 / (height + above)
    places = [((j + 0.5) / count, middle) for j in range(count)]
    titles = [_title(figure, at, "", 0.5 * above, "white") for at in places]
    writer = PillowWriter(fps=10)
    with writer.saving(figure, str(path), _DPI):
        for frame, strip in zip(frames, strips, strict=True):
            shown.set_data(strip)
            for title, panel in zip(titles, frame, strict=True):
                title.set_text(panel.title)
            writer.grab_frame(facecolor=figure.get_facecolor())
    plt.close(figure)


def _title(figure: Figure, at: tuple[float, float], text: str, pixels: float, color: str) -> Text:
    size = pixels * 72 / _DPI
    return figure.text(*at, text, ha="center", va="center", color=color, fontsize=size)


def save(figure: Figure, path: Path, dpi: int = _DPI) -> None:
    """Write the figure and forget it."""
    figure.savefig(path, dpi=dpi, facecolor=figure.get_facecolor())
    plt.close(figure)


def plain_numbers(axis: Axis) -> None:
    """Label a logarithmic axis with plain numbers at 1, 2 and 5."""
    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def logarithmic(axes: Axes, values: Sequence[float]) -> None:
    """Make the x axis logarithmic, with ticks at these values and no others."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(FixedLocator(values))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_locator(NullLocator())


def curve(rows: Rows, x: str, y: str, **wanted: Any) -> tuple[list[Any], list[Any]]:
    """Take x and y from the rows whose other keys are as wanted."""
    found = [row for row in rows if all(row.get(key) == value for key, value in wanted.items())]
    return [row[x] for row in found], [row[y] for row in found]
