"""Fill each paper's README from its findings and the metrics of its runs."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .errors import UserError
from .places import Place
from .registry import Entry
from .results import data_of

_PLACE = re.compile(r"\{([^{}|]+)\|([^{}]*)\|([^{}|]+)\|([^{}|]*)\}")


def fill(entries: Mapping[str, Entry], results: Path, preset: str) -> list[Path]:
    """Write ``README.md`` beside each ``findings.md``, and return the files written.

    A placeholder ``{table1 | method=tiles; degree=4 | psnr_object | .1f}`` is the number of the one
    row of that experiment whose keys are as told; ``| min psnr_object |`` (or max, median, count)
    is that of all such rows.
    """
    written = []
    for folder in sorted({entry.path.parent for entry in entries.values()}):
        template = folder / "findings.md"
        if template.exists():
            known = {e.path.stem: e.name for e in entries.values() if e.path.parent == folder}
            text = _filled(template, known, results, preset)
            written.append(folder / "README.md")
            written[-1].write_text(text, encoding="utf-8")
    return written


def _filled(template: Path, known: Mapping[str, str], results: Path, preset: str) -> str:
    used: dict[str, dict[str, Any]] = {}

    def number(match: re.Match) -> str:
        stem, where, key, style = (part.strip() for part in match.groups())
        if stem not in known:
            raise UserError(f"{template.parent.name}/findings.md: no experiment {stem!r}")
        run = results / known[stem] / preset
        if not (run / "metrics.json").exists():
            raise UserError(f"{template.parent.name}/findings.md: no results in {str(run)!r}")
        used[known[stem]] = json.loads((run / "environment.json").read_text(encoding="utf-8"))
        rows = json.loads((run / "metrics.json").read_text(encoding="utf-8"))
        try:
            value = Place.read(f"{stem} | {where} | {key}").value(rows)
        except ValueError as error:
            raise UserError(f"{template.parent.name}/findings.md: {match[0]}: {error}") from None
        return format(value, style)

    text = _PLACE.sub(number, template.read_text(encoding="utf-8"))
    about = {_about(run): [] for run in used.values()}
    for name, run in used.items():
        about[_about(run)].append(f"`{name}`")
    runs = "; ".join(f"{', '.join(sorted(names))}: {run}" for run, names in sorted(about.items()))
    return (
        f"{text.rstrip()}\n\n<sub>Figures: preset `{preset}`, filled in by `python -m experiments "
        f"findings --preset {preset}`. {runs}.</sub>\n"
    )


def _about(run: Mapping[str, Any]) -> str:
    versions = {name: run["versions"][key] for name, key in (("jaxsh", "jaxsh"), ("JAX", "jax"))}
    names = [f"{name} {version}" for name, version in versions.items() if version]
    return ", ".join([run["date"][:10], *names, run["dtype"], data_of(run)])
