"""One run of one experiment, from its config to its folder of results."""

import contextlib
import dataclasses
import datetime
import shutil
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .config import to_toml
from .context import Context
from .data import Data
from .errors import UserError
from .machine import compile_clock, describe
from .registry import Entry, Experiment
from .report import Table, completed, to_csv, to_json, to_markdown, write
from .sources import digests


@dataclasses.dataclass(frozen=True)
class Job:
    """An experiment with all that it needs to run."""

    entry: Entry
    experiment: Experiment
    preset: str
    config: Any
    command: str  # the line that runs it again
    out: Path
    data: Data
    seed: int = 0
    progress: bool = False

    @property
    def folder(self) -> Path:
        """Where the results go when they are complete."""
        return self.out / self.entry.name / self.preset

    def run(self) -> Path:
        """Run, and return the folder of results.

        The work is done in ``<preset>.partial``, which takes the place of the last results only
        when it is complete: neither a failure nor Ctrl-C costs rows, old or new.
        """
        with _x64(self.experiment.x64):
            machine = self._machine()  # before we write: our own files are no change to the code
            partial = self._prepare()
            write(partial / "environment.json", to_json(machine))
            context = Context(partial, self.data, seed=self.seed, progress=self.progress)
            try:
                tables = self._timed(context, machine)
                write(partial / "metrics.json", to_json(context.rows))
                write(partial / "metrics.csv", to_csv(context.rows))
                write(partial / "table.md", self._report(tables, context, machine))
                machine["status"] = "complete"
            except BaseException as error:
                interrupted = isinstance(error, KeyboardInterrupt)
                machine["status"] = "interrupted" if interrupted else "failed"
                kept = f"{self.entry.name}: rows kept: {len(context.rows)}, in {partial}"
                print(kept, file=sys.stderr)
                raise
            finally:
                write(partial / "environment.json", to_json(machine))
        _remove(self.folder)
        partial.rename(self.folder)
        return self.folder

    def _timed(self, context: Context, machine: dict[str, Any]) -> list[Table]:
        """Run the experiment and note its seconds, whether it ends well or not."""
        clock = compile_clock()
        start, compiled = time.perf_counter(), clock[0]
        try:
            tables = self.experiment.run(self.config, context)
        finally:
            total, compiled = time.perf_counter() - start, clock[0] - compiled
            machine["seconds"] = {"total": total, "compile": compiled, "run": total - compiled}
            machine["times"] = context.times
        tables = [tables] if isinstance(tables, Table) else tables
        return completed(tables, self.entry.path.with_suffix(".md"), self.config)

    def _prepare(self) -> Path:
        partial = self.folder.with_name(f"{self.preset}.partial")
        _check_ours(self.folder)
        try:
            _remove(partial)
            partial.mkdir(parents=True)
            text = f"# {self.entry.name}\n# {self.command}\n{to_toml(self.config, self.preset)}"
            write(partial / "config.toml", text)
        except OSError as error:
            raise UserError(f"cannot write to {str(partial)!r}: {error.strerror}") from None
        return partial

    def _machine(self) -> dict[str, Any]:
        return {
            "experiment": self.entry.name,
            "preset": self.preset,
            "command": self.command,
            "status": "running",
            "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
            "seed": self.seed,
            "x64": self.experiment.x64,
            "dtype": "float64" if self.experiment.x64 else "float32",
            "data": self.data.source,
            **describe(),
            "sources": digests(self.entry.path.with_suffix(".py")),
        }

    def _report(self, tables: list[Table], context: Context, machine: dict[str, Any]) -> str:
        versions, seconds = machine["versions"], machine["seconds"]
        commit = (machine["commit"] or "no commit")[:10] + (", changed" if machine["dirty"] else "")
        facts = [
            f"jaxsh {versions['jaxsh']} ({commit})",
            f"JAX {versions['jax']}",
            f"Python {machine['python']}",
            f"{machine['cpu']['model']}, {machine['cpu']['count']} cores",
            f"device {machine['device']['kind']}",
            machine["dtype"],
            f"seed {machine['seed']}",
            f"data: {machine['data']}",
            f"{seconds['compile']:.1f} s compiling and {seconds['run']:.1f} s running",
            machine["date"],
        ]
        pictures = [f"![{caption}]({name})\n" for name, caption in context.pictures.items()]
        parts = [
            f"# {self.entry.name} · {self.preset}\n",
            f"{self.entry.description}\n",
            f"Reproduces: {self.entry.reproduces}\n",
            *(to_markdown(table, context.rows) for table in tables),
            *pictures,
            f"```\n{self.command}\n```\n",
            f"<sub>{' · '.join(facts)}</sub>\n",
        ]
        return "\n".join(parts)


@contextlib.contextmanager
def _x64(enabled: bool) -> Iterator[None]:
    """JAX's 64-bit switch as the experiment wants it, and afterwards as it was."""
    import jax

    before = jax.config.jax_enable_x64  # pyright: ignore[reportAttributeAccessIssue]
    jax.config.update("jax_enable_x64", enabled)
    try:
        yield
    finally:
        jax.config.update("jax_enable_x64", before)


def _check_ours(folder: Path) -> None:
    """Refuse to replace a folder that no run has written."""
    if folder.exists() and any(folder.iterdir()) and not (folder / "config.toml").exists():
        raise UserError(f"{str(folder)!r} holds no results of a run: move it or choose --out")


def _remove(folder: Path) -> None:
    _check_ours(folder)
    if folder.exists():
        shutil.rmtree(folder)
