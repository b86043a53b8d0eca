"""The paper's choices: threshold, refinement of the regions, smoothing of their edges."""

import dataclasses
from collections.abc import Iterator
from typing import Any, Literal

import numpy as np

from ..runner import Context, Table, experiment
from . import methods as frame
from .plots import draw_thresholds
from .scenes import One, Row, Scene

Filter = Literal["levels", "two_stage"]
Variant = Literal["outside at the base", "4 rings", "refined", "smoothed", "refined, smoothed"]
_EVERYONE = 1 << 20  # rings: more than there are
_PLAIN = "as it is"
_VARIANTS: dict[Variant, dict[str, Any]] = {
    "outside at the base": {"fallback": "base"},
    "4 rings": {"rings": 4},
    "refined": {"rings": _EVERYONE},
    "smoothed": {"smoothing": True},
    "refined, smoothed": {"rings": _EVERYONE, "smoothing": True},
}


@dataclasses.dataclass(frozen=True)
class Threshold(One):
    degree: int = 4
    methods: tuple[Filter, ...] = ("levels", "two_stage")
    variants: tuple[Variant, ...] = tuple(_VARIANTS)
    """beside each method as it is"""
    thresholds: tuple[float, ...] = (0.005, 0.02, 0.08)
    """of specular change; that of diffuse change is half of it, as in the paper"""

    def __post_init__(self):
        super().__post_init__()
        if self.degree < 3:
            raise ValueError(f"degree must be at least 3, got {self.degree}")
        if not self.thresholds or min(self.thresholds) <= 0 or not self.methods:
            raise ValueError("methods must be one or more, and thresholds too, above 0")


@experiment("leekim2014.threshold")
def threshold(config: Threshold, context: Context) -> list[Table]:
    row, scenes = config.open(context, config.degree)
    scene = scenes.load(row)
    for line in _rows(config, context, scene):
        context.record(line)
    caption = "error, share of vertices and gain by threshold; the paper's is marked"
    draw_thresholds(context.path("threshold.png", caption), context.rows)
    return list(_tables(config, context.rows, row))


def _rows(config: Threshold, context: Context, scene: Scene) -> Iterator[dict[str, Any]]:
    full = frame.baselines(scene)
    turning = frame.lights(scene, config.frames)
    for method in config.methods:
        for variant in context.progress((_PLAIN, *config.variants), method):
            options = {} if variant == _PLAIN else _VARIANTS[variant]
            ways = {
                f"{limit}": frame.adaptive_way(
                    scene, method, threshold=limit, diffuse_threshold=limit / 2, **options
                )
                for limit in config.thresholds
            }
            first = frame.warm(context, f"{method}, {variant}", full | ways, scene.light)
            times = frame.seconds(full | ways, turning)
            for limit in config.thresholds:
                result, spent = first[f"{limit}"], times[f"{limit}"]
                quality = scene.quality(frame.color(result), first["full"])
                yield {
                    "method": method,
                    "variant": variant,
                    "threshold": limit,
                    "kept": float(np.ravel(np.asarray(result.active_fraction["specular"]))[-1]),
                    "spent": float(result.relative_cost),
                    "gain": times["full"] / spent,
                    "gain_product": times["product form"] / spent,
                    "gain_einsum": times["einsum"] / spent,
                } | quality.named()


def _tables(config: Threshold, rows: list[dict[str, Any]], row: Row) -> Iterator[Table]:
    yield Table(
        "Variants by threshold",
        rows=rows,
        values={"row": row},
    )
    limit = min(config.thresholds, key=lambda one: abs(one - frame.THRESHOLD))
    choices = list(effects(rows, limit))
    if choices:
        yield Table(
            "What each choice does",
            rows=choices,
            values={"limit": limit},
        )


def effects(rows: list[dict[str, Any]], limit: float) -> Iterator[dict[str, Any]]:
    """Each variant against the plain method at one threshold."""
    at = [row for row in rows if row["threshold"] == limit]
    plain = {row["method"]: row for row in at if row["variant"] == _PLAIN}
    for row in at:
        if row["variant"] == _PLAIN:
            continue
        basis = plain[row["method"]]
        psnr = row["psnr_object"] - basis["psnr_object"]
        judgement = "helps" if psnr > 0.1 else "hurts" if psnr < -0.1 else "changes little"
        yield {
            "method": row["method"],
            "variant": row["variant"],
            "psnr": psnr,
            "time": basis["gain"] / row["gain"],
            "judgement": judgement,
        }
