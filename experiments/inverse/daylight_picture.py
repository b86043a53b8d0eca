"""The picture of `inverse.daylight`."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxsh import imaging, inverse, sphere

from ..shared.plots import plt, save

if TYPE_CHECKING:
    from .daylight import Truth

_ROWS = 90


class Shown(NamedTuple):
    """One setting: pixels on the mesh as observed and as the light found makes them."""

    truth: "Truth"
    observed: Float[np.ndarray, "p 3"]
    again: Float[np.ndarray, "p 3"]
    value: inverse.Daylight
    model: "Truth"  # whose sky is that of the value


def draw(path: Path, raster: imaging.Raster, shown: list[Shown]) -> None:
    """A row for each sky: the mesh observed and rendered again; the light, true and found."""
    figure, axes = plt.subplots(
        len(shown),
        4,
        figsize=(12, 2.6 * len(shown)),
        width_ratios=[1, 1, 2, 2],
        layout="constrained",
        squeeze=False,
    )
    mask = np.asarray(raster.mask)
    directions = np.asarray(sphere.lat_long(_ROWS, 2 * _ROWS).directions, np.float64)
    for row, case in zip(axes, shown, strict=True):
        truth, value = case.truth, case.value
        pictures = []
        for color in (case.observed, case.again):
            picture = np.zeros((*mask.shape, 3))
            picture[mask] = color
            pictures.append(picture)
        exposure = imaging.auto_exposure(jnp.asarray(pictures[0]), raster.mask)
        for axis, picture in zip(row, pictures, strict=False):
            shades = np.array(imaging.tone_map(jnp.asarray(picture), exposure))
            shades[~mask] = 1
            axis.imshow(shades)
        lights = truth.radiance(directions), _radiance(case, directions)
        exposure = 0.5 / lights[0].mean()
        suns = (truth.sun if truth.facing.any() else None), np.asarray(value.sun)
        for axis, light, sun in zip(row[2:], lights, suns, strict=True):
            image = jnp.asarray(light.reshape(_ROWS, 2 * _ROWS, 3))
            axis.imshow(imaging.tone_map(image, exposure, curve="reinhard", white=4.0))
            if sun is not None:
                angle = np.arctan2(sun[1], sun[0]) % (2 * np.pi)
                place = angle / np.pi * _ROWS - 0.5, np.arccos(sun[2]) / np.pi * _ROWS - 0.5
                axis.plot(*place, "o", color="k", markerfacecolor="none", markersize=9)
        titles = (
            f"observed, {truth.kind}",
            "rendered again",
            f"true, turbidity {truth.turbidity:.2f}" if truth.facing.any() else "true, no sun",
            f"found, turbidity {float(value.turbidity):.2f}",
        )
        for axis, title in zip(row, titles, strict=True):
            axis.set_title(title, fontsize=10)
            axis.axis("off")
    save(figure, path, dpi=100)


def _radiance(case: Shown, directions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Sky and ground that were found, without the sun's disc."""
    exposure, value = float(case.value.exposure), case.value
    level = exposure * case.model.level() + np.asarray(value.sun[2] * value.facing)
    ground = np.asarray(value.ground) / np.pi * level
    return np.where(directions[:, 2:] < 0, ground, exposure * case.model.above(directions))
