"""From `python` to the first picture of README's example, by parts: cold, and with JAX's cache.

``python -m benchmarks.first_picture [CHECKOUT]`` prints the rows, beside those of another checkout
where one is named.
"""

import functools
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from experiments.runner import Column, Table
from experiments.runner.report import to_markdown

from ._sections import Cores, Rows, Section

_CHECKOUT = Path(__file__).parents[1]
_CHILD = Path(__file__).with_name("_picture_child.py")
_SUM = "in all"


def timings(
    cores: Cores, rounds: int, dtype: str, beside: Path | None = None
) -> Iterator[dict[str, Any]]:
    """One row per part, medians over the rounds, and one of their sum.

    Each round is a process without the persistent cache, and one with all programs in it; with a
    folder `beside`, also one without cache of the package in it.
    """
    with tempfile.TemporaryDirectory() as cache:
        ways = {
            "cold": functools.partial(_measured, _CHECKOUT, None),
            "cached": functools.partial(_measured, _CHECKOUT, cache),
        }
        if beside:
            ways["beside"] = functools.partial(_measured, beside, None)
        for way in ways.values():  # fills the cache, writes bytecode
            way()
        found = [{name: way() for name, way in ways.items()} for _ in range(min(rounds, 3))]
    names = [row["part"] for row in found[0]["cold"]]
    sums = {"part": _SUM}
    for i, name in enumerate(names):
        row: dict[str, Any] = {"part": name, "programs": found[0]["cold"][i]["programs"]}
        row["cpu_s"] = statistics.median(one["cold"][i]["cpu_s"] for one in found)
        for way in ways:
            row[f"{way}_s"] = statistics.median(one[way][i]["wall_s"] for one in found)
        sums |= {key: sums.get(key, 0) + value for key, value in row.items() if key != "part"}
        yield row
    yield sums


def _measured(checkout: Path, cache: str | None) -> Rows:
    environment = {k: v for k, v in os.environ.items() if not k.startswith("JAX_")}
    environment |= {"PYTHONPATH": str(checkout), "PYTHONDONTWRITEBYTECODE": ""}
    if cache:
        environment |= {
            "JAX_COMPILATION_CACHE_DIR": cache,
            "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
        }
    command = [sys.executable, str(_CHILD), repr(time.time())]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stderr)
    return json.loads(done.stdout)


def draw(figure: Figure, rows: Rows) -> None:
    """Draw the parts of a cold start beside those of one with the cache."""
    axes = figure.subplots()
    parts = [row for row in rows if row["part"] != _SUM]
    places = range(len(parts))
    for shift, way, color in ((-0.2, "cold_s", "tab:red"), (0.2, "cached_s", "tab:blue")):
        total = sum(row[way] for row in parts)
        label = f"{way.removesuffix('_s')}: {total:.1f} s"
        axes.barh(
            [p + shift for p in places], [row[way] for row in parts], 0.4, color=color, label=label
        )
    axes.set_yticks(places, [row["part"] for row in parts])
    axes.invert_yaxis()
    axes.set_xlabel("seconds of wall time")
    axes.legend(loc="lower right")


SECTION = Section(
    name="first_picture",
    title="The first picture",
    intro=(
        "Seconds of wall time from `python` to the first picture of README's example, by parts: "
        "cold, and with JAX's persistent cache filled by a run before "
        "([how to](how-to/persistent-cache.md))."
    ),
    columns=[
        Column("part", "part"),
        Column("cold_s", "cold, s", digits=2),
        Column("cached_s", "cached, s", digits=2),
        Column("cpu_s", "cold, CPU, s", digits=2),
        Column("programs", "programs"),
    ],
    timings=timings,
    draw=draw,
    cores=("all",),
    keeps_memory=False,
)

if __name__ == "__main__":
    other = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    measured = list(timings("all", 3, "float32", other))
    shown = [*SECTION.columns]
    if other:
        shown.insert(1, Column("beside_s", f"{other.name}, cold, s", digits=2))
    print(to_markdown(Table(SECTION.title, shown), measured))
