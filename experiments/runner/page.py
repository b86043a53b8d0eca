"""The report as one HTML page that needs no other file and no network."""

import base64
import contextlib
import html as escaping
import io
import re
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from .claims import Verdict
from .overview import ABOUT, Chapter
from .registry import Entry
from .results import Run, Shown, command_of, in_view, is_number

_ROWS = 12  # in view; the others on demand
_HEAVIEST, _WIDEST = 200_000, 1600  # bytes of a picture that is taken as it is; else its pixels
_TYPES = {".png": "image/png", ".gif": "image/gif", ".webp": "image/webp", ".svg": "image/svg+xml"}
_MARKS = {"holds": "✓", "does not hold": "✗", "open": "○"}


def html(chapters: Sequence[Chapter], command: str, date: str) -> str:
    """The page."""
    style = Path(__file__).with_name("page.css").read_text(encoding="utf-8")
    parts = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        "<title>jaxsh: results of the experiments</title>",
        f"<style>{style}</style></head><body><main>",
        "<h1>Results of the experiments</h1>",
        f'<p class="facts">{date} · <code>{_text(command)}</code></p>',
        *_summary(chapters),
        f"<p>{_text(ABOUT)}</p>",
    ]
    number, here = 0, {entry.name for chapter in chapters for entry, _ in chapter.runs}
    for chapter in chapters:
        parts += [
            f'<section id="{_anchor(f"paper {chapter.paper.folder.name}")}">',
            f"<h2>{_text(chapter.paper.title)}</h2>",
            f'<p class="facts">{_text(chapter.paper.cited)}</p>',
            *_claims(chapter, here),
        ]
        for entry, run in chapter.runs:
            if run is None:
                continue
            parts += _head(entry, run)
            for table in run.tables:
                number += 1
                parts += _table(table, f"t{number}")
            parts += _figures(run)
            parts.append("</article>")
        parts += _missing(chapter)
        parts.append("</section>")
    parts.append("</main></body></html>\n")
    return "\n".join(parts)


def _summary(chapters: Sequence[Chapter]) -> Iterator[str]:
    yield '<table class="summary"><thead><tr><th>paper</th>'
    yield "<th>claims that hold</th><th>that do not</th><th>open</th>"
    yield "<th>results</th><th>stale</th></tr></thead><tbody>"
    for chapter in chapters:
        count = chapter.counts
        there = count["there"] + count["stale"]
        yield (
            f'<tr><th><a href="#{_anchor(f"paper {chapter.paper.folder.name}")}">'
            f"{_text(chapter.paper.cited)}</a></th>"
            f'<td class="holds">{count["holds"] or "–"}</td>'
            f'<td class="does-not-hold">{count["does not hold"] or "–"}</td>'
            f"<td>{count['open'] or '–'}</td>"
            f"<td>{there} of {len(chapter.runs)}</td>"
            f'<td class="stale">{count["stale"] or "–"}</td></tr>'
        )
    yield "</tbody></table>"


def _claims(chapter: Chapter, here: Collection[str]) -> Iterator[str]:
    if not chapter.verdicts:
        return
    yield '<table class="claims"><thead><tr><th>claim</th><th>bound</th><th>measured</th>'
    yield "<th>verdict</th><th>from</th></tr></thead><tbody>"
    for verdict in chapter.verdicts:
        claim = verdict.claim
        kind = verdict.holds.replace(" ", "-")
        folded = f"<details><summary>note</summary>{_text(claim.note)}</details>"
        links = ", ".join(_link(name, chapter, here) for name in claim.experiments)
        yield (
            f'<tr class="{kind}"><td>{_text(claim.says)} <span class="where">'
            f"{_text(claim.where)}</span>{folded if claim.note else ''}</td>"
            f'<td data-label="bound">{_text(claim.what)}: {_text(claim.bound)}</td>'
            f'<td data-label="measured">{_text(verdict.measured) or "–"}</td>'
            f'<td data-label="verdict"><span class="verdict">{_MARKS[verdict.holds]} '
            f"{verdict.holds}</span> {_text(verdict.margin)}</td>"
            f'<td data-label="from">{links}{_preset(verdict)}</td></tr>'
        )
    yield "</tbody></table>"


def _link(name: str, chapter: Chapter, here: Collection[str]) -> str:
    """To an experiment on this page, by its name within the paper's folder."""
    short = _text(name.removeprefix(f"{chapter.paper.folder.name}.")).replace(".", ".<wbr>")
    return f'<a href="#{_anchor(name)}">{short}</a>' if name in here else short


def _preset(verdict: Verdict) -> str:
    return f" <br>preset {_text(verdict.preset)}" if verdict.preset else ""


def _head(entry: Entry, run: Run) -> Iterator[str]:
    yield f'<article id="{_anchor(entry.name)}"><header><h3>{_text(entry.description)}</h3>'
    stale = f' · <strong class="stale">stale: {_text(run.stale)}</strong>' if run.stale else ""
    yield (
        f'<p class="facts"><code>{_text(entry.name)}</code> · {_text(entry.reproduces)} · '
        f"preset {_text(run.preset)} · {run.date} · {_text(run.machine)}{stale}</p>"
    )
    yield f'<pre class="command">{_text(command_of(run.environment))}</pre>'
    yield f"<details><summary>conditions</summary><p>{_text(' · '.join(run.about))}</p>"
    yield "</details></header>"


def _table(table: Shown, name: str) -> Iterator[str]:
    shown = in_view(table)
    columns, rows = len(shown), len(table.cells)
    yield f'<div class="table part"><h4>{_text(table.title)}</h4>'
    more = [f"all {columns} columns"] if not all(shown) else []
    more += [f"all {rows} rows"] if rows > _ROWS else []
    if more:
        yield f'<input type="checkbox" id="{name}"><label for="{name}">{", ".join(more)}</label>'
    by_column = list(zip(*table.cells, strict=True)) or [("",)] * columns
    texts = [not all(map(is_number, column)) for column in by_column]
    kinds = [
        " ".join(filter(None, ["text" * text, "extra" * (not seen), head if group else ""]))
        for text, seen, head, group in zip(texts, shown, table.heads, table.groups, strict=True)
    ]
    yield '<div class="scroll"><table><thead>'
    if any(table.groups):
        full = _groups(table.groups)
        kept = [group for group, seen in zip(table.groups, shown, strict=True) if seen]
        if all(shown):
            yield f"<tr>{full}</tr>"
        else:
            yield f'<tr class="brief">{_groups(kept)}</tr><tr class="full">{full}</tr>'
    yield f"<tr>{_row('th', kinds, table.heads)}</tr></thead><tbody>"
    for i, row in enumerate(table.cells):
        folded = ' class="extra"' if i >= _ROWS else ""
        yield f"<tr{folded}>{_row('td', kinds, row)}</tr>"
    yield "</tbody></table></div></div>"
    if table.note:
        yield f"<details><summary>about this table</summary><p>{_text(table.note)}</p></details>"


def _row(tag: str, kinds: Sequence[str], cells: Sequence[str]) -> str:
    pairs = zip(kinds, cells, strict=True)
    return "".join(f'<{tag} class="{kind}">{_text(cell)}</{tag}>' for kind, cell in pairs)


def _groups(groups: Sequence[str]) -> str:
    """The row above the headings: what the paper's, ours and the difference are of."""
    cells, i = [], 0
    while i < len(groups):
        end = i + 1
        while groups[i] and end < len(groups) and groups[end] == groups[i]:
            end += 1
        kind = ' class="group"' if groups[i] else ""
        cells.append(f'<th colspan="{end - i}"{kind}>{_text(groups[i])}</th>')
        i = end
    return "".join(cells)


def _figures(run: Run) -> Iterator[str]:
    for caption, path in run.pictures:
        if path.suffix in _TYPES:
            yield (
                f'<figure><img alt="{escaping.escape(caption)}" src="{_embedded(path)}">'
                f"<figcaption>{_text(caption)}</figcaption></figure>"
            )


def _embedded(path: Path) -> str:
    """The picture within the page: smaller where it is large and does not move."""
    content, kind = path.read_bytes(), _TYPES[path.suffix]
    if kind == "image/png" and len(content) > _HEAVIEST:
        from PIL import Image

        small = io.BytesIO()
        # One that is cut short is taken as it is: the page's caption says what it should be.
        with contextlib.suppress(OSError), Image.open(path) as picture:
            picture.thumbnail((_WIDEST, 8 * _WIDEST))
            picture.save(small, "WEBP", quality=90)
            content, kind = small.getvalue(), "image/webp"
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def _missing(chapter: Chapter) -> Iterator[str]:
    if not chapter.missing:
        return
    yield '<h3>Missing</h3><ul class="missing">'
    for entry, ended in chapter.missing:
        last = f' <strong class="stale">last run: {_text(ended)}</strong>' if ended else ""
        yield (
            f'<li id="{_anchor(entry.name)}">{_text(entry.description)} <span class="where">'
            f'{_text(entry.reproduces)}</span>{last}<pre class="command">python -m experiments '
            f"run {_text(entry.name)} --preset paper</pre></li>"
        )
    yield "</ul>"


def _text(text: str) -> str:
    """Text for HTML, with `code` as in Markdown; a number stays with its unit."""
    text = re.sub(r"(?<=\d) (?=(?:%|dB|fps|kB|µs|s|ms)(?!\w))", "\u00a0", text)
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", escaping.escape(text))


def _anchor(name: str) -> str:
    return re.sub(r"[^\w]+", "-", name)
