"""Pictures of ringing: a light cut off at a degree, and a mesh in it."""

from pathlib import Path

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsh import harmonics, imaging, plot, sphere

from ..shared.plots import View, plt, save
from .ringing_mesh import Shaded


def draw_lights(
    path: Path, image: Float[Array, "h w 3"], rest: Float[Array, "h w 3"], degree: int
) -> None:
    """The picture, and what harmonics make of it: as it is, under windows, without its sources."""
    whole, without = (sphere.project_lat_long(x, degree) for x in (image, rest))
    exposure = 0.8 / float(jnp.quantile(rest.mean(axis=-1), 0.9))
    clean, _ = harmonics.dering(whole, of="light", shared=True)
    lights = {
        "the picture": image,
        "as it is": whole,
        "dering of the light": clean,
        "sources split off": without,
    }
    figure, axes = plt.subplots(2, 2, figsize=(12, 7.4), layout="constrained")
    for axis, (title, light) in zip(axes.flat, lights.items(), strict=True):
        plot.light(light, height=256, exposure=exposure, ax=axis)
        title = title if title == "the picture" else f"degree {degree}, {title}"
        axis.set_title(title)
    save(figure, path)


def draw_meshes(path: Path, shaded: Shaded, *, size: int) -> None:
    """A column for each way of shading; diffuse above, glossy below."""
    camera = imaging.Camera.facing(shaded.mesh, width=size, height=size)
    rows = list(zip(*shaded.colors.values(), strict=True))
    figure, axes = plt.subplots(
        2, len(shaded.colors), figsize=(4 * len(shaded.colors), 10.8), layout="constrained"
    )
    for surface, colors, line in zip(("diffuse", "glossy"), rows, axes, strict=True):
        # All at the exposure of the last, whose sources are traced.
        last = View.of(shaded.mesh, camera, jnp.asarray(colors[-1], jnp.float32))
        for title, values, axis in zip(shaded.colors, colors, line, strict=True):
            plot.shaded(shaded.mesh, values, camera=camera, exposure=0.8 * last.exposure, ax=axis)
            axis.set_title(f"{surface}, {title}")
    save(figure, path)
