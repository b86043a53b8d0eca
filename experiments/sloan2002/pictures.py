"""The pictures of `first_light`."""

from pathlib import Path
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from matplotlib.lines import Line2D
from matplotlib.typing import LineStyleType
from scipy.ndimage import gaussian_filter

from jaxsh import imaging

from ..shared.plots import Panel, curve, draw_panels, plain_numbers, plt, save

# By variant and by what of a row.
_STYLES: dict[tuple[str, str], LineStyleType] = {
    ("unshadowed", "error"): ":",
    ("shadowed", "error"): "-",
    ("shadowed", "error_split"): "--",
}
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
            picture.shown("ringing"),
        ]
        for picture in pictures
    ]
    titles = [
        "unshadowed",
        "shadowed",
        "one bounce",
        "taken by shadows",
        f"added by the bounce, × {gain:g}",
        "shadowed, all by harmonics",
    ]
    _draw_cells(path, cells, titles)


def _draw_cells(path: Path, cells: list[list[np.ndarray]], titles: list[str]) -> None:
    """Draw pictures of one size side by side, a title above each column."""
    rows = [[Panel(cell) for cell in row] for row in cells]
    rows[0] = [Panel(cell, title) for cell, title in zip(cells[0], titles, strict=True)]
    draw_panels(path, rows, ground=1.0, letters="black")


def draw_errors(path: Path, rows: list[dict[str, Any]]) -> None:
    """Error by degree: a panel for each mesh, a color for each environment."""
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
            for (variant, error), style in _STYLES.items():
                about = {"mesh": mesh, "environment": environment, "variant": variant}
                line = curve(rows, "degree", error, **about)
                axis.plot(*line, style, color=f"C{number}", marker=".")
        axis.set_yscale("log")
        plain_numbers(axis.yaxis)
        axis.set_xticks(sorted({row["degree"] for row in rows}))
        axis.set_title(mesh)
        axis.set_xlabel("degree")
        axis.grid(alpha=0.3)
    axes[0, 0].set_ylabel("relative RMS error of irradiance, %")
    handles = [
        *(Line2D([], [], color=f"C{i}", marker=".") for i in range(len(environments))),
        *(Line2D([], [], color="grey", linestyle=style) for style in _STYLES.values()),
    ]
    styles = ["unshadowed", "shadowed", "shadowed, suns split"]
    figure.legend(handles, [*environments, *styles], loc="outside right center", frameon=False)
    save(figure, path, dpi=110)
