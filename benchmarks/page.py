"""``python -m benchmarks.page [FOLDER]``: docs/benchmarks.md and its plots from measured rows.

FOLDER is what ``python -m benchmarks`` wrote, results/benchmarks; its rows are then kept under
benchmarks/measured, from which the page is made where no folder is named.
"""

import json
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("agg")

from matplotlib import pyplot

from experiments.runner import Table
from experiments.runner.report import to_markdown

from . import _sections

ROOT = Path(__file__).parents[1]
MEASURED = Path(__file__).parent / "measured"
# glibc's settings with which a process keeps what it frees.
KEEPING = {
    "MALLOC_ARENA_MAX": "1",
    "MALLOC_MMAP_MAX_": "0",
    "MALLOC_TOP_PAD_": "268435456",
    "MALLOC_TRIM_THRESHOLD_": "2000000000",
}
# A longer table is folded.
_SHORT = 14

Tables = Mapping[str, list[dict[str, Any]]]


def main(arguments: Sequence[str]) -> None:
    """Take the rows of a folder where one is named, and write page and plots."""
    for folder in arguments[:1]:
        for name in ("rows.json", "environment.json"):
            shutil.copyfile(Path(folder) / name, MEASURED / name)
    rows, ran = measured()
    draw(rows, ROOT / "docs" / "images")
    (ROOT / "docs" / "benchmarks.md").write_text(page(rows, ran), "utf-8")


def measured() -> tuple[Tables, dict[str, Any]]:
    """Read the rows that are kept, by section, and what they were measured on."""
    rows, ran = (
        json.loads((MEASURED / name).read_text("utf-8"))
        for name in ("rows.json", "environment.json")
    )
    return rows, ran


def draw(tables: Tables, folder: Path) -> None:
    """Draw the plot of each section that has one."""
    for name, rows in tables.items():
        section = _sections.load(name)
        if section.draw and rows:
            figure = pyplot.figure(figsize=section.size, layout="constrained")
            section.draw(figure, rows)
            figure.savefig(folder / f"benchmarks_{name}.png", dpi=110)
            pyplot.close(figure)


def page(tables: Tables, ran: Mapping[str, Any], images: str = "images") -> str:
    """Write the page: a section each, its plot, what fits at a glance, and all rows."""
    versions = " · ".join(f"{name} {text}" for name, text in ran["versions"].items() if text)
    settings = " ".join(f"{name}={value}" for name, value in KEEPING.items())
    parts = [
        "# Benchmarks",
        "How long things take beside the fastest alternative that there is to each. Ratios are "
        "times of the other over ours, unless a heading says otherwise: above 1 jaxsh is faster.",
        f"*{ran['cpu']['count']} cores of an {ran['cpu']['model']}, {ran['date'][:10]}.*",
        *(part for name in tables for part in _section(name, tables[name], images)),
        "## How it was measured",
        f"```\nmake bench        # {ran['command']}, in an environment of its own\n"
        "python -m benchmarks.page results/benchmarks\n```",
        "`python -m benchmarks --only NAME` runs one section; `--help` says more. Medians over "
        "interleaved rounds, each the fastest of three calls; `one` is pinned to a core, `all` is "
        "free to use every one, wall clock in both. glibc's default allocator gives large freed "
        "buffers back to the system, and the page faults of the next call can cost more than its "
        "work, for ours and for peers, depending on what else the process holds; but where a "
        "section says otherwise it keeps them here, which shows the work itself:",
        f"```\n{settings.replace(' MALLOC_TOP', chr(10) + 'MALLOC_TOP')}\n```",
        f"<sub>{ran['cpu']['model']}, {ran['cpu']['count']} cores · {versions} · commit "
        f"{(ran.get('commit') or 'none')[:10]}</sub>",
    ]
    return "\n\n".join(parts) + "\n"


def _section(name: str, rows: list[dict[str, Any]], images: str) -> Iterator[str]:
    section = _sections.load(name)
    yield f"## {section.title}"
    yield section.intro
    if section.draw and rows:
        yield f"![{section.title}]({images}/benchmarks_{name}.png)"
        rows_by = f"python -m benchmarks --only {name}"
        yield f"*Drawn by `python -m benchmarks.page`; its rows are from `{rows_by}`.*"
    if section.glance:
        yield section.glance(rows).strip()
    columns = section.columns
    if len(section.cores) > 1:
        columns = [_sections.Column("cores", "cores"), *columns]
    heading, *body = to_markdown(Table("", columns, note=section.note), rows).splitlines()
    assert heading.strip() == "##", heading
    text = "\n".join(body).strip()
    yield text if len(rows) <= _SHORT and not section.glance else folded("All rows", text)


def table(heads: Sequence[str], lines: Sequence[Sequence[Any]]) -> str:
    """A table in Markdown; columns of numbers are set flush right."""
    marks = [
        "---:" if lines and str(x)[:1] in "0123456789–" else "---" for x in (lines or [heads])[0]
    ]
    rows = [heads, marks, *lines]
    return "\n".join("| " + " | ".join(map(str, row)) + " |" for row in rows) + "\n"


def matching(rows: list[dict[str, Any]], **wanted: Any) -> list[dict[str, Any]]:
    """Select rows by their values."""
    return [row for row in rows if all(row.get(key) == value for key, value in wanted.items())]


def number(value: Any, digits: int) -> str:
    """A number as the tables show it."""
    return "–" if value is None else f"{value:.{digits}f}"


def folded(title: str, body: str) -> str:
    """A part that opens at a click."""
    return f"<details markdown>\n<summary>{title}</summary>\n\n{body.strip()}\n\n</details>"


if __name__ == "__main__":
    main(sys.argv[1:])
