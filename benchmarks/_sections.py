"""What a benchmark is: its rows, the table and the plot that show them; and all there are."""

import dataclasses
import importlib
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Literal

from matplotlib.figure import Figure

from experiments.runner import Column

Cores = Literal["one", "all"]
Rows = list[dict[str, Any]]

# Each is the module of that name, with a `SECTION`. They import peers in their functions: the page
# is made where there are none.
NAMES = (
    "basis",
    "synthesis",
    "errors",
    "lat_long",
    "bake",
    "near_light",
    "first_picture",
    "first_call",
)


@dataclasses.dataclass(frozen=True)
class Section:
    """One table of the benchmarks, and its plot.

    `timings(cores, rounds, dtype)` yields its rows as they come, in a process that is pinned to a
    core already where `cores` is "one"; each row says what it is of, but for its cores. x64 is on
    where dtype is "float64". `glance` makes the Markdown that stands above the folded table, where
    that is long; `draw` the plot.
    """

    name: str
    title: str
    intro: str
    columns: Sequence[Column]
    timings: Callable[[Cores, int, str], Iterator[dict[str, Any]]]
    draw: Callable[[Figure, Rows], None] | None = None
    glance: Callable[[Rows], str] | None = None
    size: tuple[float, float] = (9, 3.6)  # of the plot, in inches
    note: str = ""
    cores: tuple[Cores, ...] = ("one", "all")
    dtypes: tuple[str, ...] = ("float32",)
    keeps_memory: bool = True  # whether glibc is told to keep what is freed
    peers: tuple[str, ...] = ()  # packages whose versions count


def load(name: str) -> Section:
    """Import the section of this name."""
    return importlib.import_module(f"benchmarks.{name}").SECTION
