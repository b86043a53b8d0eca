"""Columns that several tables have."""

from ..runner import Column


def named(*keys: str, digits: int | None = None) -> list[Column]:
    """Columns whose headings are their keys."""
    return [Column(key, key, digits=digits) for key in keys]
