"""Pictures and plots: views of a mesh, panels side by side, animations, logarithmic axes."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import matplotlib

matplotlib.use("Agg")  # all pictures go to files
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from cycler import cycler
from jaxtyping import Array, ArrayLike, Float
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.image import FigureImage
from matplotlib.text import Text
from matplotlib.ticker import (
    FixedLocator,
    LogLocator,
    MaxNLocator,
    NullFormatter,
    NullLocator,
    StrMethodFormatter,
)

from jaxsh import geometry, imaging

# Told apart without red and green (Okabe and Ito, 2008, and three more).
plt.rcParams["axes.prop_cycle"] = cycler(
    color=[
        *("#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7"),
        *("#7a4b1e", "#56b4e9", "#808080", "#b3a200", "#000000"),
    ]
)

_DPI = 100
GROUND = 0.0108  # around panels and behind objects, in exposed radiance

_RELIEF = 0.25  # how much darker a false color is where the surface is seen edge on

Rows = Sequence[Mapping[str, Any]]
Behind = float | Float[Array, "h w 3"]
Color = tuple[float, float, float]


def camera_on(points: Float[ArrayLike, "n 3"], **options: Any) -> imaging.Camera:
    """Place a camera that sees all points; `options` are those of `imaging.Camera.facing`."""
    points = jnp.asarray(points)
    each = jnp.repeat(jnp.arange(len(points), dtype=jnp.int32)[:, None], 3, axis=1)
    return imaging.Camera.facing(geometry.Mesh(points, each, jnp.zeros_like(points)), **options)


class Bar(NamedTuple):
    """What the colors of a panel mean, told below it: a range of numbers, or names."""

    label: str
    colors: str | Mapping[str, Color]
    limits: tuple[float, float] = (0.0, 1.0)
    extend: Literal["neither", "max", "both"] = "neither"

    @classmethod
    def signed(cls, label: str, limit: float, *, extend: bool = False) -> "Bar":
        """Blue below zero, red above, full at ± limit."""
        return cls(label, "RdBu_r", (-limit, limit), "both" if extend else "neither")

    def paint(self, values: Float[ArrayLike, "*shape"]) -> Float[np.ndarray, "*shape 3"]:
        """Colors of numbers, as a screen has them."""
        assert isinstance(self.colors, str)
        low, high = self.limits
        return plt.get_cmap(self.colors)((np.asarray(values) - low) / (high - low))[..., :3]


class Panel(NamedTuple):
    """A picture, encoded for a screen, the line above it, and what its colors mean."""

    image: Float[np.ndarray, "h w 3"]
    title: str = ""
    bar: Bar | None = None


class View(NamedTuple):
    """A mesh as a camera sees it, and the exposure at which it is shown."""

    mesh: geometry.Mesh
    raster: imaging.Raster
    facing: Float[Array, " v"]  # cosine between normal and viewer
    exposure: float = 1.0

    @classmethod
    def by(cls, mesh: geometry.Mesh, camera: imaging.Camera, *, samples: int = 1) -> "View":
        towards = camera.position[None].astype(mesh.vertices.dtype) - mesh.vertices
        cosine = jnp.sum(towards * mesh.normals, axis=1) / jnp.linalg.norm(towards, axis=1)
        return cls(mesh, imaging.rasterize(mesh, camera, samples=samples), jnp.clip(cosine, 0, 1))

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
        view = cls.by(mesh, camera, samples=samples)
        seen = imaging.interpolate(view.raster, reference)
        return view._replace(exposure=float(imaging.auto_exposure(seen, view.raster.mask)))

    def render(self, values: Float[Array, "v 3"], behind: Behind = 0.0) -> Float[Array, "h w 3"]:
        """Exposed radiance of the pixels, linear, before what is behind."""
        return imaging.interpolate(self.raster, self.exposure * values, behind)

    def shown(
        self, values: Float[Array, "v 3"], behind: Behind = GROUND
    ) -> Float[np.ndarray, "h w 3"]:
        return np.asarray(imaging.tone_map(self.render(values, behind)))

    def painted(self, values: Float[Array, " v"], bar: Bar) -> Float[np.ndarray, "h w 3"]:
        """Numbers in the colors of the bar, a little darker where the surface turns away."""
        both = jnp.stack([values, self.facing.astype(values.dtype)], axis=1)
        alpha = np.asarray(self.raster.alpha)[..., None]
        seen = np.asarray(imaging.interpolate(self.raster, both)) / np.maximum(alpha, 1e-6)
        colors = bar.paint(seen[..., 0]) * (1 - _RELIEF * (1 - seen[..., 1:]))
        linear = alpha * np.asarray(imaging.srgb_decode(jnp.asarray(colors)))
        return np.asarray(imaging.srgb_encode(jnp.asarray(linear + (1 - alpha) * GROUND)))

    def error(
        self,
        title: str,
        values: Float[Array, "v 3"],
        reference: Float[Array, "v 3"],
        gain: float,
    ) -> Panel:
        """How much brighter than the reference, to ± 1/gain."""
        apart = self.exposure * jnp.mean(values - reference, axis=1)
        bar = Bar.signed("error, mean of R, G, B; white is 1", 1 / gain, extend=True)
        return Panel(self.painted(apart, bar), title, bar)

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
    """Draw panels of one size, pixel by pixel, each with its title above it and its bar below."""
    save(_lay_out(rows, ground, letters).figure, path)


def animate(path: Path, frames: Sequence[Sequence[Panel]]) -> None:
    """Write a GIF: in each frame panels side by side, the bars of the first one's below them."""
    sheet = _lay_out([frames[0]], GROUND, "white")
    canvas = FigureCanvasAgg(sheet.figure)

    def drawn() -> Iterator[np.ndarray]:
        for frame in frames:
            for image, title, panel in zip(sheet.images, sheet.titles, frame, strict=True):
                image.set_data(panel.image)
                title.set_text(panel.title)
            canvas.draw()
            yield np.asarray(canvas.buffer_rgba())[..., :3]

    imaging.write_movie(path, drawn(), fps=10.0, encoding="srgb", progress=False)
    plt.close(sheet.figure)


class _Sheet(NamedTuple):
    figure: Figure
    images: list[FigureImage]
    titles: list[Text]


def _lay_out(rows: Sequence[Sequence[Panel]], ground: float, letters: str) -> _Sheet:
    height, width, _ = rows[0][0].image.shape
    columns = max(len(row) for row in rows)
    gap = max(3, width // 60)
    letter = max(11.0, 0.045 * width)  # height of the letters, in pixels
    above = [round(2.2 * letter) if any(panel.title for panel in row) else gap for row in rows]
    below = [round(4.4 * letter) if any(panel.bar for panel in row) else 0 for row in rows]
    whole = columns * (width + gap) + gap, sum(above) + sum(below) + len(rows) * height + gap
    figure = plt.figure(figsize=(whole[0] / _DPI, whole[1] / _DPI), dpi=_DPI)
    figure.set_facecolor(str(float(imaging.srgb_encode(jnp.asarray(ground)))))  # a grey
    sheet = _Sheet(figure, [], [])
    size = letter * 72 / _DPI
    for i, row in enumerate(rows):
        top = sum(above[: i + 1]) + sum(below[:i]) + i * height
        for j, panel in enumerate(row):
            left, low = gap + j * (width + gap), whole[1] - top - height
            sheet.images.append(figure.figimage(panel.image, left, low, origin="upper"))
            at = (left + width / 2) / whole[0], (low + height + above[i] / 2) / whole[1]
            text = figure.text(
                *at, panel.title, ha="center", va="center", color=letters, fontsize=size
            )
            sheet.titles.append(text)
            if panel.bar:
                corner = (left + 0.1 * width) / whole[0], (low - 1.4 * letter) / whole[1]
                place = *corner, 0.8 * width / whole[0], 0.8 * letter / whole[1]
                _draw_bar(figure.add_axes(place), panel.bar, 0.9 * size, letters)
    return sheet


def _draw_bar(axis: Axes, bar: Bar, size: float, letters: str) -> None:
    if isinstance(bar.colors, str):
        colors = ScalarMappable(Normalize(*bar.limits), bar.colors)
        ticks = MaxNLocator(4, steps=[1, 2, 2.5, 5, 10])
        plt.colorbar(colors, axis, orientation="horizontal", extend=bar.extend, ticks=ticks)
    else:
        axis.imshow([[to_rgb(color) for color in bar.colors.values()]], aspect="auto")
        axis.set_xticks(range(len(bar.colors)), list(bar.colors))
        axis.set_yticks([])
    axis.set_xlabel(bar.label, color=letters, fontsize=size, labelpad=0.2 * size)
    axis.tick_params(colors=letters, labelsize=size, length=0.3 * size, pad=0.2 * size)
    axis.spines[:].set_color(letters)


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
