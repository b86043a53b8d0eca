"""Figure 1: the full computation, the paper's filter and its regions; beside them our tiles."""

import dataclasses
from collections.abc import Iterator
from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from jaxsh import harmonics, transfer

from ..runner import Column, Context, Table, experiment
from ..shared.plots import Panel, draw_panels
from ..shared.tables import named
from .methods import adaptive_way
from .pictures import Canvas, Look, evened
from .scenes import Scene, Scenes, rows_or_default

FILTER = "the paper's filter"
WHOLE = "refined and smoothed"
TILES = "tiles"
BASE = 2
_PSNR = 41.73  # of the paper's figure 1


@dataclasses.dataclass(frozen=True)
class Figure1(Look):
    pass


class Shading(NamedTuple):
    """Colors by one method."""

    method: str
    color: Float[Array, "v 3"]
    reached: dict[str, Int[Array, " v"]]  # the degree of each vertex, by kind
    kept: float | None = None  # share of the vertices that are computed to the last degree
    spent: float | None = None  # of the multiply-adds of the full product


@experiment("leekim2014.figure1")
def figure1(config: Figure1, context: Context) -> Table:
    """Full, adaptive, regions and tiles, scene by scene (figure 1)."""
    rows = rows_or_default(context, config.rows)
    scenes = Scenes(context, rows, config.directions)
    panels = []
    for row in context.progress(rows, "scenes"):
        scene = scenes.load(row)
        full = scene.full()
        by = {one.method: one for one in shadings(scene, config)}
        for shading in by.values():
            context.record(measured(scene, shading, full))
        panels.append(list(_panels(config, scene, full, by)))
    caption = (
        "full computation, the paper's filter, the degree it took each vertex's specular part to, "
        "tiles; and the errors of both, red where brighter than full and blue where darker"
    )
    draw_panels(context.path("figure1.png", caption), evened(panels))
    return Table("Against the full computation", columns())


def shadings(scene: Scene, look: Look) -> Iterator[Shading]:
    """By the paper's filter alone and with all that follows it, and by its rivals."""
    thresholds = {"threshold": look.threshold, "diffuse_threshold": look.diffuse_threshold}
    everything = {"fallback": "base", "rings": len(scene.baked.positions), "smoothing": True}
    readings: dict[str, dict[str, Any]] = {FILTER: {}, WHOLE: everything}
    for name, options in readings.items():
        result = adaptive_way(scene, "levels", **thresholds, **options)(scene.light)
        inside = float(jnp.mean(result.shown_degree["specular"] == scene.row.degree))
        yield Shading(name, result.color, result.shown_degree, inside, float(result.relative_cost))
    result = adaptive_way(scene, "tiles")(scene.light)
    yield Shading(TILES, result.color, {}, spent=float(result.relative_cost))
    degree = max(BASE, round(0.7 * scene.row.degree))
    share = _share(degree, scene.row.degree)
    yield Shading(f"everyone at degree {degree}", truncated(scene, degree), {}, spent=share)


def truncated(scene: Scene, degree: int) -> Float[Array, "v 3"]:
    """The full computation at a lower degree: what a method has to beat."""
    light = scene.light[:, : harmonics.num_coefficients(degree)]
    return transfer.shade_glossy(light, scene.baked, scene.eye, scene.material)


def _share(degree: int, target: int) -> float:
    return (harmonics.num_coefficients(degree) / harmonics.num_coefficients(target)) ** 2


def measured(scene: Scene, shading: Shading, full: Float[Array, "v 3"]) -> dict[str, Any]:
    quality = scene.quality(shading.color, full)
    row = scene.row._asdict() | {"vertices": len(full), "method": shading.method}
    row |= {"kept": shading.kept, "spent": shading.spent} | quality.named()
    if shading.method == FILTER:
        row["psnr_paper"] = _PSNR
    return row


def columns() -> list[Column]:
    return [
        Column("environment", "probe"),
        *named("mesh", "degree", "method"),
        Column("kept", "specular at the last degree, share of vertices", digits=2),
        Column("spent", "multiply-adds, share of full", digits=2),
        Column("psnr_image", "PSNR of the picture, dB", paper="psnr_paper", digits=2),
        Column("psnr_object", "of the object's pixels, dB", digits=2),
        Column("psnr_vertex", "of the vertices, dB", digits=2),
    ]


def _panels(config: Figure1, scene: Scene, full, by: dict[str, Shading]) -> Iterator[Panel]:
    canvas = Canvas.of(scene, config.size, config.samples)
    ours, theirs = by[TILES], by[FILTER]
    yield Panel(canvas.shown(full), f"full, degree {scene.row.degree}")
    yield Panel(canvas.shown(theirs.color), f"filter, {_decibels(scene, theirs, full)}")
    reached = theirs.reached["specular"]
    yield canvas.levels("specular: degree used", reached, BASE, scene.row.degree)
    yield Panel(canvas.shown(ours.color), f"tiles, {_decibels(scene, ours, full)}")
    for name, shading in (("filter", theirs), ("tiles", ours)):
        yield canvas.error(f"{name} less full", shading.color, full, config.gain)


def _decibels(scene: Scene, shading: Shading, full: Float[Array, "v 3"]) -> str:
    return f"{scene.quality(shading.color, full).image:.1f} dB"
