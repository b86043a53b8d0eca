"""Surfaces as a bake takes them: their points and normals."""

from typing import Any

from ..geometry import Mesh

Surface = Mesh


def points_and_normals(surface: Surface) -> tuple[Any, Any]:
    """Give the points where light arrives, and their normals; None for those of a volume."""
    return surface.vertices, surface.normals
