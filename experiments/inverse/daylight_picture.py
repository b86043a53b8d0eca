"""The picture of `inverse.daylight`."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxsh import geometry, imaging, inverse, plot, sphere

from ..shared.plots import View, plt, save

if TYPE_CHECKING:
    from .daylight import Truth

_ROWS, _SIZE = 180, 400


class Shown(NamedTuple):
    """One setting: vertices of the mesh as they are lit and as the light found makes them."""

    truth: "Truth"
    truly: Float[np.ndarray, "v 3"]
    again: Float[np.ndarray, "v 3"]
    value: inverse.Daylight
    model: "Truth"  # whose sky is that of the value


def draw(path: Path, mesh: geometry.Mesh, shown: list[Shown]) -> None:
    """A row for each sky: the mesh as lit and lit again; the light, true and found."""
    camera = imaging.Camera.facing(mesh, width=_SIZE, height=_SIZE)
    figure, axes = plt.subplots(
        len(shown),
        4,
        figsize=(18, 4.4 * len(shown)),
        width_ratios=[1, 1, 1.7, 1.7],
        layout="constrained",
        squeeze=False,
    )
    directions = np.asarray(sphere.lat_long(_ROWS, 2 * _ROWS).directions, np.float64)
    for row, case in zip(axes, shown, strict=True):
        truth, value = case.truth, case.value
        exposure = View.of(mesh, camera, jnp.asarray(case.truly)).exposure
        for axis, color in zip(row, (case.truly, case.again), strict=False):
            positive = np.maximum(color, 0)
            plot.shaded(mesh, positive, camera=camera, exposure=exposure, length="radii", ax=axis)
        lights = truth.radiance(directions), _radiance(case, directions)
        exposure = 0.5 / lights[0].mean()
        suns = (truth.sun if truth.facing.any() else None), np.asarray(value.sun)
        for axis, light, sun in zip(row[2:], lights, suns, strict=True):
            plot.light(light.reshape(_ROWS, 2 * _ROWS, 3), exposure=float(exposure), ax=axis)
            if sun is not None:
                angle = np.degrees(np.arctan2(sun[1], sun[0])) % 360
                place = angle, np.degrees(np.arccos(sun[2]))
                axis.plot(*place, "o", mec="black", mfc="none", mew=1.5, ms=11, label="sun")
                axis.legend(loc="lower right", fontsize="small")
        titles = (
            f"lit, {truth.kind}",
            "by the light found",
            f"true, turbidity {truth.turbidity:.2f}" if truth.facing.any() else "true, no sun",
            f"found, turbidity {float(value.turbidity):.2f}",
        )
        for axis, title in zip(row, titles, strict=True):
            axis.set_title(title)
    save(figure, path)


def _radiance(case: Shown, directions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Sky and ground that were found, without the sun's disc."""
    exposure, value = float(case.value.exposure), case.value
    level = exposure * case.model.level() + np.asarray(value.sun[2] * value.facing)
    ground = np.asarray(value.ground) / np.pi * level
    return np.where(directions[:, 2:] < 0, ground, exposure * case.model.above(directions))
