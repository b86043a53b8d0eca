"""Figure 8: diffuse light level by level, and what has changed since the base."""

import dataclasses
from collections.abc import Iterator
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import adaptive, harmonics, transfer

from ..runner import Context, Table, experiment
from ..shared.plots import Bar, Panel, draw_panels
from .pictures import Canvas, Look, evened
from .scenes import ALBEDO, Scene, Scenes, rows_or_default

_BASE = 2
_QUANTILE = 0.99  # of the change that gets the strongest color


@dataclasses.dataclass(frozen=True)
class Figure8(Look):
    shown: tuple[int, ...] = ()
    """degrees in the picture, above 2; none means all"""

    def __post_init__(self):
        super().__post_init__()
        if self.shown and min(self.shown) <= _BASE:
            raise ValueError(f"shown degrees must be above the base, {_BASE}, got {self.shown}")


class Level(NamedTuple):
    """Diffuse colors to one degree, and what they have gained over the base."""

    degree: int
    color: Float[Array, "v 3"]
    change: Float[Array, "v 3"]


@experiment("leekim2014.figure8")
def figure8(config: Figure8, context: Context) -> list[Table]:
    """Diffuse light, accumulated difference and region of interest, by level (figure 8)."""
    rows = rows_or_default(context, config.rows)
    scenes = Scenes(context, rows, config.directions)
    for row in context.progress(rows, "scenes"):
        scene = scenes.load(row)
        levels = list(_levels(scene))
        kept = _kept(scene, config)
        for level in levels[1:]:
            context.record(_row(scene, level, levels[-1], kept[level.degree], config))
        name = f"{row.mesh}_{row.environment}.png"
        limit = _limit(levels[-1])
        caption = (
            f"{row.mesh} under {row.environment}: diffuse light to each degree; its accumulated "
            f"change since degree {_BASE}, from blue, -{limit:.2g}, to red, +{limit:.2g}, in "
            f"exposed linear color; bright, who is still inside at threshold "
            f"{config.diffuse_threshold:g}"
        )
        _draw(config, context.path(name, caption), scene, levels, limit)
    return [_table(config, context.rows)]


def _levels(scene: Scene) -> Iterator[Level]:
    base = _diffuse(scene, _BASE)
    for degree in range(_BASE, scene.row.degree + 1):
        color = _diffuse(scene, degree)
        yield Level(degree, color, color - base)


def _diffuse(scene: Scene, degree: int) -> Float[Array, "v 3"]:
    light = scene.light[:, : harmonics.num_coefficients(degree)]
    return transfer.shade_diffuse(light, scene.baked, ALBEDO)


def _kept(scene: Scene, config: Figure8) -> dict[int, float]:
    """Shares that the paper's filter keeps after each level."""
    frame = scene.light, scene.baked, scene.eye, scene.material
    method = adaptive.Levels(diffuse_threshold=config.diffuse_threshold)
    result = adaptive.shade(*frame, method)
    shares = np.asarray(result.active_fraction["diffuse"])
    return dict(zip(range(_BASE + 1, scene.row.degree + 1), map(float, shares), strict=True))


def _largest(level: Level) -> Float[Array, " v"]:
    """The change that the filter tests."""
    return jnp.max(jnp.abs(level.change), axis=1)


def _limit(level: Level) -> float:
    return float(jnp.quantile(_largest(level), _QUANTILE))


def _row(scene: Scene, level: Level, last: Level, kept: float, config: Figure8) -> dict[str, Any]:
    left = last.color - level.color
    return scene.row._asdict() | {
        "level": level.degree,
        "rms": float(jnp.sqrt(jnp.mean(level.change**2))),
        "left": float(jnp.sqrt(jnp.mean(left**2))),
        "darker": float(jnp.mean(jnp.mean(level.change, axis=1) < 0)),
        "above": float(jnp.mean(_largest(level) >= config.diffuse_threshold)),
        "kept": kept,
    }


def _draw(config: Figure8, path, scene: Scene, levels: list[Level], limit: float) -> None:
    canvas = Canvas.of(scene, config.size, config.samples)
    base, *others = levels
    shown = [level for level in others if not config.shown or level.degree in config.shown]
    inside = _regions(others, config.diffuse_threshold)
    diffuse = [Panel(canvas.shown(base.color), f"degree {_BASE}, the base")]
    bar = Bar.signed("change, white is 1", limit, extend=True)
    change = [canvas.signed("change since the base", jnp.zeros(len(base.color)), bar)]
    everyone = jnp.ones(len(base.color), bool)
    region = [canvas.region("100 % inside", everyone)]
    for level in shown:
        diffuse.append(Panel(canvas.shown(level.color), f"degree {level.degree}"))
        # The mean over the channels: the largest one's sign would jump.
        mean = jnp.mean(level.change, axis=1)
        change.append(canvas.signed(f"degree {level.degree} less {_BASE}", mean, bar))
        share = float(jnp.mean(inside[level.degree]))
        region.append(canvas.region(f"{100 * share:.0f} % inside", inside[level.degree]))
    draw_panels(path, evened([diffuse, change, region]))


def _regions(levels: list[Level], threshold: float) -> dict[int, Array]:
    """Who is inside after each level: nobody comes back."""
    inside, regions = True, {}
    for level in levels:
        inside = inside & (_largest(level) >= threshold)
        regions[level.degree] = inside
    return regions


def _table(config: Figure8, rows: list[dict[str, Any]]) -> Table:

    return Table("Diffuse light by level", rows=rows)
