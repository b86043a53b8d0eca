"""The lobe's exponent, which the paper does not print, swept: errors and gains of each method."""

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..runner import Context, Table, experiment
from . import methods as frame
from .plots import draw_exponents
from .scenes import One, Scene


@dataclasses.dataclass(frozen=True)
class Exponent(One):
    degree: int = 4
    methods: tuple[frame.Method, ...] = frame.METHODS
    exponents: tuple[float, ...] = (8.0, 32.0, 1000.0)

    def __post_init__(self):
        super().__post_init__()
        if self.degree < 3:
            raise ValueError(f"degree must be at least 3, got {self.degree}")
        if not self.exponents or min(self.exponents) <= 0 or not self.methods:
            raise ValueError("methods must be one or more, and exponents too, above 0")


@experiment("leekim2014.exponent")
def exponent(config: Exponent, context: Context) -> list[Table]:
    row, scenes = config.open(context, config.degree)
    for value in context.progress(config.exponents, "exponents"):
        for line in _rows(config, context, scenes.load(row, exponent=value), value):
            context.record(line)
    caption = "error and gain by the lobe's exponent; a rival without error is left out"
    draw_exponents(context.path("exponent.png", caption), context.rows)
    return [Table("Errors and gains by exponent", values={"row": row})]


def _rows(
    config: Exponent, context: Context, scene: Scene, value: float
) -> Iterator[dict[str, Any]]:
    adaptive = {method: frame.adaptive_way(scene, method) for method in config.methods}
    lower = frame.truncations(scene)
    ways = frame.baselines(scene) | adaptive | lower
    first = frame.warm(context, f"exponent {value:g}", ways, scene.light)
    times = frame.seconds(ways, frame.lights(scene, config.frames))
    reference = first["full"]
    truncated = {name: scene.quality(first[name], reference) for name in lower}
    turned = frame.worst_turns(scene, ways["full"], adaptive)
    for method in adaptive:
        result, spent = first[method], times[method]
        line = {
            "exponent": value,
            "method": method,
            "gain": times["full"] / spent,
            "gain_product": times["product form"] / spent,
            "gain_einsum": times["einsum"] / spent,
        }
        line["kept"] = None
        if "specular" in result.active_fraction:
            line["kept"] = float(np.ravel(np.asarray(result.active_fraction["specular"]))[-1])
        line |= scene.quality(frame.color(result), reference).named()
        line["psnr_turned"] = turned[method]
        yield line | frame.rival(spent, times, truncated)
