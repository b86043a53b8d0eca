"""The picture of `inverse.daylight`."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float
from scipy.ndimage import distance_transform_edt, zoom

from jaxsh import imaging, inverse, plot, sphere

from ..shared.plots import plt, save

if TYPE_CHECKING:
    from .daylight import Truth

_ROWS = 180


class Shown(NamedTuple):
    """One setting: pixels on the mesh as observed and as the light found makes them."""

    truth: "Truth"
    observed: Float[np.ndarray, "p 3"]
    again: Float[np.ndarray, "p 3"]
    value: inverse.Daylight
    model: "Truth"  # whose sky is that of the value


def draw(path: Path, smooth: imaging.Raster, mask: Bool[np.ndarray, "h w"], shown: list[Shown]):
    """A row for each sky: the mesh observed and rendered again; the light, true and found.

    Between the few pixels that were observed, those of `mask`, colors are interpolated; `smooth` is
    the mesh in as many pixels as the picture shows.
    """
    figure, axes = plt.subplots(
        len(shown),
        4,
        figsize=(18, 4.2 * len(shown)),
        width_ratios=[1, 1, 1.7, 1.7],
        layout="constrained",
        squeeze=False,
    )
    directions = np.asarray(sphere.lat_long(_ROWS, 2 * _ROWS).directions, np.float64)
    for row, case in zip(axes, shown, strict=True):
        truth, value = case.truth, case.value
        exposure = imaging.auto_exposure(jnp.asarray(case.observed)[None])
        for axis, color in zip(row, (case.observed, case.again), strict=False):
            axis.imshow(_filled(color, mask, smooth, exposure))
            axis.axis("off")
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
        pixels = f"{mask.shape[0]} × {mask.shape[1]} pixels"
        titles = (
            f"observed, {truth.kind}, {pixels}",
            "rendered again",
            f"true, turbidity {truth.turbidity:.2f}" if truth.facing.any() else "true, no sun",
            f"found, turbidity {float(value.turbidity):.2f}",
        )
        for axis, title in zip(row, titles, strict=True):
            axis.set_title(title)
    save(figure, path)


def _filled(
    color: Float[np.ndarray, "p 3"],
    mask: Bool[np.ndarray, "h w"],
    smooth: imaging.Raster,
    exposure: Float[Array, ""],
) -> Float[np.ndarray, "H W 4"]:
    """The pixels of the mask in a larger picture, without steps within the mesh or at its edge."""
    picture = np.zeros((*mask.shape, 3))
    picture[mask] = color
    nearest = np.empty((2, *mask.shape), np.int32)
    distance_transform_edt(~mask, return_distances=False, return_indices=True, indices=nearest)
    picture = picture[nearest[0], nearest[1]]  # none of what is behind the mesh comes in
    alpha = np.asarray(smooth.alpha)
    scale = [wide / narrow for wide, narrow in zip(alpha.shape, mask.shape, strict=True)]
    wide = zoom(picture, (*scale, 1), order=1, mode="nearest", grid_mode=True)
    return np.dstack([np.asarray(imaging.tone_map(jnp.asarray(wide), exposure)), alpha])


def _radiance(case: Shown, directions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Sky and ground that were found, without the sun's disc."""
    exposure, value = float(case.value.exposure), case.value
    level = exposure * case.model.level() + np.asarray(value.sun[2] * value.facing)
    ground = np.asarray(value.ground) / np.pi * level
    return np.where(directions[:, 2:] < 0, ground, exposure * case.model.above(directions))
