"""Pictures and lights in and out: probes, files of both, a camera and what it sees of a mesh.

Everything is linear radiance until `tone_map` makes it fit for a screen; tone curves live here
and nowhere else. Pictures are (height, width, channels), row 0 on top. What makes a picture from
numbers differentiates; what touches files or casts rays does not.
"""

from ._backdrop import backdrop, look_up
from ._base_color import base_color
from ._camera import Camera
from ._display import auto_exposure, psnr, srgb_decode, srgb_encode, tone_map
from ._environment import read_environment, studio
from ._light import read_light, write_light
from ._lightmap import write_lightmap
from ._movie import write_movie
from ._raster import Raster, interpolate, rasterize
from ._relit import write_relit
from ._splats import Splats, read_splats, write_splats
from ._texture import sample_texture
from ._write import write_image

__all__ = [
    "Camera",
    "Raster",
    "Splats",
    "auto_exposure",
    "backdrop",
    "base_color",
    "interpolate",
    "look_up",
    "psnr",
    "rasterize",
    "read_environment",
    "read_light",
    "read_splats",
    "sample_texture",
    "srgb_decode",
    "srgb_encode",
    "studio",
    "tone_map",
    "write_image",
    "write_light",
    "write_lightmap",
    "write_movie",
    "write_relit",
    "write_splats",
]
