"""What reaches a surface of the light around it: transfer, baked once per mesh, and its shading.

`bake` casts the rays and projects what each vertex sees; the shading that follows is a product of
coefficients, for any light, and differentiates.
"""

from ._bake import bake
from ._eye_product import EyeProduct, eye_product
from ._file import load, save
from ._glossy import shade_glossy
from ._light_product import LightProduct, light_product
from ._material import Material
from ._quantized import QuantizedTransfer, quantize
from ._sampled import SampledTransfer, sample
from ._shade import shade_diffuse
from ._transfer import Transfer

__all__ = [
    "EyeProduct",
    "LightProduct",
    "Material",
    "QuantizedTransfer",
    "SampledTransfer",
    "Transfer",
    "bake",
    "eye_product",
    "light_product",
    "load",
    "quantize",
    "sample",
    "save",
    "shade_diffuse",
    "shade_glossy",
]
