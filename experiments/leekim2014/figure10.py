"""Figure 10: a spinning mesh, what flickers on it, and what hysteresis and windows do about it."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import jax
import numpy as np

from ..runner import Context, Table, experiment
from ..shared.lights import windowed
from ..shared.plots import Panel, animate, draw_panels, plt, save
from .figure1 import BASE
from .pictures import Canvas, Look, evened
from .scenes import Scene, Scenes, rows_or_default
from .spin import Frame, flicker, methods, play, spun

_FILTER, _OURS = "levels", "tiles"
_DEGREE = 6  # where the config names none: below, two stages have nothing between
_DPI = 100

Window = Literal["none", "sinc", "Hann", "dering"]


@dataclasses.dataclass(frozen=True)
class Figure10(Look):
    frames: int = 24
    step: float = 2.0
    """degrees from frame to frame"""
    hysteresis: float = 0.5
    """hysteresis: thresholds of those inside are so many times as high"""
    windows: tuple[Window, ...] = ("none", "sinc", "dering")
    """of the light, against ringing; the first is in the pictures"""
    views: int = 128
    """directions all around that tiles are made for beforehand"""
    sheet: int = 4
    """frames in a row on the sheet"""

    def __post_init__(self):
        super().__post_init__()
        if not 2 <= self.sheet <= self.frames:
            raise ValueError("sheet must be at least 2, frames at least sheet")
        if not self.windows or not 0 < self.hysteresis <= 1 or self.views < 1:
            raise ValueError("windows one or more, hysteresis above 0, at most 1, views at least 1")


@experiment("leekim2014.figure10")
def figure10(config: Figure10, context: Context) -> Table:
    """Temporal change of each method's error while the mesh spins (figure 10)."""
    row = rows_or_default(context, config.rows, _DEGREE)[0]
    scene = Scenes(context, [row], config.directions).load(row)
    angles = np.radians(config.step) * np.arange(config.frames)
    thresholds = {"threshold": config.threshold, "diffuse_threshold": config.diffuse_threshold}
    with context.time("probes, stages and tiles"):
        ways = list(
            methods(scene, thresholds=thresholds, hysteresis=config.hysteresis, views=config.views)
        )
    curves: dict[str, list[dict[str, float]]] = {}
    shown: dict[str, list[Frame]] = {}
    seen: list[Scene] = []
    for window in context.progress(config.windows, "windows"):
        lit = scene._replace(light=windowed(scene.light, window))
        scenes = [spun(lit, angle) for angle in angles]
        full = [jax.block_until_ready(one.full()) for one in scenes]
        seen = seen or scenes
        for method in ways:
            played = play(method, scenes, full)
            lines = flicker(scenes, played)
            context.record({"window": window, "method": method.name} | _summary(lines))
            if window == config.windows[0]:
                curves[method.name] = lines
                if method.name in (_FILTER, _OURS):
                    shown[method.name] = played
    caption = (
        "from frame to frame, under the light as it is: RMS change of the error; the change that "
        "one vertex in a thousand exceeds; and vertices whose region changed"
    )
    _plot(context.path("flicker.png", caption), curves, config.step)
    _pictures(config, context, seen, shown)
    return _table(config, context)


def _summary(lines: list[dict[str, float]]) -> dict[str, float]:
    mean = {
        key: float(np.mean([line[key] for line in lines]))
        for key in ("flicker", "motion", "switched")
        if key in lines[0]
    }
    squares = float(np.mean([line["rms"] ** 2 for line in lines]))
    return mean | {
        "worst": max(line["flicker"] for line in lines),
        "pop": max(line["pop"] for line in lines),
        "psnr": -10 * float(np.log10(max(squares, 1e-30))),
    }


def _plot(path: Path, curves: dict[str, list[dict[str, float]]], step: float) -> None:
    figure, axes = plt.subplots(1, 3, figsize=(12, 4), layout="constrained")
    titles = {
        "flicker": "RMS change of the error",
        "pop": "exceeded by one vertex in 1000",
        "switched": "vertices whose degree changed, %",
    }
    for axis, (key, title) in zip(axes, titles.items(), strict=True):
        for number, (name, lines) in enumerate(curves.items()):
            if key not in lines[0]:
                continue
            angle = step * np.arange(1, len(lines) + 1)
            scale = 100 if key == "switched" else 1
            values = [scale * line[key] for line in lines]
            dashed = "--" if "hysteresis" in name else "-"
            axis.plot(angle, values, dashed, color=f"C{number}", label=name)
        axis.set_title(title, fontsize=11)
        axis.set_xlabel("turned by, degrees")
        axis.grid(alpha=0.3)
        if key == "switched":
            axis.set_ylim(bottom=0)
        else:
            axis.set_yscale("log")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right center", frameon=False)
    save(figure, path, dpi=_DPI)


def _pictures(
    config: Figure10, context: Context, scenes: list[Scene], shown: dict[str, list[Frame]]
) -> None:
    canvases = [Canvas.of(scene, config.size, config.samples) for scene in scenes]
    caption = (
        f"{config.sheet} frames, {config.step:g}° apart: full, the paper's filter and the degree "
        "it takes each vertex to; how its error changes since the frame before, and that of tiles"
    )
    start = (len(scenes) - config.sheet) // 2 + 1
    chosen = range(start, min(start + config.sheet, len(scenes)))
    columns = [list(_column(config, scenes[i], canvases[i], shown, i)) for i in chosen]
    rows = list(zip(*evened(columns), strict=True))
    draw_panels(context.path("frames.png", caption), rows)
    caption = "full, filter, and the errors of filter and tiles, moving"
    moving = [
        evened([list(_moving(config, canvas, shown, i))])[0] for i, canvas in enumerate(canvases)
    ]
    animate(context.path("spin.gif", caption), evened(moving))


def _column(
    config: Figure10, scene: Scene, canvas: Canvas, shown: dict[str, list[Frame]], i: int
) -> Iterator[Panel]:
    now = shown[_FILTER][i]
    yield Panel(canvas.shown(now.full), f"full, {config.step * i:g}°")
    yield Panel(canvas.shown(now.color), "filter")
    assert now.reached is not None
    yield canvas.levels("specular: degree used", now.reached, BASE, scene.row.degree)
    for name, frames in shown.items():
        # As a difference of two colors: the errors' own.
        title = f"{'filter' if name == _FILTER else name}: error's change"
        yield canvas.error(title, frames[i].error, frames[i - 1].error, config.gain)


def _moving(
    config: Figure10, canvas: Canvas, shown: dict[str, list[Frame]], i: int
) -> Iterator[Panel]:
    theirs, ours = shown[_FILTER][i], shown[_OURS][i]
    yield Panel(canvas.shown(theirs.full), "full")
    yield Panel(canvas.shown(theirs.color), "filter")
    for name, frame in (("filter", theirs), ("tiles", ours)):
        yield canvas.error(f"{name}, error", frame.color, frame.full, config.gain)


def _table(config: Figure10, context: Context) -> Table:

    return Table("A spinning mesh", rows=context.rows)
