"""Pictures of the experiments on Annen et al. 2004: views of a mesh, differences, panels."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import matplotlib

matplotlib.use("Agg")
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Array, Float

from jaxsh import geometry, imaging

_DPI = 100
GROUND = 0.0108  # around panels and behind objects, in exposed radiance

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


def draw_panels(path: Path, rows: Sequence[Sequence[Panel]]) -> None:
    """Panels of one size, pixel by pixel, each with its title above it."""
    height, width, _ = rows[0][0].image.shape
    columns = max(len(row) for row in rows)
    gap = max(3, width // 60)
    letter = max(11.0, 0.045 * width)  # height of the letters, in pixels
    above = round(2.2 * letter)
    whole = columns * (width + gap) + gap, len(rows) * (above + height) + gap
    figure = plt.figure(figsize=(whole[0] / _DPI, whole[1] / _DPI), dpi=_DPI)
    for i, row in enumerate(rows):
        for j, panel in enumerate(row):
            left, top = gap + j * (width + gap), above + i * (above + height)
            figure.figimage(panel.image, left, whole[1] - top - height, origin="upper")
            figure.text(
                (left + width / 2) / whole[0],
                1 - (top - above / 2) / whole[1],
                panel.title,
                ha="center",
                va="center",
                color="white",
                fontsize=letter * 72 / _DPI,
            )
    ground = float(imaging.srgb_encode(jnp.asarray(GROUND)))
    figure.savefig(path, dpi=_DPI, facecolor=(ground,) * 3)
    plt.close(figure)
