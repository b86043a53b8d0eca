"""``python -m benchmarks.page [FOLDER]``: docs/benchmarks.md and its plot from measured rows.

FOLDER is what ``python -m benchmarks`` wrote, results/benchmarks; its rows are then kept under
benchmarks/measured, from which the page is made where no folder is named.
"""

import json
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("agg")

from matplotlib import pyplot

from benchmarks.__main__ import KEEPING

ROOT = Path(__file__).parents[1]
MEASURED = Path(__file__).parent / "measured"
QUANTITIES = {"values": "#0072B2", "with gradient": "#D55E00", "reverse": "#009E73"}
CORES = {"one": "one core", "all": "all cores"}


def main(arguments: Sequence[str]) -> None:
    """Take the rows of a folder where one is named, and write page and plot."""
    for folder in arguments[:1]:
        for name in ("rows.json", "environment.json"):
            shutil.copyfile(Path(folder) / name, MEASURED / name)
    rows = json.loads((MEASURED / "rows.json").read_text("utf-8"))
    ran = json.loads((MEASURED / "environment.json").read_text("utf-8"))
    draw(kept(rows), ROOT / "docs" / "images" / "benchmarks.png")
    (ROOT / "docs" / "benchmarks.md").write_text(page(rows, ran), "utf-8")


def draw(basis: list[dict[str, Any]], path: Path) -> None:
    """Plot sphericart's time over ours by degree, for 10,000 directions."""
    figure, panels = pyplot.subplots(
        1, 2, figsize=(9, 3.6), sharex=True, sharey=True, layout="constrained"
    )
    for axes, dtype in zip(panels, ("float32", "float64"), strict=True):
        axes.axhspan(1, 8, color="#0072B2", alpha=0.06, lw=0)
        axes.axhline(1, color="0.4", lw=1)
        for quantity, color in QUANTITIES.items():
            for cores, style in (("one", "-"), ("all", "--")):
                wanted = {"dtype": dtype, "quantity": quantity, "cores": cores, "count": 10_000}
                points = [(row["degree"], row["sphericart"]) for row in matching(basis, wanted)]
                label = f"{quantity}, {CORES[cores]}" if dtype == "float32" else None
                axes.plot(*zip(*points, strict=True), style, color=color, marker="o", label=label)
        axes.set(title=f"{dtype}, 10,000 directions", xlabel="degree", yscale="log", ylim=(0.12, 6))
        axes.set_xticks(sorted({row["degree"] for row in basis}))
        axes.set_yticks([0.125, 0.25, 0.5, 1, 2, 4], ["⅛", "¼", "½", "1", "2×", "4×"])
        axes.minorticks_off()
        axes.grid(alpha=0.3)
        axes.text(0.02, 0.97, "jaxsh is faster", transform=axes.transAxes, va="top")
        axes.text(0.98, 0.03, "sphericart is faster", transform=axes.transAxes, ha="right")
    panels[0].set_ylabel("time of sphericart over jaxsh's")
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def matching(rows: list[dict[str, Any]], wanted: dict[str, Any]) -> list[dict[str, Any]]:
    """Select rows by their values."""
    return [row for row in rows if all(row[key] == value for key, value in wanted.items())]


def kept(rows: dict[str, list[dict[str, Any]]]) -> list[dict[str, Any]]:
    """Rows of the basis under the allocator that keeps what it frees."""
    return matching(rows["basis"], {"allocator": "keeping"})


def page(rows: dict[str, list[dict[str, Any]]], ran: dict[str, Any]) -> str:
    """Write the page: what fits at a glance, and all rows below, folded."""
    basis = kept(rows)
    versions = " · ".join(f"{name} {text}" for name, text in ran["versions"].items() if text)
    settings = " ".join(f"{name}={value}" for name, value in KEEPING.items())
    at_a_glance = "\n".join(
        f"**{dtype}**\n\n{by_degree(basis, dtype, 'sphericart', 2)}"
        for dtype in ("float32", "float64")
    )
    times = "\n".join(
        f"**{dtype}, ours, ms**\n\n{by_degree(basis, dtype, 'ours_ms', 2)}"
        for dtype in ("float32", "float64")
    )
    peers = table(
        ["quantity", "dtype", "degree", "N", "cores", "e3nn / ours", "SciPy / ours"],
        [
            [*place(row), number(row.get("e3nn"), 1), number(row.get("scipy"), 0)]
            for row in basis
            if "e3nn" in row or "scipy" in row
        ],
    )
    bounds = table(
        ["quantity", "dtype", "degree", "N", "cores", "ours / write floor", "first call, s"],
        [[*place(row), number(row["over_floor"], 1), number(row["compile_s"], 2)] for row in basis],
    )
    timed = ("ours_ms", 2), ("streamed", 1), ("sphericart", 1), ("compile_s", 2)
    pictures = table(
        ["quantity", "cores", "separable, ms", "streamed", "sphericart + matmul", "first call, s"],
        [
            [row["quantity"], row["cores"], *(number(row[key], digits) for key, digits in timed)]
            for row in rows["lat_long"]
        ],
    )
    errors = table(
        ["degree", "ours", "sphericart", "e3nn"],
        [
            [row["degree"], *(error(row[name]) for name in ("ours", "sphericart", "e3nn"))]
            for row in rows["errors"]
        ],
    )
    calls = table(
        ["call", "CPU, s", "wall, s"],
        [
            [row["call"], number(row["cpu_s"], 2), number(row["wall_s"], 2)]
            for row in rows["first_call"]
        ],
    )
    parts = [
        "# Benchmarks",
        "How long the basis takes beside sphericart, whose kernels are in C++, on the same "
        "directions: values alone, values with their gradients, and a gradient by reverse mode.",
        "![sphericart's time over jaxsh's by degree, in float32 and float64: above 1 jaxsh is "
        "faster](images/benchmarks.png)",
        f"*{ran['cpu']['count']} cores of an {ran['cpu']['model']}, {ran['date'][:10]}; drawn by "
        "`python -m benchmarks.page`.*",
        "## Time of sphericart over ours",
        "Above 1 jaxsh is faster.",
        at_a_glance.strip(),
        "## Lat-long pictures",
        "Three channels of 512×256 at degree 10, float32, by separable sums; the others in times "
        "of these.",
        pictures,
        "## Largest float32 error",
        errors,
        *(
            ["## First call: trace, compile and run, two rows, one core", calls]
            if rows["first_call"]
            else []
        ),
        "## All rows",
        folded("Times of ours", times),
        folded("e3nn and SciPy", peers),
        folded("Beside merely writing the result, and the first call", bounds),
        "## How it was measured",
        f"```\nmake bench        # {ran['command']}, in an environment of its own\n"
        "python -m benchmarks.page results/benchmarks\n```",
        "Ours with `axis=0`. Medians over interleaved rounds, each the fastest of three calls; "
        "`one` is pinned to a core, `all` is free to use every one, wall clock in both. glibc's "
        "default allocator gives large freed buffers back to the system, and the page faults of "
        "the next call can cost more than its work, for ours and for peers, depending on what "
        "else the process holds; here it keeps them, which shows the work itself:",
        f"```\n{settings.replace(' MALLOC_TOP', chr(10) + 'MALLOC_TOP')}\n```",
        f"<sub>{ran['cpu']['model']}, {ran['cpu']['count']} cores · {versions} · commit "
        f"{(ran.get('commit') or 'none')[:10]}</sub>",
    ]
    return "\n\n".join(parts) + "\n"


def place(row: dict[str, Any]) -> list[Any]:
    """What a row of the basis is of."""
    return [row["quantity"], row["dtype"], row["degree"], f"{row['count']:,}", row["cores"]]


def by_degree(basis: list[dict[str, Any]], dtype: str, key: str, digits: int) -> str:
    """A row for each quantity, number of directions and cores, a column for each degree."""
    degrees = sorted({row["degree"] for row in basis})
    lines = []
    for quantity in QUANTITIES:
        for count in sorted({row["count"] for row in basis}):
            for cores in CORES:
                wanted = {"dtype": dtype, "quantity": quantity, "count": count, "cores": cores}
                found = {row["degree"]: row.get(key) for row in matching(basis, wanted)}
                if found:
                    shown = [number(found.get(degree), digits) for degree in degrees]
                    lines.append([quantity, f"{count:,}", cores, *shown])
    return table(["quantity", "directions", "cores", f"degree {degrees[0]}", *degrees[1:]], lines)


def table(heads: Sequence[str], lines: Sequence[Sequence[Any]]) -> str:
    """A table in Markdown; columns of numbers are set flush right."""
    marks = [
        "---:" if lines and str(x)[:1] in "0123456789–" else "---" for x in (lines or [heads])[0]
    ]
    rows = [heads, marks, *lines]
    return "\n".join("| " + " | ".join(map(str, row)) + " |" for row in rows) + "\n"


def number(value: Any, digits: int) -> str:
    """A number as the tables show it."""
    return "–" if value is None else f"{value:.{digits}f}"


def error(value: Any) -> str:
    """An error, of two digits."""
    return "NaN" if value is None or value == "NaN" else f"{value:.1e}"


def folded(title: str, body: str) -> str:
    """A part that opens at a click."""
    return f"<details markdown>\n<summary>{title}</summary>\n\n{body.strip()}\n\n</details>"


if __name__ == "__main__":
    main(sys.argv[1:])
