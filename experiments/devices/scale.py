"""What a bake costs on one process and on a cluster of them, and where that ends.

Work on the machine by others lowers rates: ratios are of rounds in which all take turns.
"""

import dataclasses
import math
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from jaxsh import geometry, transfer

from ..runner import Context, Table, experiment
from ..shared.process import cores, peak_gigabytes
from .workers import (
    Counting,
    cpu_seconds,
    folder_bytes,
    in_a_process,
    processes,
    read_seconds,
    tasks_per_second,
)

_BILLION = 10**9
_BLOCK = 32_768  # vertices of a block of a mesh so large
_LEAST = 1e-3  # GB or seconds that can be told from none


@dataclasses.dataclass(frozen=True)
class Config:
    vertices: int = 100_000
    """of the mesh that a process bakes in weak scaling, and half of that of strong scaling"""
    degree: int = 6
    directions: int = 512
    workers: int = 2
    """worker processes, of one thread each"""
    rounds: int = 1
    """rounds in which all take turns; the fastest counts"""
    large: int = 1_000_000
    """vertices of the large mesh"""
    lights: int = 5
    """that shade the large mesh at once"""
    tasks: int = 5000
    """empty tasks that tell the scheduler's limit"""
    memory: float = 256.0
    """of a machine on paper, in GB"""

    def __post_init__(self):
        if min(self.vertices, self.large) < 300:
            raise ValueError("vertices and large must be at least 300")
        if min(self.workers, self.rounds, self.lights, self.tasks, self.directions) < 1:
            raise ValueError("workers, rounds, lights, tasks and directions must be at least 1")
        if self.memory <= 0:
            raise ValueError("memory must be above 0")


@experiment("scale")
def scale(config: Config, context: Context) -> list[Table]:
    """Time bakes on processes, one large bake and its shading, and empty tasks."""
    with tempfile.TemporaryDirectory(dir=context.folder) as folder:
        place = Path(folder)
        rays, rate = _scaling(config, context, place)
        large = _large(config, context, place, rays)
    with processes(config.workers) as client:
        tasks = tasks_per_second(client, config.tasks)
    context.record({"kind": "scheduler", "what": "empty tasks", "value": tasks, "unit": "1/s"})
    own = [row for row in context.rows if row["kind"] in ("large", "scheduler")]
    scaling = [row for row in context.rows if row["kind"] == "scaling"]
    values = {"rays_per_vertex": rays, "cores": cores()}
    return [
        Table("Scaling", rows=scaling, values=values),
        Table("A large mesh", rows=own, values={"workers": config.workers}),
        *_on_paper(config, context, rays, rate, tasks, large),
    ]


def _scaling(config: Config, context: Context, folder: Path) -> tuple[float, float]:
    """Record times of all ways; gives rays of a vertex, and rays per second of a thread."""
    one, several = geometry.knot(config.vertices), geometry.knot(config.vertices * config.workers)
    bake: dict[str, Any] = {"degree": config.degree, "directions": config.directions}
    bake |= {"seed": context.seed, "progress": False}
    scene = Counting(geometry.ray_scene(several))
    with processes(1) as single, processes(config.workers) as cluster:
        ways = {
            "one process": (None, several, cores()),
            "strong, 1": (single, several, 1),
            "strong, all": (cluster, several, config.workers),
            "weak, 1": (single, one, 1),
        }
        for name in ("strong, 1", "strong, all"):  # start and compile
            transfer.bake_on(ways[name][0], geometry.knot(300), store=folder / name, **bake)
        transfer.bake(geometry.knot(300), store=folder / "alone", **bake)
        taken: dict[str, list[float]] = {name: [] for name in ways}
        spent: dict[str, list[float]] = {name: [] for name in ways}
        for turn in context.progress(range(config.rounds), "rounds"):
            for name, (client, mesh, _) in ways.items():
                store = folder / f"{name} {turn}"
                busy, start = -cpu_seconds(client), time.perf_counter()
                if client is None:
                    transfer.bake(mesh, store=store, **bake)
                else:
                    transfer.bake_on(client, mesh, store=store, **bake)
                taken[name].append(time.perf_counter() - start)
                spent[name].append(busy + cpu_seconds(client))
        transfer.bake(several, scene=scene, **bake)  # apart, since to count takes time
    rays = scene.rays / len(several.vertices)
    seconds = {name: min(times) for name, times in taken.items()}
    alone = len(several.vertices) * rays / seconds["one process"]
    weak = {"weak, all": ways["strong, all"]}  # the same run, seen with the mesh of one process
    for name, (_, mesh, count) in (ways | weak).items():
        way = name if name in seconds else "strong, all"
        took = seconds[way]
        rate = len(mesh.vertices) * rays / took
        row = {"kind": "scaling", "what": name.partition(",")[0], "processes": count}
        if name == "one process":
            row |= {"processes": 1}
        row |= {"vertices": len(mesh.vertices), "seconds": took, "rays_per_second": rate / 1e6}
        row |= {"cpu": 1e6 * min(spent[way]) / len(mesh.vertices)}
        context.record(row | {"relative": 100 * rate / alone})
    ratio = statistics.median(
        a / b for a, b in zip(taken["one process"], taken["strong, all"], strict=True)
    )
    context.record(
        {
            "kind": "large",
            "what": f"rays/s of {config.workers} processes over those of one, median of rounds",
            "value": ratio,
            "unit": "",
        }
    )
    return rays, len(several.vertices) * rays / seconds["strong, all"] / config.workers


class PerVertex(NamedTuple):
    """What a vertex of the large mesh takes: in GB, and in seconds before the first block."""

    store: float
    worker: float
    client: float
    serial: float


def _large(config: Config, context: Context, folder: Path, rays: float) -> PerVertex:
    """Bake and shade the large mesh; gives what the model takes from it."""

    def note(what: str, value: float, unit: str) -> float:
        context.record({"kind": "large", "what": what, "value": value, "unit": unit})
        return value

    bake: dict[str, Any] = {"degree": config.degree, "directions": config.directions}
    bake |= {"seed": context.seed, "progress": False}
    # In a process of its own: what this one did before would count as the client's memory.
    sizes = {"small": 300, "large": config.large}
    small, run = in_a_process(timed_bakes, config.workers, sizes, folder, bake)
    path, count = folder / "large", run.vertices
    stored = transfer.open(path)
    note("seconds", run.seconds, "s")
    note("of them before the first block is written", run.serial, "s")
    note("rays", count * rays / 1e9, "10⁹")
    note("rays per second", count * rays / run.seconds / 1e6, "10⁶/s")
    note("peak memory of a worker", run.worker, "GB")
    note("peak memory of a worker for a mesh of 300", small.worker, "GB")
    note("peak memory of the client", run.client, "GB")
    note("peak memory of the client for a mesh of 300", small.client, "GB")
    size = note("bytes of the store", folder_bytes(path) / 1e9, "GB")
    coefficients = folder_bytes(path / "coefficients")
    note("of them coefficients", coefficients / 1e9, "GB")
    light = np.random.default_rng(context.seed).normal(
        size=(config.lights, 1, 3, (config.degree + 1) ** 2)
    )
    light = light.astype(np.float32)
    shading, reading = [], []
    for _ in range(3):
        start = time.perf_counter()
        transfer.shade_diffuse(light, stored, 0.5)
        shading.append(time.perf_counter() - start)
        reading.append(read_seconds(path / "coefficients"))
    note(f"shading by {config.lights} lights, rate", coefficients / min(shading) / 1e9, "GB/s")
    note("reading of its files, rate", coefficients / min(reading) / 1e9, "GB/s")
    note(
        "shading over reading, median of rounds",
        statistics.median(a / b for a, b in zip(reading, shading, strict=True)),
        "",
    )
    return PerVertex(
        store=size / count,
        # A mesh of some thousand vertices is lost in the noise: then the least there is.
        worker=max(run.worker - small.worker, _LEAST) / count,
        client=max(run.client - small.client, _LEAST) / count,
        serial=max(run.serial - small.serial, _LEAST) / count,
    )


class Run(NamedTuple):
    """A bake on a cluster: its seconds, and the most memory in GB of a worker and of the client."""

    vertices: int
    seconds: float
    serial: float  # before the first block was written
    worker: float
    client: float


def timed_bakes(
    workers: int, sizes: dict[str, int], folder: Path, bake: dict[str, Any]
) -> list[Run]:
    """Bake knots, the smaller first: a worker's peak is of all that it did."""
    with processes(workers) as client:
        transfer.bake_on(client, geometry.knot(300), store=folder / "first", **bake)  # compiles
        return [_timed_bake(client, size, folder / name, bake) for name, size in sizes.items()]


def _timed_bake(client: Any, vertices: int, path: Path, bake: dict[str, Any]) -> Run:
    mesh = geometry.knot(vertices)
    peak_gigabytes(fresh=True)  # to make the mesh took memory too
    start, called = time.perf_counter(), time.time()
    transfer.bake_on(client, mesh, store=path, **bake)
    seconds = time.perf_counter() - start
    own, worker = peak_gigabytes(), max(client.run(peak_gigabytes).values())
    written = min(file.stat().st_mtime for file in (path / "coefficients" / "c").glob("*/0"))
    return Run(len(mesh.vertices), seconds, written - called, worker, own)


def _on_paper(
    config: Config, context: Context, rays: float, rate: float, tasks: float, large: PerVertex
) -> list[Table]:
    """Say what a billion vertices would take, by the number of threads, and where that ends."""
    each = _BLOCK * rays / rate  # seconds of a block
    for threads in (2, 16, 128, 1024, 8192):
        busy = threads / each
        context.record(
            {
                "kind": "paper",
                "threads": threads,
                "hours": _BILLION * rays / rate / threads / 3600,
                "serial": _BILLION * large.serial / 3600,
                "tasks_per_second": busy,
                "share": 100 * busy / tasks,
            }
        )
    values = {
        "rays": _BILLION * rays,
        "store": _BILLION * large.store,
        "blocks": math.ceil(_BILLION / _BLOCK),
        "rate": rate / 1e6,
        "tasks": tasks,
    }
    paper = [row for row in context.rows if row["kind"] == "paper"]
    threads = {
        "the client's part takes as long as the rays": rays / rate / large.serial,
        "the scheduler hands out no more blocks": tasks * each,
    }
    vertices = {
        f"{name} holds {config.memory:g} GB": config.memory / size / 1e6
        for name, size in (("the client", large.client), ("a worker process", large.worker))
    }
    for unit, ends in (("threads", threads), ("million vertices", vertices)):
        for what in sorted(ends, key=ends.__getitem__):
            context.record({"kind": "end", "what": what, "value": ends[what], "unit": unit})
    ends = [row for row in context.rows if row["kind"] == "end"]
    needs = {"client": _BILLION * large.client, "worker": _BILLION * large.worker}
    return [
        Table("On paper: a billion vertices", rows=paper, values=values),
        Table("Where it ends", rows=ends, values=needs),
    ]
