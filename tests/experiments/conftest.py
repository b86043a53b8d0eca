"""Two small experiments, registered for the length of a test in a folder of their own."""

import importlib
import json
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path

import pytest

import experiments
import experiments.runner.registry as registry
from experiments.runner.cli import main

CONFIG = """\
name = "toy"
description = "A sum of powers"
reproduces = "Nobody 1900, table 1"

[quick]
degrees = [1, 2]

[paper]
degrees = [1, 2, 4]
scale = 2
kind = "exact"
"""

MODULE = '''\
import dataclasses
import enum
from typing import Literal

import jax
import jax.numpy as jnp

from experiments.runner import Column, Context, Table, UserError, experiment


class Window(enum.Enum):
    NONE = 0
    HANN = 1


@dataclasses.dataclass(frozen=True)
class Toy:
    """A toy."""

    degrees: tuple[int, ...] = (1,)
    """degrees to sum"""
    scale: float = 1.0
    kind: Literal["exact", "rough"] = "rough"
    window: Window = Window.NONE
    image_size: int | None = None
    sun: tuple[float, float, float] = (0.0, 0.0, 1.0)
    shadows: bool = True
    mood: str = "calm"
    """calm, or how to end badly"""

    def __post_init__(self):
        if self.scale <= 0:
            raise ValueError(f"scale should be positive, not {self.scale}")


@experiment("toy", x64=True)
def run(config: Toy, context: Context) -> Table:
    for degree in context.progress(config.degrees, "degrees"):
        if degree == 4:
            if config.mood == "angry":
                raise RuntimeError("a bug")
            if config.mood == "hasty":
                raise KeyboardInterrupt
            context.data.mesh(config.mood if config.mood != "calm" else "knot")
        value, *_ = context.measure(f"power {degree}", lambda x: x**degree, jnp.ones(3) * 2)
        with context.time("sum"):
            total = config.scale * value.sum()
        row = {"degree": degree, "sum": total, "dtype": str(total.dtype)}
        if degree == 2:
            row["sum_paper"] = 12.5
        context.record(row)
    context.path("dot.png", "A dot").write_bytes(b"png")
    columns = [Column("degree", "degree"), Column("sum", "sum", paper="sum_paper", digits=2)]
    return Table("Sums", columns)


@experiment("toy.second")
def second(config: Toy, context: Context) -> list[Table]:
    context.record({"draw": jax.random.uniform(context.key), "nan": float("nan")})
    return [Table("Draws", [Column("draw", "draw"), Column("nan", "nan")])]
'''


@dataclass
class Runner:
    """The command line in this process, its results going to a temporary folder."""

    folder: Path
    out: Path
    capsys: pytest.CaptureFixture[str]

    def __call__(self, *words: str) -> tuple[int, str, str]:
        """The exit code, stdout and stderr of ``python -m experiments WORDS``."""
        code = main(words)
        return code, *self.capsys.readouterr()

    def run(self, *words: str) -> tuple[int, str, str]:
        return self("run", *words, "--out", str(self.out))

    def refused(self, *words: str) -> str:
        """The sentence with which `words` are refused."""
        code, stdout, stderr = self(*words)
        assert (code, stdout) == (2, "")
        assert stderr.startswith("error: ")
        assert stderr.count("\n") == 1
        assert not self.out.exists()
        return stderr

    def read(self, name: str):
        """A file of results, below the folder of all results."""
        text = (self.out / name).read_text(encoding="utf-8")
        return json.loads(text) if name.endswith(".json") else text


@pytest.fixture
def toys(tmp_path, monkeypatch, capsys):
    """The command line with two experiments, "toy" and "toy.second", beside the real ones."""
    folder = tmp_path / "toys"
    (folder / "toy").mkdir(parents=True)
    (folder / "toy" / "first.py").write_text(MODULE)
    (folder / "toy" / "first.toml").write_text(CONFIG)
    (folder / "toy" / "second.py").write_text("from .first import second as second")
    second = """\
        description = "A draw"
        reproduces = "Nobody 1900, table 2"
        [quick]
    """
    (folder / "toy" / "second.toml").write_text(textwrap.dedent(second))
    monkeypatch.setattr(experiments, "__path__", [*experiments.__path__, str(folder)])
    monkeypatch.setattr(registry, "_registered", {})
    monkeypatch.delenv("JAXSH_DATA", raising=False)
    monkeypatch.chdir(tmp_path)  # where "results" is, were a run to start that should not
    importlib.invalidate_caches()
    yield Runner(folder, tmp_path / "results", capsys)
    for module in ("experiments.toy", "experiments.toy.first", "experiments.toy.second"):
        sys.modules.pop(module, None)
