"""LaTeX between dollars as MathML, made while the pages are built: no script, no network.

A hook of MkDocs. Arithmatex finds the formulas; what it marks is replaced here.
"""

import functools
import html
import re
from typing import Any

from latex2mathml.converter import convert

_MARKED = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


def on_page_content(content: str, **_: Any) -> str:
    """Replace each marked formula."""
    return _MARKED.sub(_replace, content)


def _replace(found: re.Match[str]) -> str:
    display = "block" if found[1] == "div" else "inline"
    return to_mathml(html.unescape(found[2]).strip(), display)


@functools.cache
def to_mathml(latex: str, display: str = "inline") -> str:
    """Convert one formula; in the search index it would be noise."""
    for name, bar in (("vert", "|"), ("Vert", r"\|")):
        latex = latex.replace(rf"\l{name}", rf"\left{bar}").replace(rf"\r{name}", rf"\right{bar}")
    made = convert(latex, display=display)
    made = made.replace("<mo>&#x0002F;</mo>", '<mo lspace="0" rspace="0">/</mo>')
    made = made.replace("<math ", "<math data-search-exclude ", 1)
    if display == "block":
        return f'<div class="formula">{made}</div>'
    return made
