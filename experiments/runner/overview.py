"""``python -m experiments report``: all results in one page, claims first; and what is missing."""

import dataclasses
import datetime
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from . import claims
from .claims import Paper, Verdict
from .errors import UserError, unknown
from .registry import Entry
from .report import write
from .results import Run, find, unfinished

# What stands below the summary.
ABOUT = (
    "Open: no results that could tell. The preset `paper` runs the paper's scenes; `quick` runs a "
    "small stand-in, and what it says of a paper's claim is a first hint. Stale: the code, or the "
    "preset, is no longer that of the results."
)


@dataclasses.dataclass(frozen=True)
class Chapter:
    """A paper: its claims with their verdicts, and each of its experiments with its results."""

    paper: Paper
    verdicts: list[Verdict]
    runs: list[tuple[Entry, Run | None]]
    missing: list[tuple[Entry, str]]  # and how the last run ended, where one has begun

    @property
    def counts(self) -> Counter[str]:
        """Verdicts by kind; experiments "there", "stale" and "missing"."""
        count = Counter(verdict.holds for verdict in self.verdicts)
        for _, run in self.runs:
            count["missing" if run is None else "stale" if run.stale else "there"] += 1
        return count


def collect(
    entries: Mapping[str, Entry], names: Sequence[str], out: Path, preset: str | None
) -> list[Chapter]:
    """Read all results of the experiments, or papers' folders, of these names; all where none."""
    folders = sorted({entry.path.parent for entry in entries.values()})
    known = [*entries, *(folder.name for folder in folders)]
    for name in names:
        if name not in known:
            raise unknown("experiment or paper", name, known)
    found = {name: find(entry, out, preset) for name, entry in entries.items()}
    rows = {name: run.rows for name, run in found.items() if run}
    presets = {name: run.preset for name, run in found.items() if run}
    chapters = []
    for paper in sorted(map(claims.read, folders), key=lambda paper: (paper.year, paper.folder)):
        mine = [entry for entry in entries.values() if entry.path.parent == paper.folder]
        chosen = [e for e in mine if not names or {e.name, paper.folder.name} & set(names)]
        if not chosen:
            continue
        for claim in paper.claims:
            for name in claim.experiments:
                if name not in entries:
                    raise unknown("experiment", name, entries, f"{paper.folder.name}/{claims.FILE}")
        shown = {entry.name for entry in chosen}
        verdicts = [
            claims.judge(claim, rows, presets)
            for claim in paper.claims
            if shown & set(claim.experiments)
        ]
        runs = [(entry, found[entry.name]) for entry in chosen]
        missing = [(entry, unfinished(entry, out)) for entry, run in runs if run is None]
        chapters.append(Chapter(paper, verdicts, runs, missing))
    return chapters


def write_pages(chapters: Sequence[Chapter], out: Path, command: str) -> list[Path]:
    """Write ``report.html`` and ``report.md`` into the folder of results."""
    from . import page, page_markdown

    date = datetime.datetime.now(datetime.UTC).date().isoformat()
    paths = [out / "report.html", out / "report.md"]
    texts = (
        page.html(chapters, command, date),
        page_markdown.markdown(chapters, out, command, date),
    )
    try:
        out.mkdir(parents=True, exist_ok=True)
        for path, text in zip(paths, texts, strict=True):
            write(path, text)
    except OSError as error:
        raise UserError(f"cannot write to {str(out)!r}: {error.strerror}") from None
    return paths


def due(chapters: Iterable[Chapter], preset: str | None) -> list[tuple[Entry, str, Run | None]]:
    """The experiments that are missing or stale, each with its preset and its old results.

    Where no preset is asked for, stale results keep theirs, and what is missing is "quick".
    """
    waiting = []
    for chapter in chapters:
        for entry, run in chapter.runs:
            name = preset or (run.preset if run else "quick")
            if name in entry.presets and (run is None or run.stale):
                waiting.append((entry, name, run))
    return waiting


def run_due(
    waiting: Sequence[tuple[Entry, str, Run | None]], run: Callable[[Entry, str], object]
) -> int:
    """Run each in turn, saying how far it is; 1 where one failed, 130 where Ctrl-C ended it.

    Each leaves its results as it ends, so that what is interrupted goes on where it stopped.
    """
    known = [before.seconds for *_, before in waiting if before]
    guess = sum(known) / len(known) if known else 0.0
    failed = []
    start = time.perf_counter()
    for i, (entry, preset, before) in enumerate(waiting):
        left = sum(old.seconds if old else guess for *_, old in waiting[i:])
        about = f", about {_minutes(left)} to go by earlier runs" if left else ""
        why = before.stale if before else "no results"
        taken = _minutes(time.perf_counter() - start)
        print(
            f"[{i + 1}/{len(waiting)}] {entry.name} · {preset} ({why}); {taken} so far{about}",
            file=sys.stderr,
        )
        try:
            run(entry, preset)
        except KeyboardInterrupt:
            print("interrupted: the same command goes on from here", file=sys.stderr)
            return 130
        except UserError as error:
            print(f"error: {error}", file=sys.stderr)
            failed.append(entry.name)
        except Exception:
            traceback.print_exc()
            failed.append(entry.name)
    if failed:
        print(f"{len(failed)} of {len(waiting)} failed: {', '.join(failed)}", file=sys.stderr)
    return int(bool(failed))


def _minutes(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"
