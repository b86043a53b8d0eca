"""The code of a page, run as its reader runs it."""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]

_BLOCK = re.compile(r"^```(\w+)(?: title=\"(.+?)\")?\n(.*?)^```", re.DOTALL | re.MULTILINE)


def blocks(page: Path) -> list[str]:
    """Those of Python that run in order, in one namespace."""
    found = _BLOCK.findall(page.read_text("utf-8"))
    return [code for language, title, code in found if language == "python" and not title]


def files(page: Path) -> dict[str, str]:
    """What the page has its reader write: each block with a title, by that path."""
    return {title: text for _, title, text in _BLOCK.findall(page.read_text("utf-8")) if title}


def pictures(page: Path) -> list[Path]:
    """Those of `docs/images/how-to` that the page shows: each is drawn by its code, as a PNG."""
    shown = re.findall(r"\]\((\S*images/how-to/\S+)\)", page.read_text("utf-8"))
    return [(page.parent / path).resolve() for path in shown]


def run(page: Path, folder: Path) -> None:
    """Run the page in a folder, in a fresh process where warnings are errors: no x64, no strict
    promotion, no shape checks.

    `tests/documents/PAGE.py` goes before its blocks: it makes what a page takes from its reader.
    """
    for name, text in files(page).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, "utf-8")
    before = ROOT / "tests" / "documents" / f"{page.stem}.py"
    stand_in = [before.read_text("utf-8")] if before.exists() else []
    script = folder / "blocks.py"
    script.write_text("\n".join([*stand_in, *blocks(page)]), "utf-8")
    environment = os.environ | {"PYTHONPATH": str(ROOT), "MPLBACKEND": "agg"}
    environment.pop("JAXSH_DATA", None)  # the pictures are of what is made at run time
    subprocess.run(
        [sys.executable, "-W", "error", script.name], cwd=folder, env=environment, check=True
    )


def drawn(folder: Path, picture: Path) -> Path:
    """The one PNG of this name that the page's code has left."""
    [path] = folder.rglob(f"{picture.stem}.png")
    return path
