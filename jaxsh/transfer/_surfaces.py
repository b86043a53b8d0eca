"""Surfaces as a bake takes them: their points and normals, and what these are."""

from typing import Any, Literal

from ..geometry import Mesh, Surface, Texels

# What the rows of a transfer are: vertices of a mesh, points, or texels of an atlas.
SurfaceKind = Literal["vertices", "points", "texels"]


def kind_of(surface: Surface) -> SurfaceKind:
    """Give the name of what light arrives at."""
    if isinstance(surface, Mesh):
        return "vertices"
    return "texels" if isinstance(surface, Texels) else "points"


def points_and_normals(surface: Surface) -> tuple[Any, Any]:
    """Give the points where light arrives, and their normals; None for those of a volume."""
    if isinstance(surface, Mesh):
        return surface.vertices, surface.normals
    return surface.positions, surface.normals
