"""The pictures of `inverse.sky`."""

from pathlib import Path
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from matplotlib.axes import Axes

from jaxsh import geometry, imaging, inverse, plot, sky, sphere

from ..shared.plots import View, plt, save

_DOME = 480  # pixels across


class Case(NamedTuple):
    """One level of noise: what was observed, and what was made of it."""

    noise: float
    observed: Float[Array, "v 3"]
    found: inverse.Recovered[inverse.SkyLight]


def draw_errors(path: Path, rows: list[dict[str, Any]]) -> None:
    """Error of sun and turbidity by noise, and the deviations that the fits gave."""
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    levels = sorted({row["noise"] for row in rows})
    places = np.arange(len(levels))
    for axis, key, goal, unit in zip(
        axes, ("sun", "turbidity"), (0.1, 0.02), ("sun, degrees", "turbidity"), strict=True
    ):
        said = []
        for place, level in zip(places, levels, strict=True):
            of = [row for row in rows if row["noise"] == level]
            errors = np.array([row[f"{key}_error"] for row in of])
            spread = np.linspace(-0.15, 0.15, len(errors))
            axis.plot(place + spread, np.maximum(errors, 1e-9), "o", color="C0", markersize=3.5)
            said.append(np.sqrt(np.mean([row[f"{key}_deviation"] ** 2 for row in of])))
        axis.plot(places, said, "_-", color="C1", markersize=16, label="expected by the fit")
        axis.axhline(goal, color="grey", linestyle=":", label="goal without noise")
        axis.set_yscale("log")
        axis.set_xticks(places, [f"{100 * level:g} %" for level in levels])
        axis.set_xlabel("noise, in the mean radiance")
        axis.set_title(f"error of the {unit}")
        axis.grid(alpha=0.3)
    axes[0].legend(frameon=False, loc="lower right")
    save(figure, path, dpi=110)


def draw_sky(
    path: Path,
    mesh: geometry.Mesh,
    sun: Float[np.ndarray, " 3"],
    cases: list[Case],
    height: int,
) -> None:
    """Columns: noise. Rows: the mesh as observed, the dome of the sky recovered from it."""
    camera = imaging.Camera.facing(mesh, width=height, height=height)
    view = View.of(mesh, camera, cases[0].observed, samples=2)
    figure, axes = plt.subplots(
        2, len(cases), figsize=(4.2 * len(cases), 9), layout="constrained", squeeze=False
    )
    for (above, below), case in zip(axes.T, cases, strict=True):
        above.imshow(view.shown(case.observed, 1.0))
        above.set_title(f"observed, noise {100 * case.noise:g} %")
        above.axis("off")
        _draw_dome(below, case.found.value, sun)
    save(figure, path)


def _draw_dome(axis: Axes, value: inverse.SkyLight, sun: Float[np.ndarray, " 3"]) -> None:
    """The sky recovered, and around its sun a ring where the true one is."""

    def radiance(views: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
        views = views.astype(value.sun.dtype)
        return sky.preetham_radiance(views, value.sun, value.turbidity, check="allow")

    grid = sphere.lat_long(64, 128)
    above = grid.directions[:, 2] > 0
    level = float(jnp.sum(radiance(grid.directions[above]).mean(axis=1) * grid.weights[above]))
    curve = {"exposure": 0.6 * 2 * np.pi / level, "curve": "reinhard", "white": 4.0}
    plot.dome(radiance, suns=value.sun, **curve, resolution=_DOME, ax=axis)
    place = sun[:2] / np.sqrt(1 + sun[2])  # in equal areas, as the dome is
    axis.plot(*place, "o", mfc="none", mec="black", mew=1.5, ms=20, ls="", label="true sun")
    axis.legend(loc="lower right", fontsize="small", frameon=False)
    axis.set_title(f"sky recovered, turbidity {float(value.turbidity):.3f}")
