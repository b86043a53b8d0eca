"""The bake: what each vertex of a mesh sees of the light around it, measured with rays."""

from ._bake import bake
from ._cluster import bake_on

__all__ = ["bake", "bake_on"]
