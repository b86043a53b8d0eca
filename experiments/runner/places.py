"""Places: which number of which run is meant, as findings, claims and README write it.

``table1 | method=tiles; degree>=4 | min psnr_object`` is the least ``psnr_object`` among the rows
of ``metrics.json`` that meet the conditions.
"""

import dataclasses
import operator
import re
import statistics
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from .errors import UserError

Row = Mapping[str, Any]

_OF: dict[str, Callable[[list[Any]], Any]] = {
    "min": min,
    "max": max,
    "median": statistics.median,
    "count": len,
}
_COMPARE = {">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt}
_CONDITION = re.compile(r"(.+?)(>=|<=|!=|>|<|=)(.*)")


@dataclasses.dataclass(frozen=True)
class Place:
    """One number: of an experiment, of the rows that meet the conditions, under a key."""

    experiment: str
    conditions: tuple[tuple[str, str, str], ...]
    key: str
    of: str = ""  # min, max, median or count; "" where there is one row

    @classmethod
    def read(cls, text: str) -> "Place":
        """Read ``experiment | conditions | [min|max|median|count] key``."""
        parts = [part.strip() for part in text.split("|")]
        if len(parts) != 3 or not (parts[0] and parts[2]):
            raise UserError(f"expected 'experiment | conditions | key', got {text!r}")
        experiment, where, key = parts
        conditions = []
        for one in filter(None, where.split("; ")):
            match = _CONDITION.fullmatch(one.strip())
            if not match:
                raise UserError(f"expected a condition such as 'degree=4', got {one!r} in {text!r}")
            conditions.append(match.groups())
        of, _, rest = key.partition(" ")
        of, key = (of, rest) if of in _OF else ("", key)
        return cls(experiment, tuple(conditions), key, of)

    def values(self, rows: Iterable[Row]) -> list[Any]:
        """All that the rows hold here."""
        meant = [row for row in rows if all(_meets(row, *one) for one in self.conditions)]
        return [_number(row[self.key]) for row in meant if row.get(self.key) is not None]

    def value(self, rows: Iterable[Row]) -> Any:
        """The number; ValueError where no row, or more than one, has it."""
        values = self.values(rows)
        if not values or (not self.of and len(values) > 1):
            raise ValueError(f"{len(values)} rows")
        return _OF[self.of](values) if self.of else values[0]


def _meets(row: Row, key: str, relation: str, value: str) -> bool:
    if relation in _COMPARE:
        held = row.get(key)
        return isinstance(held, int | float) and _COMPARE[relation](held, float(value))
    return (_text(row.get(key)) == value) is (relation == "=")


def _text(value: Any) -> str:
    return format(value, "g") if isinstance(value, float) else str(value)


def _number(value: Any) -> Any:
    """Numbers that are not finite are texts in JSON."""
    return float(value) if value in ("NaN", "Infinity", "-Infinity") else value
