"""The picture of `inverse.light`."""

from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxsh import geometry, harmonics, imaging, sphere

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
    """Rows: probes. Columns: the mesh's front and back as lit, its back as found, the lights."""
    away = toward * np.array([-1.0, -1.0, 1.0])
    cameras = [
        imaging.Camera.facing(mesh, toward=(x, y, z), width=height, height=height)
        for x, y, z in (toward.tolist(), away.tolist())
    ]
    figure, axes = plt.subplots(
        len(pictures),
        7,
        figsize=(15, 1.75 * len(pictures) + 0.2),
        width_ratios=[1, 1, 1, 1, 1.7, 1.7, 1.7],
        layout="constrained",
        squeeze=False,
    )
    for row, picture in zip(axes, pictures, strict=True):
        exact = jnp.asarray(picture.irradiance)
        front = View.of(mesh, cameras[0], exact, samples=2)
        back = View(mesh, imaging.rasterize(mesh, cameras[1], samples=2), front.exposure)
        shown = [front.shown(exact), back.shown(exact)]
        titles = ["what is seen", "its back"]
        count = next(iter(picture.fits.values())).shape[-1]
        lights = [picture.truth[:, :count], *picture.fits.values()]
        for method, light in picture.fits.items():
            shown.append(back.shown(sphere.irradiance(jnp.asarray(light), mesh.normals)))
            titles.append(f"back, {_METHODS[method]}")
        glow = 0.5 / (float(picture.truth[:, 0].mean()) / np.sqrt(4 * np.pi))
        for light, title in zip(lights, ["true", *_METHODS.values()], strict=True):
            seen = sphere.reconstruct_lat_long(jnp.asarray(light), 64, 128)
            image = np.array(imaging.tone_map(seen, glow))
            image[np.asarray(seen.mean(axis=-1)) < 0] = (0.25, 0.35, 1.0)  # negative
            shown.append(image)
            titles.append(f"light of degree {harmonics.degree_of(count)}, {title}")
        for axis, image, title in zip(row, shown, titles, strict=True):
            axis.imshow(image)
            axis.set_axis_off()
            if picture is pictures[0]:
                axis.set_title(title, fontsize=9)
        row[0].text(
            -0.04,
            0.5,
            picture.name,
            rotation=90,
            va="center",
            ha="right",
            transform=row[0].transAxes,
            fontsize=9,
        )
    save(figure, path, dpi=100)
