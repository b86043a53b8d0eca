"""The picture of `inverse.light`."""

from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxsh import geometry, harmonics, imaging, plot, sphere

from ..shared.plots import View, plt, save

_METHODS = {"plain": "least squares", "prior": "with the prior"}


class Recovered(NamedTuple):
    """A light, what was found of it, and the irradiance of all vertices under its probe."""

    name: str
    truth: Float[np.ndarray, "3 k"]
    fits: dict[str, Float[np.ndarray, "3 k"]]
    irradiance: Float[np.ndarray, "v 3"]


def draw(
    path: Path,
    mesh: geometry.Mesh,
    pictures: list[Recovered],
    toward: Float[np.ndarray, " 3"],
    height: int,
) -> None:
    """For each probe: the mesh's front and back as lit, and its back as found; the lights."""
    away = toward * np.array([-1.0, -1.0, 1.0])
    front, back = (
        imaging.Camera.facing(mesh, toward=(x, y, z), width=height, height=height)
        for x, y, z in (toward.tolist(), away.tolist())
    )
    figure = plt.figure(figsize=(14, 7.2 * len(pictures)), layout="constrained")
    blocks = figure.subfigures(len(pictures), 1, squeeze=False)[:, 0]
    for block, picture in zip(blocks, pictures, strict=True):
        block.suptitle(picture.name, fontsize="x-large")
        above, below = block.subfigures(2, 1, height_ratios=[1.05, 1])
        exact = jnp.asarray(picture.irradiance)
        shown = [("what is seen", exact, front), ("its back", exact, back)]
        for method, light in picture.fits.items():
            found = sphere.irradiance(jnp.asarray(light), mesh.normals)
            shown.append((f"back, {_METHODS[method]}", found, back))
        exposure = View.of(mesh, front, exact).exposure
        for axis, (title, values, camera) in zip(above.subplots(1, 4), shown, strict=True):
            plot.shaded(mesh, values, camera=camera, exposure=exposure, ax=axis)
            axis.set_title(title)
        count = next(iter(picture.fits.values())).shape[-1]
        lights = [picture.truth[:, :count], *picture.fits.values()]
        glow = 0.5 / (float(picture.truth[:, 0].mean()) / np.sqrt(4 * np.pi))
        titles = ["true", *_METHODS.values()]
        for axis, title, light in zip(below.subplots(1, 3), titles, lights, strict=True):
            plot.light(light, height=256, exposure=glow, ax=axis)
            axis.set_title(f"light of degree {harmonics.degree_of(count)}, {title}")
    save(figure, path)
