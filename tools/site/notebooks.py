"""The notebooks as tutorials: executed, and shown with their pictures. A hook of MkDocs."""

import base64
import math
import os
import re
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import nbformat
from executed import NOTEBOOKS, execute
from mkdocs.structure.files import File, Files


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
            f"-   [![{title}]({_card(path.stem, pictures)})]({path.stem}.md)\n\n"
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


# Pictures that show best what a tutorial is about, where that is not the one of a card's shape.
_CARDS = {"02_light_a_mesh": 2, "05_adaptive": 0}


def _card(stem: str, pictures: dict[str, bytes]) -> str:
    """Name of the picture that stands for a tutorial: nearest to 16 : 9, unless it is chosen."""

    def stretch(name: str) -> float:
        width, height = (int.from_bytes(pictures[name][at : at + 4]) for at in (16, 20))
        return abs(math.log(width / height * 9 / 16))

    names = list(pictures)
    return names[_CARDS[stem]] if stem in _CARDS else min(names, key=stretch)


def _opening(notebook: nbformat.NotebookNode) -> tuple[str, str]:
    """Title and first paragraph."""
    heading, _, rest = notebook.cells[0]["source"].partition("\n")
    about = " ".join(rest.strip().split("\n\n")[0].split())
    return heading.removeprefix("# "), _with_links(about)


def _with_links(text: str) -> str:
    """Links to `../docs/PAGE.md`, right in Jupyter and on a forge, made those of the site."""
    return re.sub(r"\]\(\.\./docs/", "](../", text)


def _shown(notebook: nbformat.NotebookNode, stem: str, pictures: dict[str, bytes]) -> Iterator[str]:
    """The cells as Markdown; `pictures` gets what they drew, by name."""
    title, _ = _opening(notebook)
    for number, cell in enumerate(notebook.cells):
        source = cell["source"]
        if cell["cell_type"] == "markdown":
            if number == 0:
                yield "---\nhide: [toc]\n---"
            yield _with_links(source)
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
