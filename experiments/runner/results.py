"""The results that are there: what each run left, and whether it still says what the code does."""

import contextlib
import dataclasses
import functools
import json
import re
import shlex
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from .registry import Entry
from .sources import changed

# A run's own options, which are no overrides of its config.
_VALUED = ("--preset", "--seed", "--data", "--out")
_KINDS = ("paper", "ours", "difference")


@dataclasses.dataclass(frozen=True)
class Shown:
    """A table as `table.md` has it: cells are texts, `groups` what stands above each column."""

    title: str
    heads: list[str]
    groups: list[str]
    cells: list[list[str]]
    note: str


@dataclasses.dataclass(frozen=True)
class Run:
    """Complete results of an experiment."""

    entry: Entry
    preset: str
    folder: Path

    @functools.cached_property
    def rows(self) -> list[dict[str, Any]]:
        """Every recorded row."""
        return [dict(row) for row in _json(self.folder / "metrics.json")]

    @functools.cached_property
    def environment(self) -> dict[str, Any]:
        """What it ran on."""
        return dict(_json(self.folder / "environment.json"))

    @functools.cached_property
    def config(self) -> dict[str, Any]:
        """What it ran with."""
        text = (self.folder / "config.toml").read_text(encoding="utf-8")
        return dict(tomllib.loads(text).get(self.preset, {}))

    @functools.cached_property
    def damage(self) -> str:
        """What in the folder is not what a run writes, or "" where all is, or nothing is there."""
        if not self.folder.exists():
            return ""
        for file, read in _READ.items():
            try:
                read(self)
            except (FileNotFoundError, NotADirectoryError):
                return f"{file} is missing"
            except KeyError as error:
                return f"{file} does not say {error}"
            except (AttributeError, IndexError, OSError, TypeError, ValueError) as error:
                return f"{file} is not what a run writes ({error})"
        return ""

    @functools.cached_property
    def stale(self) -> str:
        """Why the results are not what a run would give now, or "" where nothing says so."""
        ran, wanted = self.config, self.entry.presets.get(self.preset)
        if wanted is None:
            return f"the preset {self.preset!r} is gone"
        if self.overrides:
            return f"settings of its own: {' '.join(self.overrides)}"
        other = [key for key, value in wanted.items() if ran.get(key) != value]
        if other:
            return f"the preset has changed: {', '.join(other)}"
        if "sources" not in self.environment:
            return "it does not say from which code"
        files = changed(self.environment["sources"], self.entry.path.with_suffix(".py"))
        more = f" and {len(files) - 1} more" if len(files) > 1 else ""
        return f"the code has changed: {files[0]}{more}" if files else ""

    @property
    def overrides(self) -> list[str]:
        """The words of its command that change the config."""
        words = iter(shlex.split(self.environment["command"])[5:])
        kept = []
        for word in words:
            if word in _VALUED:
                next(words, None)
            else:
                kept.append(word)
        return kept

    @property
    def seconds(self) -> float:
        return self.environment["seconds"]["total"]

    @property
    def machine(self) -> str:
        """The machine in a line."""
        cpu, device = self.environment["cpu"], self.environment["device"]
        cores = f"{cpu['model']}, {cpu['count']} cores"
        return cores if device["platform"] == "cpu" else f"{device['kind']} ({cores})"

    @property
    def about(self) -> list[str]:
        """Versions, data and time, a fact each."""
        ran = self.environment
        commit = (ran["commit"] or "no commit")[:10] + (", changed" if ran["dirty"] else "")
        return [
            f"jaxsh {ran['versions']['jaxsh'] or 'from the checkout'} ({commit})",
            f"JAX {ran['versions']['jax']}",
            f"Python {ran['python']}",
            ran["dtype"],
            f"seed {ran['seed']}",
            data_of(self.environment),
            f"{ran['seconds']['compile']:.0f} s compiling, {ran['seconds']['run']:.0f} s running",
        ]

    @property
    def date(self) -> str:
        return self.environment["date"][:10]

    @functools.cached_property
    def tables(self) -> list[Shown]:
        return list(_tables((self.folder / "table.md").read_text(encoding="utf-8")))

    @functools.cached_property
    def pictures(self) -> list[tuple[str, Path]]:
        """Caption and file of each picture that is still there."""
        text = (self.folder / "table.md").read_text(encoding="utf-8")
        found = re.findall(r"^!\[(.*)\]\((.+)\)$", text, re.MULTILINE)
        return [(said, self.folder / name) for said, name in found if (self.folder / name).exists()]


# What the report reads of each file.
_READ: dict[str, Callable[[Run], object]] = {
    "metrics.json": lambda run: run.rows,
    "environment.json": lambda run: (
        run.environment["status"],
        (run.overrides, run.machine, run.about, run.date, f"{run.seconds:g}"),
        dict(run.environment.get("sources", {})),
    ),
    "config.toml": lambda run: run.config,
    "table.md": lambda run: (run.tables, run.pictures),
}


def find(entry: Entry, out: Path, preset: str | None = None) -> Run | None:
    """The complete results of `preset`; of "paper", else of the newest, where none is named."""
    wanted = [preset] if preset else list(entry.presets)
    runs = [Run(entry, name, out / entry.name / name) for name in wanted]
    there = [run for run in runs if run.folder.exists() and not run.damage]
    complete = [run for run in there if run.environment["status"] == "complete"]
    return max(
        complete, key=lambda run: (run.preset == "paper", run.environment["date"]), default=None
    )


def damaged(entry: Entry, out: Path) -> list[str]:
    """Each folder whose results cannot be read, and why."""
    runs = [Run(entry, name, out / entry.name / name) for name in entry.presets]
    return [f"{run.folder}: {run.damage}" for run in runs if run.damage]


def _json(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))


def _tables(text: str) -> Iterator[Shown]:
    """The tables of a `table.md`."""
    body = re.split(r"^(?:!\[|```)", text, maxsplit=1, flags=re.MULTILINE)[0]
    for part in re.split(r"^## ", body, flags=re.MULTILINE)[1:]:
        title, *lines = part.splitlines()
        cells = [_cells(line) for line in lines if line.startswith("| ")]
        note = " ".join(line for line in lines if line and not line.startswith("| "))
        if cells:
            if any(len(row) != len(cells[0]) for row in cells):
                raise ValueError(f"rows of several lengths below {title!r}")
            heads, groups = _heads(cells[0])
            yield Shown(title, heads, groups, cells[2:], note)


def _cells(line: str) -> list[str]:
    return [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line)[1:-1]]


def _heads(texts: Sequence[str]) -> tuple[list[str], list[str]]:
    """Headings, and what the paper's, ours and the difference have in common."""
    heads, groups = [], []
    for text in texts:
        group, _, kind = text.rpartition(": ")
        known = kind in _KINDS
        heads.append(kind if known else text)
        groups.append(group if known else "")
    return heads, groups


def in_view(table: Shown, most: int = 6) -> list[bool]:
    """Which columns to show at first: what tells the rows apart, the paper's and ours, then others.

    Sizes that the paper has too come after its results, and what is the same in every row last.
    """
    count = len(table.heads)
    if count <= most:
        return [True] * count
    columns = list(zip(*table.cells, strict=True)) or [()] * count
    varies = [len(set(column)) > 1 for column in columns]
    whole = [all(re.fullmatch(r"–|[+-]?\d+", cell) for cell in column) for column in columns]
    compared = [i for i, group in enumerate(table.groups) if group]
    pairs = [i for i in compared if table.heads[i] != _KINDS[2]]
    shown = _labels(columns, table.groups, varies)
    for wanted in (
        [i for i in pairs if not whole[i + (table.heads[i] == _KINDS[0])]],
        pairs,
        [i for i in compared if varies[i]],
        [i for i in range(count) if varies[i]],
        [i for i in range(count) if not whole[i] and all(map(is_number, columns[i]))],
        range(count),
    ):
        for i in wanted:
            if i not in shown and len(shown) < most:
                shown.append(i)
    return [i in shown for i in range(count)]


def _labels(
    columns: Sequence[Sequence[str]], groups: Sequence[str], varies: list[bool]
) -> list[int]:
    """The columns that tell rows apart: texts of the first ones, and numbers as far as needed."""
    first: list[int] = []
    for i, column in enumerate(columns):
        if groups[i] or (any("." in cell for cell in column) and all(map(is_number, column))):
            break
        first.append(i)
    texts = [i for i in first if varies[i] and not all(map(is_number, columns[i]))]
    labels = texts[:3]
    for i in first:
        told = set(zip(*(columns[k] for k in labels), strict=True))
        if len(labels) < 3 and varies[i] and i not in labels and len(told) < len(columns[i]):
            labels.append(i)
    return labels or [0]


def is_number(cell: str) -> bool:
    """Whether a cell holds a number, or nothing."""
    return cell == "–" or bool(re.fullmatch(r"[+−-]?(\d[\d.,]*(e[+-]?\d+)?|nan|inf)", cell))


def unfinished(entry: Entry, out: Path) -> str:
    """How the last run ended that left no results, or why they cannot be read, or ""."""
    for preset in entry.presets:
        if damage := Run(entry, preset, out / entry.name / preset).damage:
            return f"{preset}, {damage}"
        partial = Run(entry, preset, out / entry.name / f"{preset}.partial")
        if partial.folder.exists():
            with contextlib.suppress(KeyError, OSError, TypeError, ValueError):
                return f"{partial.environment['status']} on {partial.date}"
    return ""


def data_of(run: Mapping[str, Any]) -> str:
    """What it read, without the folder's place."""
    return run["data"] if run["data"].startswith("the ") else "a data folder"


def command_of(run: Mapping[str, Any]) -> str:
    """The line that makes the results, without the folders of whoever made them."""
    words = shlex.split(run["command"])
    for option in ("--out", "--data"):
        if option in words:
            place = words.index(option)
            del words[place : place + 2]
    return shlex.join(words)
