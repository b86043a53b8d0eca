"""LaTeX between dollars as MathML, made while the pages are built: no script, no network.

A hook of MkDocs. Arithmatex finds the formulas; what it marks is replaced here.
"""

import functools
import html
import re
from typing import Any

from latex2mathml.converter import convert

_MARKED = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)

# Before the conversion: what latex2mathml does not know, in its words.
_LATEX = [
    (r"\\(?:l|r)Vert\b", lambda found: rf"\{_side(found)}\|"),
    (r"\\(?:l|r)vert\b", lambda found: rf"\{_side(found)}|"),
    (r"\{aligned\}", "{align*}"),
    (r"\\operatorname\{(\w+)\}(?=[(_])", r"\\text{\1}"),
    (r"\\operatorname\{(\w+)\}", r"\\text{\1}\\,"),
]
# After it: operators that browsers space as such, and functions apart from their arguments.
_MATHML = [
    (r"<mo>&#x0002F;</mo>", '<mo lspace="0" rspace="0">/</mo>'),
    (r"<mi>&#x000B1;</mi>", "<mo>&#x000B1;</mo>"),
    (r"<mo>(&#x0220[27];|&#x02202;|&#x02207;)</mo>", r"<mi>\1</mi>"),
    (
        r"(<mi>(?:sin|cos|log|exp)</mi>|<msup><mi>(?:sin|cos)</mi><mn>\d</mn></msup>)(?=<m[in])",
        r'\1<mspace width="0.167em"/>',
    ),
]


def on_page_content(content: str, **_: Any) -> str:
    """Replace each marked formula."""
    return _MARKED.sub(_replace, content)


def _replace(found: re.Match[str]) -> str:
    display = "block" if found[1] == "div" else "inline"
    return to_mathml(html.unescape(found[2]).strip(), display)


def _side(found: re.Match[str]) -> str:
    return "left" if found[0].startswith(r"\l") else "right"


@functools.cache
def to_mathml(latex: str, display: str = "inline") -> str:
    """Convert one formula; in the search index it would be noise."""
    for pattern, replacement in _LATEX:
        latex = re.sub(pattern, replacement, latex)
    made = convert(latex, display=display)
    for pattern, replacement in _MATHML:
        made = re.sub(pattern, replacement, made)
    made = made.replace("<math ", "<math data-search-exclude ", 1)
    return f'<div class="formula">{made}</div>' if display == "block" else made
