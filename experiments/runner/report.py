"""What a run leaves behind: metrics as JSON and CSV, tables as Markdown."""

import csv
import dataclasses
import io
import json
import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any

from .errors import unknown

Row = Mapping[str, Any]


@dataclasses.dataclass(frozen=True)
class Column:
    """One quantity of a table.

    `key` is its key in the rows and `paper` the key of the paper's figure, where a row has one:
    then the table shows the paper's, ours and the difference. Numbers have `digits` digits after
    the point, or four significant ones.
    """

    key: str
    heading: str
    paper: str | None = None
    digits: int | None = None


@dataclasses.dataclass(frozen=True)
class Table:
    """A table of all recorded rows, or of `rows`, and a paragraph below it.

    Columns and paragraph that are not given here are those under the table's title in the Markdown
    file beside the experiment: a list ``- key | heading | digits | paper``, and text whose
    ``{placeholders}`` are filled from the config and from `values`.
    """

    title: str
    columns: Sequence[Column] = ()
    rows: Sequence[Row] | None = None
    note: str = ""
    values: Mapping[str, Any] = dataclasses.field(default_factory=dict)


def completed(tables: Iterable[Table], path: Path, config: Any) -> list[Table]:
    """Give each table what its section of the Markdown file at `path` says of it.

    A placeholder may also name a section of ``notes.md`` in the same folder.
    """
    own, shared = sections(path), sections(path.with_name("notes.md"))
    full = []
    for table in tables:
        lines = own.get(table.title, [])
        columns = [_column(line.removeprefix("- ")) for line in lines if line.startswith("- ")]
        values = {"config": config, **table.values}
        note = " ".join(line for line in lines if not line.startswith("- "))
        used = {name: text for name, text in shared.items() if f"{{{name}}}" in note}
        common = {name: " ".join(text).format(**values) for name, text in used.items()}
        note = table.note or note.format(**common | values)
        full.append(dataclasses.replace(table, columns=table.columns or columns, note=note))
    return full


def sections(path: Path) -> dict[str, list[str]]:
    """Read the lines under each ``## title`` of a file; none where there is no file."""
    if not path.exists():
        return {}
    _, *parts = re.split(r"^## ", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {title: list(filter(None, lines)) for title, *lines in map(str.splitlines, parts)}


def _column(line: str) -> Column:
    key, heading, digits, paper = (*line.split(" | "), "", "", "")[:4]
    return Column(key, heading or key, paper or None, int(digits) if digits else None)


def write(path: Path, text: str) -> None:
    """Write all of the file or nothing: a reader never meets half of it."""
    temporary = path.with_name(f".{path.name}.tmp")
    temporary.write_text(text, encoding="utf-8")
    os.replace(temporary, path)


def plain(value: Any) -> Any:
    """`value` as JSON holds it: scalars and small arrays of NumPy or JAX become Python's own."""
    if isinstance(value, Enum):
        return value.name
    if value is None or isinstance(value, str | int | float):
        return value
    if isinstance(value, Mapping):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, Sequence):
        return [plain(one) for one in value]
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"a metric is a number, a text or a list of them, not {type(value).__name__}")


def to_json(value: Any) -> str:
    """Valid JSON: numbers that are not finite become "NaN", "Infinity" and "-Infinity"."""
    return json.dumps(_finite(value), indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        # These texts are also what float() reads back.
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    if isinstance(value, dict):
        return {key: _finite(one) for key, one in value.items()}
    return [_finite(one) for one in value] if isinstance(value, list) else value


def to_csv(rows: Sequence[Row]) -> str:
    """One line per row; the columns are all keys, in the order in which they first appear."""
    text = io.StringIO()
    writer = csv.DictWriter(text, _keys(rows), lineterminator="\n")
    writer.writeheader()
    writer.writerows(_finite([dict(row) for row in rows]))
    return text.getvalue()


def to_markdown(table: Table, rows: Sequence[Row]) -> str:
    """The table of `rows`, or of its own."""
    rows = rows if table.rows is None else [plain(row) for row in table.rows]
    if not table.columns:
        raise ValueError(f"the table {table.title!r} has no columns")
    known = _keys(rows)
    heads: list[str] = []
    cells: list[list[str]] = [[] for _ in rows]
    for column in table.columns:
        if rows and column.key not in known:
            raise ValueError(str(unknown("column", column.key, known, where=table.title)))
        # Without a single figure of the paper's (other data, say) its columns would be empty.
        papers = [row.get(column.paper) if column.paper else None for row in rows]
        compared = any(paper is not None for paper in papers)
        kinds = [": paper", ": ours", ": difference"] if compared else [""]
        heads += [column.heading + kind for kind in kinds]
        for line, row, paper in zip(cells, rows, papers, strict=True):
            ours = row.get(column.key)
            if not compared:
                line.append(_cell(ours, column.digits))
                continue
            difference = None
            if isinstance(ours, int | float) and isinstance(paper, int | float):
                difference = ours - paper
            line += [_cell(paper, column.digits), _cell(ours, column.digits)]
            line += [_cell(difference, column.digits, sign="+")]
    rule = ["---"] + ["---:"] * (len(heads) - 1)
    lines = [f"| {' | '.join(line)} |" for line in [heads, rule, *cells]]
    note = ["", table.note] if table.note else []
    return "\n".join([f"## {table.title}", "", *lines, *note, ""])


def _keys(rows: Sequence[Row]) -> list[str]:
    return list(dict.fromkeys(key for row in rows for key in row))


def _cell(value: Any, digits: int | None, sign: str = "") -> str:
    if value is None:
        return "–"
    if isinstance(value, float):
        return format(value, f"{sign}.4g" if digits is None else f"{sign}.{digits}f")
    if isinstance(value, int) and not isinstance(value, bool):
        return format(value, sign)
    return str(value).replace("|", "\\|")
