"""Experiments run end to end, small: on the embedded data, with a mesh of few vertices if asked."""

import json
from pathlib import Path
from typing import Any

import pytest

from experiments.runner import Data
from experiments.runner.cli import main
from jaxsh import geometry

SMALL = 400  # vertices


def run(out: Path, name: str, *options: str, small: bool = False) -> tuple[Path, list[Any]]:
    """Run one experiment's quick preset with these overrides; its folder and its rows."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("JAXSH_DATA", raising=False)
        if small:
            knot = geometry.knot(SMALL)
            patch.setattr(Data, "mesh", lambda self, name: knot)
        assert main(["run", name, "--out", str(out), "--no-progress", *options]) == 0
    folder = out / name / "quick"
    return folder, json.loads((folder / "metrics.json").read_text())
