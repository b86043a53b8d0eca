"""The bake: what each vertex of a mesh sees of the light around it, measured with rays."""

from ._bake import bake

__all__ = ["bake"]
