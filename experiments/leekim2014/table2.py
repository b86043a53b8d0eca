"""The paper's table 2 and figure 11: frames per second by degree, and the break-even."""

import dataclasses
from collections.abc import Iterator
from typing import Any

from ..runner import Context, Table, experiment
from ..shared.tables import named
from . import methods as frame
from .columns import IN_FULL, per_method
from .plots import draw_degrees
from .scenes import One, Row, Scene

# By degree: frames per second in full and adaptive, PSNR.
PAPER = {
    2: (120.0, 60.0, 46.72),
    3: (70.3, 56.0, 50.72),
    4: (48.6, 46.1, 45.85),
    5: (31.5, 37.1, 44.29),
    6: (19.8, 30.5, 42.52),
    7: (13.2, 21.4, 43.27),
    8: (8.4, 15.5, 42.86),
    9: (5.9, 12.2, 44.22),
    10: (4.2, 9.3, 44.27),
    11: (3.1, 7.6, 42.80),
    12: (2.3, 5.4, 42.49),
    13: (1.8, 4.1, 42.00),
}
_MODEL = "happy_buddha"
_FULL = "einsum", "product form", "full"


@dataclasses.dataclass(frozen=True)
class Table2(One):
    degrees: tuple[int, ...] = (2, 3, 4, 5)
    methods: tuple[frame.Method, ...] = ("levels", "two_stage", "probes", "tiles")
    frames: int = 5
    """frames of each way, in turns"""

    def __post_init__(self):
        super().__post_init__()
        if not self.degrees or min(self.degrees) < 2:
            raise ValueError("degrees must be one or more, from 2")
        if not self.methods:
            raise ValueError("methods must be one or more")


@experiment("leekim2014.table2")
def table2(config: Table2, context: Context) -> list[Table]:
    row, scenes = config.open(context, max(config.degrees))
    scene = scenes.load(row)
    for degree in context.progress(config.degrees, "degrees"):
        for line in _degree(config, context, scene.cut(degree)):
            context.record(line)
    draw_degrees(
        context.path("figure11.png", "frames per second by degree, and gains"),
        context.rows,
        {d: PAPER[d] for d in config.degrees if d in PAPER} if row.mesh == _MODEL else {},
    )
    return list(_tables(config, context.rows, row))


def _degree(config: Table2, context: Context, scene: Scene) -> Iterator[dict[str, Any]]:
    """A row of the frames, then one of each method's gains and errors."""
    degree = scene.row.degree
    ways = frame.baselines(scene) | {
        name: frame.adaptive_way(scene, name) for name in config.methods
    }
    first = frame.warm(context, f"degree {degree}", ways, scene.light)
    times = frame.seconds(ways, frame.lights(scene, config.frames))
    about = {"degree": degree, "coefficients": (degree + 1) ** 2}
    frames = about | {f"fps {name}": 1 / spent for name, spent in times.items()}
    turned = frame.worst_turns(scene, ways["full"], {name: ways[name] for name in config.methods})
    methods = []
    for method in config.methods:
        quality = scene.quality(frame.color(first[method]), first["full"])
        line = about | {"method": method} | quality.named() | {"psnr_turned": turned[method]}
        line |= {f"gain {name}": times[name] / times[method] for name in _FULL}
        methods.append(line)
        frames[f"psnr {method}"] = quality.image
    if degree in PAPER and scene.row.mesh == _MODEL:
        full, adaptive, psnr = PAPER[degree]
        frames |= {"full_paper": full, "adaptive_paper": adaptive, "psnr_paper": psnr}
        for line in methods:
            if line["method"] == "levels":
                line["gain_paper"] = adaptive / full
    yield frames
    yield from methods


def _tables(config: Table2, rows: list[dict[str, Any]], row: Row) -> Iterator[Table]:
    frames = [line for line in rows if "fps full" in line]
    gains = [line for line in rows if "method" in line]
    about = named("degree", "coefficients")
    yield Table(
        "Frames per second by degree",
        [
            *about,
            *IN_FULL,
            *per_method("fps", config.methods, "adaptive_paper"),
        ],
        frames,
        values={"row": row},
    )
    yield Table(
        "Image PSNR by degree, dB",
        [
            *about,
            *per_method("psnr", config.methods, "psnr_paper"),
        ],
        frames,
    )
    yield Table(
        "Gains by degree",
        rows=gains,
    )
    lines = [
        {"method": method}
        | {name: break_even(gains, method, f"gain {name}") or "never" for name in _FULL}
        | {"paper": 5 if method == "levels" else None}
        for method in config.methods
    ]
    yield Table(
        "Break-even",
        rows=lines,
    )


def break_even(rows: list[dict[str, Any]], method: str, key: str) -> int | None:
    """The lowest degree from which on all gains exceed 1."""
    gains = {row["degree"]: row[key] for row in rows if row.get("method") == method}
    found = None
    for degree in sorted(gains, reverse=True):
        if gains[degree] <= 1:
            break
        found = degree
    return found
