"""Taylor order or more samples: what each costs and what it is worth, the paper's open question."""

import dataclasses
import functools
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import jax
from jaxtyping import Array, Float

from jaxsh import midrange, transfer

from ..runner import Column, Context, Table, experiment
from ..shared.lights import exact_light
from ..shared.subjects import Subject, load
from ..shared.tables import named
from ..shared.timing import fastest
from .methods import Trial, expand, inner_grid, take
from .plots import draw_orders
from .scenes import three_lights

_TARGETS = 25, 30, 35, 40, 45, 50, 55, 60
_STAGES = "capture", "project", "shade"


@dataclasses.dataclass(frozen=True)
class Orders:
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    orders: tuple[int, ...] = (0, 1, 2, 3)
    """of the expansions"""
    grids: tuple[int, ...] = (2, 3, 4)
    """samples along each side of a grid, besides a single sample"""
    distance: float = 2.0
    """of the lights from the origin; the meshes have radius 1"""
    side: float = 1.0
    """of the square lights"""
    degree: int = 4
    """of light and transfer"""
    resolution: int = 64
    """texels along a side of a radiance cube's face"""
    directions: int = 1024
    """directions of the bake"""
    rounds: int = 5
    """rounds in which all take turns; the fastest counts"""

    def __post_init__(self):
        if not set(self.orders) <= set(range(4)) or len(self.orders) < 2:
            raise ValueError(f"orders must be two or more of 0 to 3, got {self.orders}")
        if not self.grids or min(self.grids) < 2:
            raise ValueError("grids must be one or more numbers >= 2")
        if self.distance <= 1 or self.side <= 0 or min(self.rounds, self.resolution) < 1:
            raise ValueError("distance above 1, side above 0, rounds and resolution at least 1")


class Layout(NamedTuple):
    """Where samples are taken, and how much each counts at each vertex; none for a single one."""

    points: Float[Array, "s 3"]
    weights: midrange.Weights | None

    def pick(self, expansion: midrange.Expansion) -> midrange.Expansion:
        return take(expansion, 0) if self.weights is None else expansion

    @property
    def rule(self):
        return "full" if self.weights is None else "half"


@experiment("annen2004.orders")
def orders(config: Orders, context: Context) -> list[Table]:
    subject = load(context, config.mesh, config.degree, directions=config.directions)
    lights = three_lights(config.distance, config.side)
    trial = Trial.of(subject, exact_light(lights, subject.mesh.vertices, config.degree))
    layouts = _layouts(config, subject)
    scene = midrange.Scene(lights)
    seconds, cubes = _seconds(config, trial, scene, layouts)
    top = max(config.orders)
    rows: list[dict[str, Any]] = []
    for count, layout in layouts.items():
        sources = {
            "exact": expand(lights, layout.points, config.degree, top),
            "cubes": midrange.taylor(cubes[count], config.degree, top),
        }
        for order in config.orders:
            spent = {"capture": 1e3 * seconds[f"capture {count}"]}
            for stage in _STAGES[1:]:
                spent[stage] = 1e3 * seconds[f"{stage} {count} {order}"]
            row: dict[str, Any] = {"samples": count, "order": order, **spent}
            row["total"] = sum(spent.values())
            for source, expansion in sources.items():
                expansion = layout.pick(expansion.truncated(order))
                row[source] = trial.psnr(trial.shade(expansion, layout.weights, layout.rule))
            rows.append(row)
    for row in rows:
        fronts = {f"front {source}": on_front(row, rows, source) for source in ("exact", "cubes")}
        context.record(row | fronts)
    exact = _per_vertex(config, context, subject, lights)
    caption = (
        "time for capture, projection and shading against PSNR, by order (color) and samples "
        "(number); filled: nothing else is both faster and better. Left, the method's own error; "
        "right, with cubes as captured"
    )
    draw_orders(context.path("orders.png", caption), context.rows, exact)
    return list(_tables(config, context.rows, subject, exact))


def _layouts(config: Orders, subject: Subject) -> dict[int, Layout]:
    layouts = {1: Layout(subject.centroid[None], None)}
    for n in config.grids:
        grid = inner_grid(subject, n)
        layouts[n**3] = Layout(grid.points, grid.weights(subject.baked.positions))
    return layouts


def _seconds(
    config: Orders, trial: Trial, scene: midrange.Scene, layouts: dict[int, Layout]
) -> tuple[dict[str, float], dict[int, midrange.RadianceCube]]:
    """Of each stage, all taking turns; and the cubes."""
    calls: dict[str, Callable[[], Any]] = {}
    cubes = {}
    for count, layout in layouts.items():
        capture = functools.partial(
            midrange.capture, scene, layout.points, config.resolution, progress=False
        )
        cubes[count] = capture()
        calls[f"capture {count}"] = capture
        for order in config.orders:
            taylor = jax.jit(midrange.taylor, static_argnums=(1, 2))
            project = functools.partial(taylor, cubes[count], config.degree, order)
            expansion = layout.pick(project())
            calls[f"project {count} {order}"] = project
            calls[f"shade {count} {order}"] = functools.partial(
                trial.shade, expansion, layout.weights, layout.rule
            )
    return fastest(calls, rounds=config.rounds), cubes


def on_front(row: dict[str, Any], rows: Sequence[dict[str, Any]], key: str) -> bool:
    """Whether no other row is at least as fast and better, or as good and faster."""
    return not any(
        other["total"] <= row["total"]
        and other[key] >= row[key]
        and (other["total"], other[key]) != (row["total"], row[key])
        for other in rows
    )


def _tables(
    config: Orders, rows: list[dict[str, Any]], subject: Subject, exact: float
) -> Iterator[Table]:
    shown = [row | {"front": "yes" if row["front exact"] else ""} for row in rows]
    columns = [
        *named("samples", "order"),
        *(Column(stage, f"{stage}, ms", digits=2) for stage in _STAGES),
        Column("total", "total, ms", digits=2),
        Column("exact", "PSNR, exact terms, dB", digits=1),
        Column("cubes", "PSNR, cubes, dB", digits=1),
        Column("front", "on the front"),
    ]
    yield Table(
        "Cost and error by order and samples",
        columns,
        shown,
        values={"subject": subject},
    )
    yield _cheapest(rows, len(subject.mesh.vertices), exact)


def _cheapest(rows: Sequence[dict[str, Any]], vertices: int, exact: float) -> Table:
    """For each quality the way that takes least time."""
    lines = []
    for target in _TARGETS:
        good = [row for row in rows if row["exact"] >= target]
        if good:
            best = min(good, key=lambda row: row["total"])
            lines.append({"target": target} | best)

    return Table(
        "The cheapest way to a quality",
        rows=lines,
        values={
            "answer": answer(rows),
            "exact": exact,
            "exact_ms": vertices * _one_cube(rows) / 1000.0,
        },
    )


def _one_cube(rows: Sequence[dict[str, Any]]) -> float:
    """Milliseconds to capture and project one, without a gradient."""
    row = min(rows, key=lambda row: (row["samples"], row["order"]))
    return row["capture"] + row["project"]


def _per_vertex(
    config: Orders, context: Context, subject: Subject, lights: Sequence[midrange.Polygon]
) -> float:
    """Milliseconds of the exact light and shading of all vertices."""

    def render(vertices: Array, baked: transfer.Transfer) -> Array:
        return transfer.shade_diffuse(exact_light(lights, vertices, config.degree), baked, 1.0)

    arrays = subject.mesh.vertices, subject.baked
    return 1e3 * context.measure("exact light per vertex", jax.jit(render), *arrays).run_seconds


def answer(rows: Sequence[dict[str, Any]]) -> str:
    """At which order the expansion becomes dearer than more samples, in words, from the numbers."""
    one = {row["order"]: row for row in rows if row["samples"] == 1}
    base = one[min(one)]
    several = min((row for row in rows if row["samples"] > 1), key=lambda row: row["total"])
    prices = ", ".join(
        f"order {order} {row['total'] / base['total']:.2f}"
        for order, row in one.items()
        if row is not base
    )
    projections = ", ".join(
        f"{row['project'] / base['project']:.1f}" for row in one.values() if row is not base
    )
    dearer = [order for order, row in one.items() if row["total"] > several["total"]]
    when = (
        f"from order {min(dearer)} on one sample costs more than {several['samples']} samples"
        if dearer
        else f"no order up to {max(one)} makes one sample dearer than {several['samples']}"
    )
    front = ", ".join(
        f"{row['samples']} × order {row['order']}"
        for row in sorted(rows, key=lambda row: row["total"])
        if row["front exact"]
    )
    return (
        "At which order does the expansion become more expensive than more samples? In samples of "
        f"order {min(one)}, one sample costs: {prices} (its projection alone {projections} times "
        f"as much); {when} of order {several['order']}. On the front, by rising cost: {front}."
    )
