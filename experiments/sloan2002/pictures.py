"""The pictures of `first_light`."""

from pathlib import Path
from typing import Any, NamedTuple

import matplotlib

matplotlib.use("Agg")
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Float
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter
from matplotlib.typing import LineStyleType
from scipy.ndimage import gaussian_filter

from jaxsh import imaging

_DPI = 100
_STYLES: dict[str, LineStyleType] = {"unshadowed": ":", "shadowed": "-"}
_DIMMED = 0.25  # the environment behind the object, so that the object stands out


class Picture(NamedTuple):
    """One mesh under one environment: radiance by variant, black beside the object."""

    mesh: str
    environment: str
    renders: dict[str, Float[np.ndarray, "h w 3"]]
    background: Float[np.ndarray, "h w 3"]
    alpha: Float[np.ndarray, "h w 1"]
    exposure: float

    def shown(self, variant: str) -> Float[np.ndarray, "h w 3"]:
        """Encoded for a screen, before the environment, dimmed and out of focus."""
        blur = len(self.background) / 50
        behind = gaussian_filter(self.background, (blur, blur, 0), mode="nearest")
        free = (1 - self.alpha) * _DIMMED
        return _encoded(self.exposure * (self.renders[variant] + free * behind))

    def difference(self, one: str, other: str, gain: float) -> Float[np.ndarray, "h w 3"]:
        """What one variant has more than the other, times `gain`, before black."""
        return _encoded(gain * self.exposure * (self.renders[one] - self.renders[other]))


def _encoded(linear: Float[np.ndarray, "h w 3"]) -> Float[np.ndarray, "h w 3"]:
    return np.asarray(imaging.tone_map(jnp.asarray(linear)))


def draw_sheet(path: Path, pictures: list[list[Picture]]) -> None:
    """Columns: environments. Rows: meshes."""
    cells = [[picture.shown("one bounce") for picture in row] for row in pictures]
    _draw_cells(path, cells, [picture.environment for picture in pictures[0]])


def draw_variants(path: Path, pictures: list[Picture], gain: float = 4) -> None:
    """Rows: meshes. Columns: variants, and what tells them apart."""
    cells = [
        [
            picture.shown("unshadowed"),
            picture.shown("shadowed"),
            picture.shown("one bounce"),
            picture.difference("unshadowed", "shadowed", 1),
            picture.difference("one bounce", "shadowed", gain),
        ]
        for picture in pictures
    ]
    titles = [
        "unshadowed",
        "shadowed",
        "one bounce",
        "taken by shadows",
        f"added by the bounce, × {gain:g}",
    ]
    _draw_cells(path, cells, titles)


def _draw_cells(path: Path, cells: list[list[np.ndarray]], titles: list[str]) -> None:
    """Pictures of one size side by side, pixel by pixel, a title above each column."""
    height, width, _ = cells[0][0].shape
    rows, columns = len(cells), len(cells[0])
    gap, letter = max(2, width // 80), 0.05 * width
    above = round(2 * letter)
    whole = columns * (width + gap) + gap, above + rows * (height + gap)
    figure = plt.figure(figsize=(whole[0] / _DPI, whole[1] / _DPI), dpi=_DPI)
    for i, row in enumerate(cells):
        for j, cell in enumerate(row):
            left, top = gap + j * (width + gap), above + i * (height + gap)
            figure.figimage(cell, left, whole[1] - top - height, origin="upper")
    for j, title in enumerate(titles):
        centre = (gap + j * (width + gap) + width / 2) / whole[0]
        middle = 1 - above / 2 / whole[1]
        figure.text(centre, middle, title, ha="center", va="center", fontsize=letter * 72 / _DPI)
    figure.savefig(path, dpi=_DPI)
    plt.close(figure)


def draw_errors(path: Path, rows: list[dict[str, Any]]) -> None:
    """Error by degree: a panel for each mesh, a colour for each environment."""
    meshes = list(dict.fromkeys(row["mesh"] for row in rows))
    environments = list(dict.fromkeys(row["environment"] for row in rows))
    figure, axes = plt.subplots(
        1,
        len(meshes),
        figsize=(2.2 + 3.2 * len(meshes), 3.8),
        sharey=True,
        squeeze=False,
        layout="constrained",
    )
    for axis, mesh in zip(axes[0], meshes, strict=True):
        for number, environment in enumerate(environments):
            for variant, style in _STYLES.items():
                key = mesh, environment, variant
                line = [
                    (row["degree"], row["error"])
                    for row in rows
                    if (row["mesh"], row["environment"], row["variant"]) == key
                ]
                axis.plot(*zip(*line, strict=True), style, color=f"C{number}", marker=".")
        axis.set_yscale("log")
        axis.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.yaxis.set_minor_formatter(NullFormatter())
        axis.set_xticks(sorted({row["degree"] for row in rows}))
        axis.set_title(mesh)
        axis.set_xlabel("degree")
        axis.grid(alpha=0.3)
    axes[0, 0].set_ylabel("relative RMS error of irradiance, %")
    handles = [
        *(Line2D([], [], color=f"C{i}", marker=".") for i in range(len(environments))),
        *(Line2D([], [], color="grey", linestyle=style) for style in _STYLES.values()),
    ]
    figure.legend(handles, [*environments, *_STYLES], loc="outside right center", frameon=False)
    figure.savefig(path, dpi=110)
    plt.close(figure)
