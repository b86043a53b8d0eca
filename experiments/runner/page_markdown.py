"""The report as Markdown, its pictures where the runs left them."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from .overview import ABOUT, Chapter
from .results import Shown, command_of, in_view


def markdown(chapters: Sequence[Chapter], out: Path, command: str, date: str) -> str:
    """The page; paths of pictures are relative to `out`."""
    parts = [
        "# Results of the experiments",
        f"{date} · `{command}`",
        "\n".join(_summary(chapters)),
        ABOUT,
    ]
    for chapter in chapters:
        parts += [f"## {chapter.paper.title}", chapter.paper.cited]
        if chapter.verdicts:
            parts.append("\n".join(_claims(chapter)))
        for entry, run in chapter.runs:
            if run is None:
                continue
            stale = f" · **stale: {run.stale}**" if run.stale else ""
            parts += [
                f"### {entry.description}",
                f"`{entry.name}` · {entry.reproduces} · preset {run.preset} · {run.date} · "
                f"{run.machine}{stale}",
                f"```\n{command_of(run.environment)}\n```",
                *(part for table in run.tables for part in _table(table)),
            ]
            for caption, path in run.pictures:
                parts.append(f"![{caption}]({path.relative_to(out).as_posix()})")
        if chapter.missing:
            lines = (
                f"- `{entry.name}`: {entry.description} ({entry.reproduces})"
                f"{ended and f'; last run: {ended}'}"
                for entry, ended in chapter.missing
            )
            parts += ["### Missing", "\n".join(lines)]
    return "\n\n".join(parts) + "\n"


def _summary(chapters: Sequence[Chapter]) -> Iterator[str]:
    yield "| paper | claims that hold | that do not | open | results | stale |"
    yield "| --- | ---: | ---: | ---: | ---: | ---: |"
    for chapter in chapters:
        count = chapter.counts
        there = count["there"] + count["stale"]
        yield (
            f"| {chapter.paper.cited} | {count['holds']} | {count['does not hold']} | "
            f"{count['open']} | {there} of {len(chapter.runs)} | {count['stale']} |"
        )


def _claims(chapter: Chapter) -> Iterator[str]:
    yield "| claim | bound | measured | verdict | from |"
    yield "| --- | --- | --- | --- | --- |"
    for verdict in chapter.verdicts:
        claim = verdict.claim
        cells = (
            f"{claim.says} ({claim.where})",
            f"{claim.what}: {claim.bound}",
            verdict.measured or "–",
            f"**{verdict.holds}** {verdict.margin}",
            f"{', '.join(f'`{name}`' for name in claim.experiments)}"
            f"{verdict.preset and f' preset {verdict.preset}'}",
        )
        yield _line(cells)


def _table(table: Shown) -> Iterator[str]:
    """What is in view, and folded the whole table and its note."""
    shown = in_view(table)
    yield f"#### {table.title}"
    yield _rows(table, shown)
    if not all(shown):
        yield f"<details><summary>all {len(shown)} columns</summary>"
        yield _rows(table, [True] * len(shown))
        yield "</details>"
    if table.note:
        yield f"<details><summary>about this table</summary>\n\n{table.note}\n\n</details>"


def _rows(table: Shown, shown: Sequence[bool]) -> str:
    heads = [
        f"{group}: {head}" if group else head
        for group, head in zip(table.groups, table.heads, strict=True)
    ]
    rule = ["---", *["---:"] * (len(heads) - 1)]
    lines = [heads, rule, *table.cells]
    return "\n".join(
        _line([cell for cell, seen in zip(line, shown, strict=True) if seen]) for line in lines
    )


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cell.strip().replace('|', chr(92) + '|') for cell in cells)} |"
