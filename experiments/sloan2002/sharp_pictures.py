"""The pictures of `sharp`."""

from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxsh import imaging

from ..shared.plots import GROUND, Panel, draw_panels, plain_numbers, plt, save


def draw_comparison(
    path: Path, raster: imaging.Raster, shaded: dict[str, list[Float[np.ndarray, "v 3"]]]
) -> None:
    """Columns: ways of shading by their titles, the reference last. Rows: matte, glossy."""
    rows = []
    for surface, name in enumerate(("matte", "glossy")):
        images = {
            title: imaging.interpolate(raster, jnp.asarray(both[surface]))
            for title, both in shaded.items()
        }
        exposure = imaging.auto_exposure(list(images.values())[-1], raster.mask)
        behind = GROUND * (1 - raster.alpha)[..., None]
        rows.append(
            [
                Panel(
                    np.asarray(imaging.tone_map(exposure * image + behind)),
                    f"{name}, {title}",
                )
                for title, image in images.items()
            ]
        )
    draw_panels(path, rows)


def draw_scan(path: Path, rows: list[dict[str, Any]]) -> None:
    """Error by each option's values: a line for each probe, and their mean."""
    options = list(dict.fromkeys(row["scan"] for row in rows))
    probes = list(dict.fromkeys(row["environment"] for row in rows))
    figure, axes = plt.subplots(
        1, len(options), figsize=(10, 3.8), sharey=True, squeeze=False, layout="constrained"
    )
    for axis, option in zip(axes[0], options, strict=True):
        values = sorted({row["value"] for row in rows if row["scan"] == option})

        def mean(value, among, option=option):
            return np.mean([
                row["scan_error"]
                for row in rows
                if (row["scan"], row["value"]) == (option, value) and row["environment"] in among
            ])  # fmt: skip

        for probe in probes:
            axis.plot(values, [mean(v, [probe]) for v in values], marker="o", label=probe)
        if len(probes) > 1:
            mean_of_all = [mean(v, probes) for v in values]
            axis.plot(values, mean_of_all, color="black", lw=2.5, label="mean")
        axis.set_xscale("log")
        axis.set_yscale("log")
        for each in (axis.xaxis, axis.yaxis):
            plain_numbers(each)
        axis.set_xlabel(option)
        axis.grid(alpha=0.3)
    axes[0, 0].set_ylabel("relative RMS error of shadowed irradiance, %")
    axes[0, -1].legend(frameon=False, fontsize="small")
    save(figure, path, dpi=110)
