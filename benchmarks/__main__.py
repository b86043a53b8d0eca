"""``python -m benchmarks [options]``: writes report.md, plots, rows.json and environment.json."""

import dataclasses
import datetime
import itertools
import json
import os
import shlex
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import tyro
from tqdm import tqdm

from experiments.runner.machine import describe
from experiments.runner.report import to_json, write

from . import _sections, page

# glibc's settings with which a process keeps what it frees.
KEEPING = page.KEEPING


@dataclasses.dataclass(frozen=True)
class Options:
    """jaxsh beside its peers, each table interleaved in one process."""

    only: tuple[str, ...] = _sections.NAMES
    """the sections to run"""
    cores: tuple[_sections.Cores, ...] = ("one", "all")
    """one: pinned to a core; all: free to use every one; wall clock in both"""
    allocator: Literal["keeping", "default"] = "keeping"
    """keeping: freed pages stay with the process, where a section has it so; default: as glibc"""
    rounds: int = 5
    """interleaved rounds per row"""
    out: Path = Path("results/benchmarks")
    """where the report goes"""


def run(options: Options) -> Path:
    """Measure, and return the report's path."""
    if unknown := set(options.only) - set(_sections.NAMES):
        there = ", ".join(_sections.NAMES)
        raise SystemExit(f"no section {', '.join(sorted(unknown))}: there are {there}")
    tables: dict[str, list[dict[str, Any]]] = {name: [] for name in options.only}
    options.out.mkdir(parents=True, exist_ok=True)
    progress = tqdm(list(_requests(options)), "benchmarks", file=sys.stderr)
    for request in progress:
        progress.set_postfix_str(" ".join(request[k] for k in ("section", "dtype", "cores")))
        for row in _measure(request, options.allocator):
            tables[request["section"]].append(row)
            write(options.out / "rows.json", to_json(tables))
    machine: dict[str, Any] = describe() | {
        "command": f"python -m benchmarks {shlex.join(sys.argv[1:])}".rstrip(),
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
    }
    peers = {peer for name in tables for peer in _sections.load(name).peers}
    machine["versions"] |= {name: version(name) for name in ("jax", *sorted(peers))}
    write(options.out / "environment.json", to_json(machine))
    page.draw(tables, options.out)
    write(options.out / "report.md", page.page(tables, machine, images="."))
    return options.out / "report.md"


def _requests(options: Options) -> Iterator[dict[str, Any]]:
    for name in options.only:
        section = _sections.load(name)
        cores = [some for some in section.cores if some in options.cores]
        for some, dtype in itertools.product(cores, section.dtypes):
            yield {"section": name, "cores": some, "dtype": dtype, "rounds": options.rounds}


def _measure(request: dict[str, Any], allocator: str) -> Iterator[dict[str, Any]]:
    command = [sys.executable, "-m", "benchmarks._child", json.dumps(request)]
    keeps = allocator == "keeping" and _sections.load(request["section"]).keeps_memory
    environment = os.environ | (KEEPING if keeps else {})
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as child:
        assert child.stdout is not None
        yield from map(json.loads, child.stdout)
    if child.returncode:
        raise SystemExit(f"the measurement {request} failed; see above")


if __name__ == "__main__":
    print(run(tyro.cli(Options, prog="python -m benchmarks")))
