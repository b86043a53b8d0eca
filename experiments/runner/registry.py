"""Which experiments there are.

An experiment is a pair in a paper's folder: a TOML file ``<paper>/<table>.toml`` with what it is
and its presets, and beside it ``<table>.py`` with a function registered under the same name,
``<paper>.<table>`` where the TOML file gives no other. Listing reads only the TOML files; the
module, with JAX behind it, is imported when the experiment runs.
"""

import dataclasses
import importlib
import tomllib
import typing
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import experiments

from .claims import FILE
from .config import check
from .errors import UserError, unknown

if TYPE_CHECKING:
    from .context import Context
    from .report import Table

C = TypeVar("C")
_HEAD = ("name", "description", "reproduces")
_registered: dict[str, "Experiment"] = {}


@dataclasses.dataclass(frozen=True)
class Entry:
    """An experiment as its TOML file tells it."""

    name: str
    path: Path
    description: str
    reproduces: str  # what of which paper
    presets: dict[str, dict[str, Any]]

    @property
    def file(self) -> str:
        """The TOML file as messages name it, with its folder."""
        return _shown(self.path)

    def preset(self, name: str) -> dict[str, Any]:
        if name not in self.presets:
            raise unknown("preset", name, self.presets, where=self.name)
        return self.presets[name]


@dataclasses.dataclass(frozen=True)
class Experiment:
    """An experiment as its module registers it."""

    run: Callable[[Any, "Context"], "Table | Sequence[Table]"]
    config: type
    x64: bool


def experiment(name: str, *, x64: bool = False):
    """Register ``run(config, context) -> Table | Sequence[Table]`` under `name`.

    The annotation of the first parameter is the config's type, a frozen dataclass. The runner
    sets JAX's 64-bit switch to `x64` for the run (the module itself is imported before that).
    """

    def register(
        run: Callable[[C, "Context"], "Table | Sequence[Table]"],
    ) -> Callable[[C, "Context"], "Table | Sequence[Table]"]:
        config = next(iter(typing.get_type_hints(run).values()))
        check(config)
        _registered[name] = Experiment(run, config, x64)
        return run

    return register


def entries() -> dict[str, Entry]:
    """All experiments by name, in alphabetical order."""
    found = [path for root in experiments.__path__ for path in Path(root).glob("*/*.toml")]
    paths = [path for path in found if path.name != FILE]  # which tells of the paper
    return {entry.name: entry for entry in sorted(map(_read, paths), key=lambda entry: entry.name)}


def _read(path: Path) -> Entry:
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise UserError(f"{_shown(path)}: {error}") from None
    presets = {key: value for key, value in content.items() if isinstance(value, dict)}
    head = {"name": f"{path.parent.name}.{path.stem}"}
    head |= {key: value for key, value in content.items() if key not in presets}
    for key in head:
        if key not in _HEAD:
            raise unknown("key", key, _HEAD, where=_shown(path))
    for key in _HEAD:
        if not isinstance(head.get(key), str):
            raise UserError(f"{_shown(path)}: {key!r} should be a line of text above the presets")
    return Entry(path=path, presets=presets, **head)


def _shown(path: Path) -> str:
    return f"{path.parent.name}/{path.name}"


def load(entry: Entry) -> Experiment:
    """Import the experiment's module and return what it registered."""
    module = f"{experiments.__name__}.{entry.path.parent.name}.{entry.path.stem}"
    importlib.import_module(module)
    if entry.name not in _registered:
        raise LookupError(f"{module} registers no experiment {entry.name!r}")
    return _registered[entry.name]
