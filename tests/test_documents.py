"""What a newcomer would run first: the blocks of each page, from scratch."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot

ROOT = Path(__file__).parent.parent


PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def blocks(page: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE)


def default_run(paths: list[Path], quick: set[str]) -> list:
    """The paths as parameters, slow but for those that are quick."""
    return [
        pytest.param(path, id=path.stem, marks=() if path.stem in quick else pytest.mark.slow)
        for path in paths
    ]


@pytest.mark.parametrize(
    "page", default_run([page for page in PAGES if blocks(page)], {"README", "harmonics"})
)
def test_blocks_run_in_order(page, tmp_path):
    """The blocks of a page share one namespace, in a fresh process: no x64, no strict promotion,
    no shape checks, as at a user's.

    Names and files that a page takes from its reader are made small by `tests/documents/PAGE.py`.
    """
    if "import torch" in "".join(blocks(page)):
        pytest.importorskip("torch", reason=f"torch is not installed: {page.name} is not tried")
    before = ROOT / "tests" / "documents" / f"{page.stem}.py"
    stand_in = [before.read_text("utf-8")] if before.exists() else []
    script = tmp_path / "blocks.py"
    script.write_text("\n".join([*stand_in, *blocks(page)]), "utf-8")
    subprocess.run(
        [sys.executable, "-W", "error", script.name],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        check=True,
    )
    if page.stem == "README":
        shown = pyplot.imread(tmp_path / "knot.png")[..., :3]
        assert shown.shape[0] >= 256
        assert 0.1 < shown.mean() < 0.9
        assert np.ptp(shown.reshape(-1, 3), axis=0).min() > 0.5
