"""Pictures of the experiments on Lee & Kim 2014: a scene, regions in false colour, signed maps."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import Rectangle

from jaxsh import imaging

from ..shared.plots import GROUND, Panel, View, plt
from .scenes import Scene

_DPI = 100
_KEY = 0.1  # room for a key at the left of each picture, in heights
_MARGIN = 0.02
_INSIDE, _OUTSIDE = (0.86, 0.16, 0.12), (0.45, 0.45, 0.48)  # the paper's region is red

_RAMP = plt.get_cmap("RdBu_r")

Color = tuple[float, ...]


@dataclasses.dataclass(frozen=True)
class Look:
    """What the configs of the pictures have in common."""

    rows: tuple[tuple[str, str, int], ...] = ()
    """probe, mesh and degree; none means the first that the data have, at a low degree"""
    threshold: float = 0.02
    """of the specular change, in exposed linear colour; the paper's"""
    diffuse_threshold: float = 0.01
    """of the diffuse change; the paper's"""
    directions: int = 2048
    """directions of the bake"""
    size: int = 360
    """height of a panel, in pixels"""
    samples: int = 2
    """rays along each side of a pixel"""
    gain: float = 8.0
    """of the difference pictures"""

    def __post_init__(self):
        if self.size < 16 or min(self.samples, self.directions) < 1:
            raise ValueError("size must be at least 16, samples and directions at least 1")
        if min(self.threshold, self.diffuse_threshold) < 0 or self.gain <= 0:
            raise ValueError("thresholds must be at least 0 and gain above 0")


class Canvas(NamedTuple):
    """A scene as its eye sees it, cut to the object and a strip for a key on its left."""

    view: View
    columns: slice
    room: int  # for the key, where the object leaves none
    relief: Float[Array, "v 1"]  # how bright a false colour is, so that the shape shows

    @classmethod
    def of(cls, scene: Scene, size: int, samples: int = 1) -> "Canvas":
        camera = dataclasses.replace(scene.camera, width=size, height=size)
        view = View(scene.mesh, imaging.rasterize(scene.mesh, camera, samples=samples))
        seen = np.flatnonzero(np.asarray(view.raster.alpha).any(axis=0))
        first = int(seen[0]) - round((_KEY + _MARGIN) * size)
        columns = slice(max(0, first), min(size, int(seen[-1]) + 1 + round(_MARGIN * size)))
        towards = scene.eye[None] - scene.mesh.vertices
        cosine = jnp.sum(towards * scene.mesh.normals, axis=1) / jnp.linalg.norm(towards, axis=1)
        relief = (0.35 + 0.65 * jnp.clip(cosine, 0, 1))[:, None]
        return cls(view, columns, max(0, -first), relief)

    def _cut(self, image: Float[np.ndarray, "h s 3"]) -> Float[np.ndarray, "h w 3"]:
        return np.pad(image[:, self.columns], ((0, 0), (self.room, 0), (0, 0)), mode="edge")

    def shown(self, color: Float[Array, "v 3"]) -> Float[np.ndarray, "h w 3"]:
        """Linear colours; white is 1."""
        return self._cut(self.view.shown(color))

    def difference(
        self, color: Float[Array, "v 3"], reference: Float[Array, "v 3"], gain: float
    ) -> Float[np.ndarray, "h w 3"]:
        """The absolute difference, times `gain`, before black."""
        return self._cut(self.view.difference(color, reference, gain))

    def painted(self, colors: Float[ArrayLike, "v 3"]) -> Float[np.ndarray, "h w 3"]:
        """False colours, as a screen has them, shaded by how far they face the eye."""
        linear = imaging.srgb_decode(jnp.asarray(colors, self.relief.dtype))
        return self._cut(self.view.shown(linear * self.relief))

    def levels(
        self, reached: Int[Array, " v"], base: int, target: int
    ) -> Float[np.ndarray, "h w 3"]:
        """The degree that each vertex was computed to, with its key."""
        colors = level_colors(base, target)
        image = self.painted(np.array(list(colors.values()))[np.asarray(reached) - base])
        return with_key(image, {str(level): color for level, color in colors.items()})

    def region(self, inside: Bool[Array, " v"]) -> Float[np.ndarray, "h w 3"]:
        """In red."""
        return self.painted(np.where(np.asarray(inside)[:, None], _INSIDE, _OUTSIDE))

    def region_key(self) -> Float[np.ndarray, "h w 3"]:
        """A panel of its own."""
        return with_key(self._empty(), {"inside": _INSIDE, "outside": _OUTSIDE})

    def signed(self, values: Float[Array, " v"], limit: float) -> Float[np.ndarray, "h w 3"]:
        """Red above zero, blue below, full at ± `limit`."""
        return self.painted(_RAMP(np.asarray(values) / (2 * limit) + 0.5)[:, :3])

    def signed_key(self, limit: float) -> Float[np.ndarray, "h w 3"]:
        """A panel of its own."""
        marks = np.linspace(1, -1, 9)
        return with_key(self._empty(), {f"{m * limit:.3f}": _RAMP(m / 2 + 0.5)[:3] for m in marks})

    def _empty(self) -> Float[np.ndarray, "h w 3"]:
        ground = float(imaging.srgb_encode(jnp.asarray(GROUND)))
        return np.full_like(self.shown(self.view.mesh.vertices), ground)


def evened(rows: Sequence[Sequence[Panel]]) -> list[list[Panel]]:
    """All as wide as the widest: what is behind the object goes on."""
    width = max(panel.image.shape[1] for row in rows for panel in row)

    def padded(image: np.ndarray) -> np.ndarray:
        lacking = width - image.shape[1]
        sides = (0, 0), (lacking // 2, lacking - lacking // 2), (0, 0)
        return np.pad(image, sides, mode="edge")

    return [[Panel(padded(image), title) for image, title in row] for row in rows]


def level_colors(base: int, target: int) -> dict[int, Color]:
    """Dark for the base, bright for the target."""
    ramp = plt.get_cmap("turbo")
    steps = max(target - base, 1)
    return {
        level: ramp(0.08 + 0.82 * (level - base) / steps)[:3] for level in range(base, target + 1)
    }


def with_key(
    image: Float[np.ndarray, "h w 3"], entries: Mapping[str, Sequence[float]]
) -> Float[np.ndarray, "h w 3"]:
    """A column of colours with their names over the picture's left edge, the last one lowest."""
    height, width, _ = image.shape
    figure = plt.figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI)
    figure.figimage(image, 0, 0, origin="upper")
    side = min(0.045 * height, 0.9 * height / len(entries))
    for i, (name, color) in enumerate(entries.items()):
        left, low = 0.3 * side, height - 0.3 * side - 1.15 * side * (i + 1)
        box = (left / width, low / height), side / width, side / height
        figure.add_artist(Rectangle(*box, transform=figure.transFigure, facecolor=tuple(color)))
        figure.text(
            (left + 1.25 * side) / width,
            (low + side / 2) / height,
            name,
            color="white",
            va="center_baseline",
            fontsize=0.75 * side * 72 / _DPI,
        )
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    drawn = np.asarray(canvas.buffer_rgba())[..., :3].astype(np.float32) / 255
    plt.close(figure)
    return drawn
