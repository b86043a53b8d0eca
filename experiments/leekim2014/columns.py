"""Columns that tables on Lee & Kim 2014 share."""

from collections.abc import Iterable

from ..runner import Column

IN_FULL = (
    Column("fps einsum", "einsum", digits=1),
    Column("fps product form", "product form", digits=1),
    Column("fps full", "full", "full_paper", digits=1),
)


def per_method(what: str, methods: Iterable[str], paper: str) -> list[Column]:
    """A column for each; the paper's figures stand beside levels, its own method."""
    return [
        Column(f"{what} {method}", method, paper if method == "levels" else None, digits=1)
        for method in methods
    ]
