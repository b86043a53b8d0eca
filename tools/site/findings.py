"""What the experiments found, on the pages of the papers: a hook of MkDocs.

A line `<!-- findings: FOLDER -->` of a page is replaced by what stands below the title of
experiments/FOLDER/README.md.
"""

import re
from pathlib import Path
from typing import Any

_FOLDERS = Path(__file__).parents[2] / "experiments"
_MARK = re.compile(r"^<!-- findings: (\w+) -->$", re.MULTILINE)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Put the findings in."""
    return _MARK.sub(lambda found: _findings(found[1]), markdown)


def _findings(folder: str) -> str:
    text = (_FOLDERS / folder / "README.md").read_text("utf-8")
    return text.partition("\n")[2].strip()
