"""Notebooks executed once, for the documentation and the tests alike.

What came out is kept under .cache/notebooks until the notebook, the package, JAX or matplotlib
changes, so that of the two who ask the second finds it there.
"""

import functools
import hashlib
import os
import sys
from importlib.metadata import version
from pathlib import Path

import nbclient
import nbformat

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
_KEPT = ROOT / ".cache" / "notebooks"


def execute(path: Path) -> nbformat.NotebookNode:
    """The notebook with its outputs; raises where a cell fails or warns, or none draws."""
    kept = _KEPT / f"{path.stem}-{_state(path)}.ipynb"
    if kept.exists():
        return nbformat.read(kept, as_version=4)
    notebook = nbformat.read(path, as_version=4)
    client = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": ROOT}})
    # Without a backend of the caller's, so that the kernel shows its figures.
    client.execute(env={name: value for name, value in os.environ.items() if name != "MPLBACKEND"})
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    warned = [output["text"] for output in outputs if output.get("name") == "stderr"]
    if warned:
        raise ValueError(f"{path.name} wrote to stderr: {warned[0]}")
    if not any("image/png" in output.get("data", {}) for output in outputs):
        raise ValueError(f"{path.name} shows no picture")
    _KEPT.mkdir(parents=True, exist_ok=True)
    for old in _KEPT.glob(f"{path.stem}-*.ipynb"):
        old.unlink(missing_ok=True)
    part = kept.with_suffix(f".{os.getpid()}")
    nbformat.write(notebook, part)
    part.replace(kept)
    return notebook


def _state(path: Path) -> str:
    """What an execution depends on, in 16 digits."""
    facts = [sys.version, version("jax"), version("matplotlib"), os.environ.get("JAXSH_DATA", "")]
    digest = hashlib.sha256("\n".join(facts).encode())
    digest.update(path.read_bytes())
    digest.update(_package().encode())
    return digest.hexdigest()[:16]


@functools.cache
def _package() -> str:
    digest = hashlib.sha256()
    for file in sorted((ROOT / "jaxsh").rglob("*")):
        if file.is_file() and file.suffix != ".pyc":
            digest.update(file.read_bytes())
    return digest.hexdigest()
