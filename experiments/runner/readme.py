"""Keep the figures and pictures of README.md those of the results.

``summary.md`` holds its blocks with places for numbers, ``summary.json`` each number with the run
that it is from. Numbers of results that are not at hand stay as they were. Those of "benchmarks"
are read where ``python -m benchmarks.page`` keeps the measured rows.
"""

import datetime
import hashlib
import itertools
import json
import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .errors import UserError
from .places import Place
from .report import to_json, write
from .results import command_of
from .sources import ROOT

_HERE = ROOT / "experiments"
_BENCHMARKS = "benchmarks"
_BLOCK = re.compile(r"(<!-- block (\w+)[^\n]*-->\n).*?(<!-- end -->)", re.DOTALL)
_PLACE = re.compile(r"\{([^{}|]+\|[^{}]*?)\|([^{}|]*)\}")
_ABOUT = re.compile(r"\{about ([^{}|]+)\}")
_PICTURE = re.compile(r"!\[[^\]]*\]\((?!https?:)([^)]+)\)")


def renew(out: Path, preset: str) -> list[Path]:
    """Take numbers and pictures from the results in `out` and fill README.md; what is written."""
    summary = _summary()
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for experiment, places in _wanted(readme).items():
        if experiment != _BENCHMARKS:
            _take(summary["figures"], out / experiment / preset, experiment, places)
    for name, picture in summary["pictures"].items():
        _copy(out, name, picture)
    write(_HERE / "summary.json", to_json(summary))
    write(ROOT / "README.md", filled(readme, summary))
    return [_HERE / "summary.json", ROOT / "README.md"]


def filled(readme: str, summary: Mapping[str, Any]) -> str:
    """`readme` with its blocks from ``summary.md``, their numbers from ``summary.json``."""
    figures = dict(summary["figures"])
    if _BENCHMARKS in (wanted := _wanted(readme)):
        folder = ROOT / "benchmarks" / "measured"
        _take(figures, folder, _BENCHMARKS, wanted[_BENCHMARKS])

    def number(place: str, style: str) -> str:
        experiment, key = _split(place)
        values = figures.get(experiment, {}).get("values", {})
        if key not in values:
            raise UserError(f"summary.json has no number {experiment} | {key}: `make readme`")
        return re.sub(r"e([+-])0", r"e\1", format(values[key], style.strip()))

    def block(match: re.Match) -> str:
        if match[2] not in blocks:
            raise UserError(f"README.md: summary.md has no block {match[2]!r}")
        text = _PLACE.sub(lambda one: number(one[1], one[2]), blocks[match[2]])
        text = _ABOUT.sub(lambda one: _about(figures, one[1].strip()), text)
        return f"{match[1]}{text}\n{match[3]}"

    blocks = _blocks()
    return _BLOCK.sub(block, readme)


def unlike(readme: str) -> list[str]:
    """What in README.md is not as its source has it, a sentence each; none where all is."""
    summary = _summary()
    pairs = itertools.zip_longest(readme.splitlines(), filled(readme, summary).splitlines())
    found = [f"README.md has {has!r}, its source {own!r}" for has, own in pairs if has != own]
    for name in _PICTURE.findall(readme):
        if name not in summary["pictures"]:
            found.append(f"experiments/summary.json does not say which command draws {name}")
        elif _digest(ROOT / name) != summary["pictures"][name].get("sha256"):
            found.append(f"{name} has changed since `make readme`")
    return found


def _summary() -> dict[str, Any]:
    return json.loads((_HERE / "summary.json").read_text(encoding="utf-8"))


def _blocks() -> dict[str, str]:
    """The blocks of ``summary.md``, blank lines kept."""
    text = (_HERE / "summary.md").read_text(encoding="utf-8")
    parts = re.split(r"^## (\w+)\n", text, flags=re.MULTILINE)[1:]
    return {name: body.strip("\n") for name, body in zip(parts[::2], parts[1::2], strict=True)}


def _wanted(readme: str) -> dict[str, list[str]]:
    """The places of README.md's blocks, by experiment."""
    blocks = _blocks()
    texts = [blocks.get(name, "") for _, name, _ in _BLOCK.findall(readme)]
    places = [place for text in texts for place, _ in _PLACE.findall(text)]
    wanted: dict[str, list[str]] = {}
    for experiment, key in map(_split, places):
        wanted.setdefault(experiment, []).append(key)
    return wanted


def _split(place: str) -> tuple[str, str]:
    """Experiment, and conditions with key as one text."""
    experiment, where, key = (part.strip() for part in place.split("|"))
    return experiment, f"{where} | {key}"


def _take(figures: dict[str, Any], folder: Path, experiment: str, keys: list[str]) -> None:
    """Put the experiment's numbers into `figures`, where the folder has results."""
    try:
        ran, rows = _results(folder)
    except FileNotFoundError:
        if set(keys) <= set(figures.get(experiment, {}).get("values", {})):
            return
        raise UserError(f"README.md: no results of {experiment} in {str(folder)!r}") from None
    values = {}
    for key in keys:
        try:
            values[key] = Place.read(f"{experiment} | {key}").value(rows)
        except ValueError as error:
            raise UserError(f"README.md: {experiment} | {key}: {error}") from None
    figures[experiment] = {
        "command": command_of(ran),
        "date": ran["date"][:10],
        "cpu": ran["cpu"],
        "versions": {name: text for name, text in ran["versions"].items() if text},
        "values": values,
    }


def _results(folder: Path) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """What it ran on, and its rows; those of the benchmarks say under "table" where they are."""
    ran = json.loads((folder / "environment.json").read_text(encoding="utf-8"))
    if (folder / "rows.json").exists():
        tables = json.loads((folder / "rows.json").read_text(encoding="utf-8"))
        return ran, [{"table": name, **row} for name, rows in tables.items() for row in rows]
    return ran, json.loads((folder / "metrics.json").read_text(encoding="utf-8"))


def _about(figures: Mapping[str, Any], experiment: str) -> str:
    """Machine, JAX and date of an experiment's numbers."""
    run = figures[experiment]
    words = {1: "one core", 2: "two cores", 4: "four cores"}
    count = run["cpu"]["count"]
    cores = words.get(count, f"{count} cores")
    return f"{cores} of an {run['cpu']['model']}, JAX {run['versions']['jax']}, {run['date']}"


def _copy(out: Path, name: str, picture: dict[str, Any]) -> None:
    """Take up the picture that a run has drawn; one that a tool draws is taken as it is."""
    drawn = out / picture["from"] if "from" in picture else ROOT / name
    if not drawn.exists() or _digest(drawn) == picture.get("sha256"):
        return
    if drawn != ROOT / name:
        shutil.copyfile(drawn, ROOT / name)
    picture["sha256"] = _digest(drawn)
    picture["date"] = datetime.datetime.now(datetime.UTC).date().isoformat()


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
