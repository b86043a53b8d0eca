"""The notebooks as tutorials: executed, and shown with their pictures.

A hook of MkDocs; `execute` serves the tests as well, so that a notebook runs once for both. What
came out is kept under .cache/notebooks until the notebook, the package or JAX changes.
"""

import base64
import functools
import hashlib
import os
import re
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path
from typing import Any

import nbclient
import nbformat
from mkdocs.structure.files import File, Files

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


def on_files(files: Files, config: Any, **_: Any) -> Files:
    """Add a page and its pictures for each notebook, and the page that lists them."""
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        done = list(pool.map(execute, NOTEBOOKS))
    cards = []
    for path, notebook in zip(NOTEBOOKS, done, strict=True):
        pictures: dict[str, bytes] = {}
        text = "\n\n".join(_shown(notebook, path.stem, pictures))
        page = f"tutorials/{path.stem}.md"
        files.append(File.generated(config, page, content=text))
        files.append(File.generated(config, f"tutorials/{path.name}", content=path.read_bytes()))
        for name, data in pictures.items():
            files.append(File.generated(config, f"tutorials/{name}", content=data))
        title, about = _opening(notebook)
        cards.append(
            f"-   [![{title}]({next(iter(pictures))})]({path.stem}.md)\n\n"
            f"    **[{title}]({path.stem}.md)**\n\n    {about}"
        )
    listed = "\n\n".join(cards)
    index = f'{_INDEX}\n<div class="grid cards pictured" markdown>\n\n{listed}\n\n</div>\n'
    files.append(File.generated(config, "tutorials/index.md", content=index))
    return files


_INDEX = """# Tutorials

Each tutorial is a notebook of the checkout's `notebooks/`, executed while this page was built: what
it prints and draws is what came out. They run without data, and end with an exercise. Open
one yourself with `jupyter lab notebooks/`.
"""


def _opening(notebook: nbformat.NotebookNode) -> tuple[str, str]:
    """Title and first paragraph."""
    heading, _, rest = notebook.cells[0]["source"].partition("\n")
    return heading.removeprefix("# "), " ".join(rest.strip().split("\n\n")[0].split())


def _shown(notebook: nbformat.NotebookNode, stem: str, pictures: dict[str, bytes]) -> Iterator[str]:
    """The cells as Markdown; `pictures` gets what they drew, by name."""
    title, _ = _opening(notebook)
    for number, cell in enumerate(notebook.cells):
        source = cell["source"]
        if cell["cell_type"] == "markdown":
            if number == 0:
                yield "---\nhide: [toc]\n---"
            yield re.sub(r"\]\(\.\./docs/", "](../", source)
            if number == 0:
                yield f"*A tutorial: [the notebook]({stem}.ipynb), executed.*"
            continue
        # What only sets up how figures are shown in a notebook says nothing here.
        lines = [line for line in source.splitlines() if not line.startswith("%config")]
        yield "```python\n" + "\n".join(lines) + "\n```"
        printed = ""
        for output in cell["outputs"]:
            data = output.get("data", {})
            if "image/png" in data:
                name = f"{stem}-{len(pictures) + 1}.png"
                pictures[name] = base64.b64decode(data["image/png"])
                yield f"![{title}: what this cell draws]({name})"
            else:
                printed += output.get("text", data.get("text/plain", "")).rstrip("\n") + "\n"
        if printed:
            yield "```{.text .output}\n" + printed + "```"
