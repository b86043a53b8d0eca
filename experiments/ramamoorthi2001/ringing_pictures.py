"""Pictures of ringing: a light cut off at a degree, and a mesh in it."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import harmonics, imaging, sphere

from ..shared.plots import plt, save
from .ringing_mesh import Shaded

_BLUE = (0.2, 0.35, 1.0)


def draw_lights(
    path: Path, image: Float[Array, "h w 3"], rest: Float[Array, "h w 3"], degree: int
) -> None:
    """The picture, and what harmonics make of it: as it is, under windows, without its sources."""
    whole, without = (sphere.project_lat_long(x, degree) for x in (image, rest))
    exposure = 0.8 / float(jnp.quantile(rest.mean(axis=-1), 0.9))
    clean, _ = harmonics.dering(whole, of="light", shared=True)
    panels = {
        "the picture": np.asarray(imaging.tone_map(image, exposure)),
        "as it is": _shown(whole, exposure),
        "dering of the light": _shown(clean, exposure),
        "sources split off": _shown(without, exposure),
    }
    figure, axes = plt.subplots(1, len(panels), figsize=(11, 1.6), layout="constrained")
    for axis, (title, panel) in zip(axes, panels.items(), strict=True):
        axis.imshow(panel, extent=(0, 2, 0, 1))
        axis.set_title(title, fontsize=10)
        axis.axis("off")
    save(figure, path)


def _shown(light: Float[Array, "3 k"], exposure: float) -> Float[np.ndarray, "h w 3"]:
    radiance = sphere.reconstruct_lat_long(light, 128, 256)
    return _marked(np.asarray(imaging.tone_map(radiance, exposure)), np.asarray(radiance))


def _marked(
    picture: Float[np.ndarray, "h w 3"], radiance: Float[np.ndarray, "h w 3"]
) -> Float[np.ndarray, "h w 3"]:
    """Blue where a channel is negative by more than rounding."""
    below = radiance.min(axis=-1) < -1e-3 * abs(np.nanmean(radiance))
    return np.where(below[..., None], _BLUE, picture)


def draw_meshes(path: Path, shaded: Shaded, *, size: int) -> None:
    """A column for each way of shading; diffuse above, glossy below."""
    camera = imaging.Camera.facing(shaded.mesh, width=size, height=size)
    raster = imaging.rasterize(shaded.mesh, camera, samples=2)
    rows = list(zip(*shaded.colors.values(), strict=True))
    figure, axes = plt.subplots(
        2, len(shaded.colors), figsize=(2.75 * len(shaded.colors), 5.8), layout="constrained"
    )
    for row, (colors, line) in enumerate(zip(rows, axes, strict=True)):
        # All at the exposure of the last, whose sources are traced.
        last = imaging.interpolate(raster, jnp.asarray(colors[-1], jnp.float32))
        exposure = 0.8 * imaging.auto_exposure(last, raster.mask)
        for title, values, axis in zip(shaded.colors, colors, line, strict=True):
            radiance = imaging.interpolate(raster, jnp.asarray(values, jnp.float32))
            picture = _marked(
                np.asarray(imaging.tone_map(radiance, exposure)), np.asarray(radiance)
            )
            axis.imshow(np.where(np.asarray(raster.mask)[..., None], picture, 1.0))
            axis.axis("off")
            if row == 0:
                axis.set_title(title, fontsize=11)
    save(figure, path)
