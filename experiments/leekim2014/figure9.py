"""Figure 9: the base, the full computation, the paper's filter, its regions, and what it misses."""

import dataclasses

from ..runner import Context, Table, experiment
from ..shared.plots import Panel, draw_panels
from . import figure1
from .pictures import Canvas, Look, evened
from .scenes import Scene, Scenes, rows_or_default

_PSNR, _GAIN = 43.87, 3.0  # of the paper's figure 9
_BASE = f"base, degree {figure1.BASE}"


@dataclasses.dataclass(frozen=True)
class Figure9(Look):
    pass


@experiment("leekim2014.figure9")
def figure9(config: Figure9, context: Context) -> Table:
    """Base, full, adaptive, regions by level, and amplified differences (figure 9)."""
    rows = rows_or_default(context, config.rows)
    scenes = Scenes(context, rows, config.directions)
    for row in context.progress(rows, "scenes"):
        scene = scenes.load(row)
        full = scene.full()
        base = figure1.Shading(_BASE, figure1.truncated(scene, figure1.BASE), {})
        by = {one.method: one for one in (base, *figure1.shadings(scene, config))}
        for shading in by.values():
            line = figure1.measured(scene, shading, full)
            if shading.method == figure1.FILTER:
                line |= {"psnr_paper": _PSNR}
            context.record(line)
        name = f"{row.mesh}_{row.environment}.png"
        caption = (
            f"{row.mesh} under {row.environment}: the paper's (a) to (d), with the degree that "
            "each vertex was computed to; below, tiles, and errors, red where brighter than full "
            "and blue where darker"
        )
        _draw(config, context.path(name, caption), scene, full, by)
    return Table(
        "Base, full and adaptive",
        figure1.columns(),
    )


def _draw(config: Figure9, path, scene: Scene, full, by: dict[str, figure1.Shading]) -> None:
    canvas = Canvas.of(scene, config.size, config.samples)
    base, ours, whole, tiles = (
        by[name] for name in (_BASE, figure1.FILTER, figure1.WHOLE, figure1.TILES)
    )
    target = scene.row.degree
    specular, diffuse = (
        canvas.levels(title, ours.reached[kind], figure1.BASE, target)
        for title, kind in (
            ("(d) specular: degree used", "specular"),
            ("diffuse: degree used", "diffuse"),
        )
    )
    above = [
        Panel(canvas.shown(base.color), f"(a) base, degree {figure1.BASE}"),
        Panel(canvas.shown(full), f"(b) full, degree {target}"),
        Panel(canvas.shown(ours.color), "(c) the filter"),
        specular,
        diffuse,
    ]
    below = [
        canvas.error(
            f"{name} less full, {scene.quality(one.color, full).image:.1f} dB",
            one.color,
            full,
            config.gain,
        )
        for name, one in (("base", base), ("filter", ours), ("smoothed", whole), ("tiles", tiles))
    ]
    first = Panel(canvas.shown(tiles.color), "tiles")
    draw_panels(path, evened([above, [first, *below]]))
