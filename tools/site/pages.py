"""What pages need beyond their Markdown: a hook of MkDocs.

What the experiments found stands on the pages of the papers: a line `<!-- findings: FOLDER -->` is
replaced by what stands below the title of experiments/FOLDER/README.md.
"""

import re
from pathlib import Path
from typing import Any

_FOLDERS = Path(__file__).parents[2] / "experiments"
# Their tables need the place of the table of contents.
_WIDE = {"other-packages.md", "what-is-read.md", "benchmarks.md"}
_MARK = re.compile(r"^<!-- findings: (\w+) -->$", re.MULTILINE)


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Put the findings in, and make room."""
    if page.file.src_uri in _WIDE:
        page.meta["hide"] = ["toc"]
    return _MARK.sub(lambda found: _findings(found[1]), markdown)


def _findings(folder: str) -> str:
    text = (_FOLDERS / folder / "README.md").read_text("utf-8")
    return text.partition("\n")[2].strip()
