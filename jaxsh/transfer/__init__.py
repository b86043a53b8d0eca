"""Transfer of light to a surface, visibility and cosine, baked once per mesh, and its shading.

`bake` casts the rays and projects what each vertex sees, `unshadowed` needs none; the shading that
follows is a product of coefficients, for any light, and differentiates.
"""

from ._bake import bake, bake_on
from ._compress import compress
from ._compressed import CompressedTransfer
from ._file import load, save
from ._fixed_light import FixedLight, fixed_light
from ._fixed_view import FixedView, fixed_view
from ._fluence import fluence
from ._forms import QuantizedTransfer, SampledTransfer, quantize, sample
from ._material import Material
from ._shade import reflected_direction, shade_diffuse, shade_glossy
from ._sharded import shard_rows
from ._stored import StoredTransfer, open
from ._sun import shade_sun
from ._sun_visibility import SunVisibility, sun_visibility
from ._transfer import AbstractTransfer, Transfer
from ._unshadowed import unshadowed

__all__ = [
    "AbstractTransfer",
    "CompressedTransfer",
    "FixedLight",
    "FixedView",
    "Material",
    "QuantizedTransfer",
    "SampledTransfer",
    "StoredTransfer",
    "SunVisibility",
    "Transfer",
    "bake",
    "bake_on",
    "compress",
    "fixed_light",
    "fixed_view",
    "fluence",
    "load",
    "open",
    "quantize",
    "reflected_direction",
    "sample",
    "save",
    "shade_diffuse",
    "shade_glossy",
    "shade_sun",
    "shard_rows",
    "sun_visibility",
    "unshadowed",
]
