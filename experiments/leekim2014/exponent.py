"""The lobe's exponent, which the paper does not print, swept: errors and gains of each method."""

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..runner import Column, Context, Table, experiment
from .methods import (
    METHODS,
    Method,
    adaptive_way,
    baselines,
    color,
    lights,
    rival,
    seconds,
    truncations,
    warm,
)
from .plots import draw_exponents
from .scenes import Row, Scene, Scenes, rows_or_default


@dataclasses.dataclass(frozen=True)
class Exponent:
    environment: str | None = None
    """none means the first of the data"""
    mesh: str | None = None
    """none means the first of the data"""
    degree: int = 4
    methods: tuple[Method, ...] = METHODS
    exponents: tuple[float, ...] = (8.0, 32.0, 1000.0)
    frames: int = 3
    """frames of each, in turns"""
    directions: int = 2048
    """directions of the bake"""

    def __post_init__(self):
        if self.degree < 3 or min(self.frames, self.directions) < 1:
            raise ValueError("degree must be at least 3, frames and directions at least 1")
        if not self.exponents or min(self.exponents) <= 0 or not self.methods:
            raise ValueError("methods must be one or more, and exponents too, above 0")


@experiment("leekim2014.exponent")
def exponent(config: Exponent, context: Context) -> list[Table]:
    [first] = rows_or_default(context, (), config.degree)
    row = Row(config.environment or first.environment, config.mesh or first.mesh, config.degree)
    scenes = Scenes(context, [row], config.directions)
    for value in context.progress(config.exponents, "exponents"):
        for line in _rows(config, context, scenes.load(row, exponent=value), value):
            context.record(line)
    caption = "error and gain by the lobe's exponent; a rival without error is left out"
    draw_exponents(context.path("exponent.png", caption), context.rows)
    return list(_tables(config, context.rows, row))


def _rows(
    config: Exponent, context: Context, scene: Scene, value: float
) -> Iterator[dict[str, Any]]:
    adaptive = {method: adaptive_way(scene, method) for method in config.methods}
    lower = truncations(scene)
    ways = baselines(scene) | adaptive | lower
    first = warm(context, f"exponent {value:g}", ways, scene.light)
    times = seconds(ways, lights(scene, config.frames))
    reference = first["full"]
    truncated = {name: scene.quality(first[name], reference) for name in lower}
    for method in adaptive:
        result, spent = first[method], times[method]
        line = {
            "exponent": value,
            "method": method,
            "gain": times["full"] / spent,
            "gain_product": times["product form"] / spent,
            "gain_einsum": times["einsum"] / spent,
        }
        if "specular" in result.kept:
            line["kept"] = float(np.ravel(np.asarray(result.kept["specular"]))[-1])
        line |= scene.quality(color(result), reference).named()
        yield line | rival(spent, times, truncated)


def _tables(config: Exponent, rows: list[dict[str, Any]], row: Row) -> Iterator[Table]:
    columns = [
        Column("exponent", "exponent"),
        Column("method", "method"),
        Column("psnr_image", "PSNR, dB: image", digits=1),
        Column("psnr_object", "object", digits=1),
        Column("psnr_vertex", "vertices", digits=1),
        Column("gain", "gain against full", digits=2),
        Column("gain_product", "against product form", digits=2),
        Column("gain_einsum", "against einsum", digits=2),
        Column("kept", "share kept", digits=3),
        Column("rival", "truncation at its cost"),
        Column("rival_psnr_object", "its object PSNR", digits=1),
    ]
    if not any("kept" in line for line in rows):
        columns = [column for column in columns if column.key != "kept"]
    yield Table(
        "Errors and gains by exponent",
        columns,
        rows,
        values={"row": row},
    )
