"""``python -m benchmarks [options]``: writes report.md, rows.json and environment.json."""

import dataclasses
import datetime
import itertools
import json
import os
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import tyro
from tqdm import tqdm

from experiments.runner import Column, Table
from experiments.runner.machine import describe
from experiments.runner.report import to_json, to_markdown, write

# glibc's settings with which a process keeps what it frees.
KEEPING = {
    "MALLOC_ARENA_MAX": "1",
    "MALLOC_MMAP_MAX_": "0",
    "MALLOC_TOP_PAD_": "268435456",
    "MALLOC_TRIM_THRESHOLD_": "2000000000",
}

_BASIS = [
    Column("quantity", "quantity"),
    Column("dtype", "dtype"),
    Column("degree", "degree"),
    Column("count", "N"),
    Column("cores", "cores"),
    Column("allocator", "allocator"),
    Column("ours_ms", "ours, ms", digits=2),
    Column("over_floor", "ours / write floor", digits=1),
    Column("sphericart", "sphericart / ours", digits=2),
    Column("solid", "its solid harmonics / ours", digits=2),
    Column("e3nn", "e3nn / ours", digits=1),
    Column("scipy", "SciPy / ours", digits=0),
    Column("compile_s", "first call, s", digits=2),
]
_LAT_LONG = [
    Column("quantity", "quantity"),
    Column("picture", "picture"),
    Column("degree", "degree"),
    Column("cores", "cores"),
    Column("ours_ms", "separable, ms", digits=2),
    Column("streamed", "streamed / separable", digits=1),
    Column("sphericart", "sphericart + matmul / separable", digits=1),
    Column("compile_s", "first call, s", digits=2),
]
_FIRST_CALL = [
    Column("call", "call"),
    Column("cpu_s", "CPU, s", digits=2),
    Column("wall_s", "wall, s", digits=2),
]
_ERRORS = [
    Column("degree", "degree"),
    Column("ours", "ours"),
    Column("sphericart", "sphericart"),
    Column("e3nn", "e3nn"),
]


@dataclasses.dataclass(frozen=True)
class Options:
    """jaxsh beside its peers, each table interleaved in one process."""

    degrees: tuple[int, ...] = (3, 6, 10, 13)
    """degrees of the basis"""
    counts: tuple[int, ...] = (10_000, 100_000)
    """numbers of directions"""
    dtypes: tuple[Literal["float32", "float64"], ...] = ("float32", "float64")
    """precisions of the basis"""
    cores: tuple[Literal["one", "all"], ...] = ("one", "all")
    """one: pinned to a core; all: free to use every one; wall clock in both"""
    allocators: tuple[Literal["keeping", "default"], ...] = ("keeping",)
    """keeping: freed pages stay with the process; default: as glibc does, for float32 alone"""
    error_degrees: tuple[int, ...] = (6, 10, 13, 20, 30)
    """degrees of the table of float32 errors"""
    rounds: int = 9
    """interleaved rounds per row"""
    out: Path = Path("results/benchmarks")
    """where the report goes"""


def run(options: Options) -> Path:
    """Measure, and return the report's path."""
    names = "basis", "lat_long", "first_call", "errors"
    tables: dict[str, list[dict[str, Any]]] = {name: [] for name in names}
    options.out.mkdir(parents=True, exist_ok=True)
    progress = tqdm(list(_requests(options)), "benchmarks", file=sys.stderr)
    for request in progress:
        progress.set_postfix_str(" ".join(request[k] for k in ("table", "dtype", "cores")))
        for row in _measure(request):
            tables[request["table"]].append(row)
            write(options.out / "rows.json", to_json(tables))
    versions = _versions()
    machine: dict[str, Any] = describe() | {
        "command": f"python -m benchmarks {shlex.join(sys.argv[1:])}".rstrip(),
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
    }
    machine["versions"] |= versions
    write(options.out / "environment.json", to_json(machine))
    facts = [
        f"{machine['cpu']['model']}, {machine['cpu']['count']} cores",
        *(f"{name} {version}" for name, version in versions.items()),
        f"commit {(machine['commit'] or 'none')[:10]}{', changed' if machine['dirty'] else ''}",
    ]
    layout = (
        "Ratios above 1: ours is faster. Ours with `axis=0`. Medians over interleaved rounds, each "
        "the fastest of three calls. glibc's default allocator gives large freed buffers back to "
        "the system, and the page faults of the next call can cost more than its work, for ours "
        "and for peers, depending on what else the process holds; the keeping one "
        f"(`{' '.join(f'{k}={v}' for k, v in KEEPING.items())}`) shows the work itself."
    )
    report = [
        "# Benchmarks\n",
        to_markdown(Table("Basis", _BASIS, note=layout), tables["basis"]),
        to_markdown(Table("Lat-long pictures, float32", _LAT_LONG), tables["lat_long"]),
        to_markdown(
            Table("First call: trace, compile and run, two rows, one core", _FIRST_CALL),
            tables["first_call"],
        ),
        to_markdown(Table("Largest float32 error", _ERRORS), tables["errors"]),
        f"```\n{machine['command']}\n```\n",
        f"<sub>{' · '.join(facts)}</sub>\n",
    ]
    write(options.out / "report.md", "\n".join(report))
    return options.out / "report.md"


def _requests(options: Options) -> Iterator[dict[str, Any]]:
    common = {"rounds": options.rounds}
    for cores, allocator, dtype in itertools.product(
        options.cores, options.allocators, options.dtypes
    ):
        if allocator == "keeping" or dtype == "float32":
            yield common | {
                "table": "basis",
                "cores": cores,
                "allocator": allocator,
                "dtype": dtype,
                "degrees": options.degrees,
                "counts": options.counts,
            }
    lat_long = {"table": "lat_long", "allocator": "keeping", "dtype": "float32", "degrees": [10]}
    for cores in options.cores:
        yield common | lat_long | {"cores": cores}
    first_call = {"table": "first_call", "allocator": "default", "dtype": "float32"}
    yield first_call | {"cores": "one", "rounds": 3, "degrees": [10]}
    errors = {"table": "errors", "allocator": "keeping", "dtype": "float32", "cores": "all"}
    yield common | errors | {"degrees": options.error_degrees}


def _measure(request: dict[str, Any]) -> Iterator[dict[str, Any]]:
    command = [sys.executable, "-m", "benchmarks._child", json.dumps(request)]
    environment = os.environ | (KEEPING if request["allocator"] == "keeping" else {})
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as child:
        assert child.stdout is not None
        yield from map(json.loads, child.stdout)
    if child.returncode:
        raise SystemExit(f"the measurement {request} failed; see above")


def _versions() -> dict[str, str]:
    from importlib.metadata import version

    return {name: version(name) for name in ("jax", "sphericart-jax", "e3nn-jax", "scipy")}


if __name__ == "__main__":
    print(run(tyro.cli(Options, prog="python -m benchmarks")))
