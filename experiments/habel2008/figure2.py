"""The fit at its worst: the exact projection, what the fit makes of it, and the difference."""

import dataclasses
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import harmonics, sky, sphere

from ..runner import Context, Table, experiment
from ..shared.plots import plt, save
from . import spheres

_HEIGHT = 90


@dataclasses.dataclass(frozen=True)
class Figure2:
    bands: tuple[int, ...] = (3, 5, 7)
    """bands of the reconstructions, up to 7"""
    suns: int = 31
    """zenith angles from 0 to 90 degrees among which the worst is sought"""
    turbidities: int = 8
    """turbidities from 2.5 to 6 among which the worst is sought"""
    samples: tuple[int, int] = (32, 20)
    """suns and turbidities that the paper's polynomial is fitted to"""

    def __post_init__(self):
        if not self.bands or not 1 <= min(self.bands) <= max(self.bands) <= 7:
            raise ValueError("bands must be one or more numbers from 1 to 7")
        if min(self.suns, self.turbidities) < 2:
            raise ValueError("suns and turbidities must be at least 2")


class Worst(NamedTuple):
    """The setting at which a model errs most at the most bands."""

    model: str
    zenith: float
    turbidity: float
    exact: Float[Array, "3 k"]
    fitted: Float[Array, "3 k"]


@experiment("habel2008.figure2", x64=True)
def figure2(config: Figure2, context: Context) -> Table:
    """The worst sun and turbidity for the paper's polynomial and for the shipped fit (figure 2)."""
    zenith, turbidity = (
        grid.ravel()
        for grid in np.meshgrid(
            np.linspace(0, 90, config.suns),
            np.linspace(2.5, 6, config.turbidities),
            indexing="ij",
        )
    )
    suns = jnp.asarray(np.stack([spheres.sun_at(angle) for angle in zenith]))
    with context.time("exact projection"):
        exact = jax.block_until_ready(sky.project_preetham(suns, jnp.asarray(turbidity)))
    smallest = sky.smallest_luminance(suns, jnp.asarray(turbidity))
    with context.time("plain fit"):
        plain = sky.habel2008_fit(samples=config.samples)
    models = {
        "the paper's polynomial, (13, 7)": plain(suns, jnp.asarray(turbidity)),
        "the shipped fit, 12 × 6": sky.preetham_harmonics(
            suns, jnp.asarray(turbidity), table="small"
        ),
    }
    cases = []
    for model, fitted in models.items():
        for bands in config.bands:
            error = sky.fit_error(
                fitted[..., : bands**2], exact[..., : bands**2], smallest
            ).mean.max(axis=-1)
            worst = int(jnp.argmax(error))
            case = Worst(model, zenith[worst], turbidity[worst], exact[worst], fitted[worst])
            context.record(_row(case, bands, 100 * float(error[worst])))
            if bands == config.bands[-1]:
                cases.append(case)
    caption = (
        "each at its worst at the last number of bands: the sky, its exact projection, what the "
        "fit makes of it, and what the fit adds, in the mean of the sky; blue is below zero"
    )
    _draw(context.path("figure2.png", caption), cases, config.bands)
    return Table(
        "The fit at its worst",
    )


def _row(case: Worst, bands: int, error: float) -> dict:
    exact, fitted = (c[:, : bands**2] for c in (case.exact, case.fitted))
    mean = spheres.mean_luminance(case.exact)
    difference = (
        sphere.reconstruct_lat_long(fitted - exact, _HEIGHT, 2 * _HEIGHT) @ spheres.LUMINANCE
    )
    itself = spheres.sky_picture(spheres.sun_at(case.zenith), case.turbidity, _HEIGHT)
    left = (sphere.reconstruct_lat_long(exact, _HEIGHT, 2 * _HEIGHT) - itself) @ spheres.LUMINANCE
    weights = sphere.lat_long(_HEIGHT, 2 * _HEIGHT).weights.reshape(left.shape) / (4 * np.pi)
    return {
        "model": case.model,
        "bands": bands,
        "zenith": case.zenith,
        "turbidity": case.turbidity,
        "error": error,
        "pixel": 100 * float(jnp.abs(difference).max()) / mean,
        "truncation": 100 * float(jnp.sqrt(jnp.sum(weights * left**2))) / mean,
    }


def _draw(path, cases: list[Worst], bands: tuple[int, ...]) -> None:
    columns = 1 + len(bands)
    figure, axes = plt.subplots(
        3 * len(cases),
        columns,
        figsize=(3.1 * columns, 5.7 * len(cases)),
        layout="constrained",
        squeeze=False,
    )
    for case, rows in zip(cases, np.split(axes, len(cases)), strict=True):
        _draw_case(figure, rows, case, bands)
    save(figure, path, dpi=140)


def _draw_case(figure, axes, case: Worst, bands: tuple[int, ...]) -> None:
    mean = spheres.mean_luminance(case.exact)
    itself = spheres.sky_picture(spheres.sun_at(case.zenith), case.turbidity, _HEIGHT)
    title = f"the sky: sun {90 - case.zenith:.0f}° up, turbidity {case.turbidity:g}"
    spheres.show_sphere(axes[0, 0], itself, 0.5 / mean, title)
    axes[1, 0].axis("off")
    axes[1, 0].text(0.5, 0.5, f"{case.model}\n→", ha="center", va="center", fontsize=10)
    differences = []
    for column, count in enumerate(bands, start=1):
        exact, fitted = (
            sphere.reconstruct_lat_long(c[:, : harmonics.num_coefficients(count - 1)], 90, 180)
            for c in (case.exact, case.fitted)
        )
        spheres.show_sphere(axes[0, column], exact, 0.5 / mean, f"exact, {count} bands")
        spheres.show_sphere(axes[1, column], fitted, 0.5 / mean, f"fitted, {count} bands")
        differences.append(100 * np.asarray((fitted - exact) @ spheres.LUMINANCE) / mean)
    limit = max(float(np.abs(d).max()) for d in differences)
    for axis, difference in zip(axes[2, 1:], differences, strict=True):
        largest = np.abs(difference).max()
        spheres.show_signed(axis, difference, limit, f"difference: to {largest:.2g} % of mean")
    spheres.show_scale(axes[2, 0], limit, "% of the mean sky")
