"""What reaches a surface of the light around it: transfer, baked once per mesh, and its shading.

`bake` casts the rays and projects what each vertex sees; the shading that follows is a product of
coefficients, for any light, and differentiates.
"""

from ._bake import bake
from ._file import load, save
from ._material import Material
from ._shade import shade_diffuse
from ._transfer import Transfer

__all__ = ["Material", "Transfer", "bake", "load", "save", "shade_diffuse"]
