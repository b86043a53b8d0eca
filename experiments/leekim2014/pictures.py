"""Pictures of the experiments on Lee & Kim 2014: a scene, regions in false color, signed maps."""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from jaxsh import imaging

from ..shared.plots import Bar, Color, Panel, View, plt
from .scenes import Scene

_MARGIN = 0.02
_REGION = {"outside": (0.42, 0.46, 0.53), "inside": (1.0, 0.72, 0.15)}  # told apart by all eyes


@dataclasses.dataclass(frozen=True)
class Look:
    """What the configs of the pictures have in common."""

    rows: tuple[tuple[str, str, int], ...] = ()
    """probe, mesh and degree; none means the first that the data have, at a low degree"""
    threshold: float = 0.02
    """of the specular change, in exposed linear color; the paper's"""
    diffuse_threshold: float = 0.01
    """of the diffuse change; the paper's"""
    directions: int = 2048
    """directions of the bake"""
    size: int = 400
    """height of a panel, in pixels"""
    samples: int = 2
    """rays along each side of a pixel"""
    gain: float = 8.0
    """of the errors: their colors are full at ± 1/gain of white"""

    def __post_init__(self):
        if self.size < 16 or min(self.samples, self.directions) < 1:
            raise ValueError("size must be at least 16, samples and directions at least 1")
        if min(self.threshold, self.diffuse_threshold) < 0 or self.gain <= 0:
            raise ValueError("thresholds must be at least 0 and gain above 0")


class Canvas(NamedTuple):
    """A scene as its eye sees it, cut to the object."""

    view: View
    columns: slice

    @classmethod
    def of(cls, scene: Scene, size: int, samples: int = 1) -> "Canvas":
        camera = dataclasses.replace(scene.camera, width=size, height=size)
        view = View.by(scene.mesh, camera, samples=samples)
        seen = np.flatnonzero(np.asarray(view.raster.alpha).any(axis=0))
        margin = round(_MARGIN * size)
        columns = slice(max(0, int(seen[0]) - margin), min(size, int(seen[-1]) + 1 + margin))
        return cls(view, columns)

    def _cut(self, image: Float[np.ndarray, "h s 3"]) -> Float[np.ndarray, "h w 3"]:
        return image[:, self.columns]

    def shown(self, color: Float[Array, "v 3"]) -> Float[np.ndarray, "h w 3"]:
        """Linear colors; white is 1."""
        return self._cut(self.view.shown(color))

    def error(
        self, title: str, color: Float[Array, "v 3"], reference: Float[Array, "v 3"], gain: float
    ) -> Panel:
        """How much brighter than the reference, to ± 1/gain."""
        panel = self.view.error(title, color, reference, gain)
        return panel._replace(image=self._cut(panel.image))

    def signed(self, title: str, values: Float[Array, " v"], bar: Bar) -> Panel:
        return Panel(self._cut(self.view.painted(values, bar)), title, bar)

    def levels(self, title: str, reached: Int[Array, " v"], base: int, target: int) -> Panel:
        """The degree that each vertex was computed to."""
        colors = level_colors(base, target)
        image = self._named(np.array(list(colors.values()))[np.asarray(reached) - base])
        bar = Bar("degree", {str(level): color for level, color in colors.items()})
        return Panel(image, title, bar)

    def region(self, title: str, inside: Bool[Array, " v"]) -> Panel:
        colors = np.array(list(_REGION.values()))
        return Panel(self._named(colors[np.asarray(inside, int)]), title, Bar("region", _REGION))

    def _named(self, colors: Float[ArrayLike, "v 3"]) -> Float[np.ndarray, "h w 3"]:
        """Colors as a screen has them, shaded by how far they face the eye."""
        facing = self.view.facing[:, None]
        linear = imaging.srgb_decode(jnp.asarray(colors, facing.dtype))
        return self.shown(linear * (0.5 + 0.5 * facing))


def evened(rows: Sequence[Sequence[Panel]]) -> list[list[Panel]]:
    """All as wide as the widest: what is behind the object goes on."""
    width = max(panel.image.shape[1] for row in rows for panel in row)

    def padded(image: np.ndarray) -> np.ndarray:
        lacking = width - image.shape[1]
        sides = (0, 0), (lacking // 2, lacking - lacking // 2), (0, 0)
        return np.pad(image, sides, mode="edge")

    return [[panel._replace(image=padded(panel.image)) for panel in row] for row in rows]


def level_colors(base: int, target: int) -> dict[int, Color]:
    """Dark for the base, bright for the target."""
    ramp = plt.get_cmap("viridis")
    steps = max(target - base, 1)
    return {
        level: ramp(0.15 + 0.85 * (level - base) / steps)[:3] for level in range(base, target + 1)
    }
