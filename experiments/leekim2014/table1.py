"""The paper's table 1: eight scenes, full and adaptive frames per second, ratios, gains, errors."""

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..runner import Context, Table, experiment
from . import methods as frame
from .moving import moving
from .scenes import PAPER, Row, Scene, Scenes, rows_or_default
from .table1_report import GAIN, tables


@dataclasses.dataclass(frozen=True)
class Table1:
    rows: tuple[tuple[str, str, int], ...] = ()
    """environment, mesh and degree of each row; none means the first of the data, at degree 4"""
    methods: tuple[frame.Method, ...] = frame.METHODS
    frames: int = 9
    """frames of each way, in turns"""
    directions: int = 2048
    """directions of the bake"""
    views: int = 128
    """tilings for the eye that moves"""
    step: float = 2.0
    """of the eye that moves, in degrees a frame"""

    def __post_init__(self):
        if min(self.frames, self.directions, self.views) < 1:
            raise ValueError("frames, directions and views must be at least 1")
        if not self.methods or any(degree < 3 for *_, degree in self.rows):
            raise ValueError("methods must be one or more, and degrees at least 3")


@experiment("leekim2014.table1")
def table1(config: Table1, context: Context) -> list[Table]:
    rows = rows_or_default(context, config.rows)
    scenes = Scenes(context, rows, config.directions)
    for row in context.progress(rows, "scenes"):
        scene = scenes.load(row)
        for line in _scene(config, context, scene):
            context.record(line)
    for row in _one_per_mesh(rows):
        scene = scenes.load(row)
        context.record(moving(context, scene, config.frames, config.views, config.step))
    return list(tables(context.rows, config.methods, config.views, config.step))


def _one_per_mesh(rows: Sequence[Row]) -> list[Row]:
    return list({row.mesh: row for row in reversed(rows)}.values())


def _scene(config: Table1, context: Context, scene: Scene) -> Iterator[dict[str, Any]]:
    adaptive = {method: frame.adaptive_way(scene, method) for method in config.methods}
    lower = frame.truncations(scene)
    multiply, operations = frame.matmul()
    ways = frame.baselines(scene) | frame.still(scene) | frame.diffuse(scene) | adaptive | lower
    ways |= {"matmul": multiply}
    label = " ".join(map(str, scene.row))
    first = frame.warm(context, label, ways, scene.light)
    times = frame.seconds(ways, context.progress(frame.lights(scene, config.frames), label))
    reference = first["full"]
    quality = {
        name: scene.quality(frame.color(result), reference)
        for name, result in first.items()
        if name not in ("matmul", frame.DIFFUSE, frame.EIGHT_BITS)
    }
    rounded = reference + first[frame.EIGHT_BITS] - first[frame.DIFFUSE]
    where = scene.row._asdict()
    vertices, coefficients = scene.baked.coefficients.shape
    rate = operations / times["matmul"]
    flops = frame.product_flops(vertices, coefficients)
    about = where | {
        "vertices": vertices,
        "coefficients": coefficients,
        "gigaflops_matmul": rate / 1e9,
        "share_product": flops / times["product form"] / rate,
        "share_full": flops / times["full"] / rate,
        "full_to_einsum": times["einsum"] / times["full"],
        "largest_difference": max(
            float(jnp.max(jnp.abs(first[name] - reference)))
            for name in ("einsum", "product form", frame.STILL)
        ),
    }
    about |= {f"fps {name}": 1 / times[name] for name in (*GAIN, frame.STILL, *adaptive)}
    about["still_gain"] = times["full"] / times[frame.STILL]
    about |= {f"{name}, ms": 1e3 * times[name] for name in (frame.DIFFUSE, frame.EIGHT_BITS)}
    about["psnr_eight_bits"] = scene.quality(rounded, reference).object
    lighter = times["full"] - times[frame.DIFFUSE] + times[frame.EIGHT_BITS]
    if "masks" in adaptive:
        kept = first["masks"].active_fraction
        about |= {
            f"filtered_{kind}": 1 - float(np.asarray(kept[kind])[-1])
            for kind in ("diffuse", "specular")
        }
        about["filtered_specular_mean"] = 1 - float(np.mean(np.asarray(kept["specular"])))
    yield about | _paper(scene.row)
    truncated = {name: quality[name] for name in lower}
    turned = frame.worst_turns(scene, ways["full"], adaptive)
    for method in adaptive:
        spent = times[method]
        line = where | {
            "method": method,
            "fps": 1 / spent,
            "spent": float(first[method].relative_cost),
        }
        line |= {key: times[name] / spent for name, key in GAIN.items()}
        line["gain_eight_bits"] = lighter / spent
        line |= quality[method].named() | frame.rival(spent, times, truncated)
        line["psnr_turned"] = turned[method]
        paper = PAPER.get(scene.row)
        if paper and method in ("masks", "levels"):
            line["gain_paper"] = paper.gain
        yield line


def _paper(row: Row) -> dict[str, Any]:
    if row not in PAPER:
        return {}
    return {f"{key}_paper": value for key, value in PAPER[row]._asdict().items()}
