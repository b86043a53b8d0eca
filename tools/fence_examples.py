"""Fence the examples of docstrings as code, for the documentation.

An extension of Griffe, named in mkdocs.yml: Markdown would take `>>>` for nested quotations.
"""

import re

import griffe

_EXAMPLE = re.compile(r"^>>> .*(?:\n.+)*", re.MULTILINE)


class FenceExamples(griffe.Extension):
    """Fence each run of lines that opens with `>>>` and ends before an empty one."""

    def on_instance(self, *, obj: griffe.Object, **_) -> None:
        if obj.docstring:
            obj.docstring.value = _EXAMPLE.sub(r"```pycon\n\g<0>\n```", obj.docstring.value)
