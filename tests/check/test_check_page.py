"""What docs/check.md says is printed."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_the_page_prints_what_it_says(tmp_path):
    page = (ROOT / "docs/check.md").read_text("utf-8")
    blocks = re.findall(r"^```(python)?\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    code = "\n".join(block for kind, block in blocks if kind)
    # A comment below a call, or a block of its own.
    said = [
        line.removeprefix("# ")
        for kind, block in blocks
        for line in block.splitlines()
        if not kind or line.startswith("# (")
    ]
    (tmp_path / "page.py").write_text(code, "utf-8")
    run = subprocess.run(
        [sys.executable, "page.py"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT), "PYTHONUTF8": "1"},
        check=True,
        capture_output=True,
        encoding="utf-8",
    )
    printed = iter(run.stdout.splitlines())
    assert len(said) > 10
    for line in said:
        assert line in printed, line  # in this order
