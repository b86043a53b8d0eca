"""The base color of a part of a surface."""

from typing import get_args

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float, UInt8

from .._core.checks import check_choice
from .._core.pictures import Wrap


class BaseColor(eqx.Module):
    """Holds the base color that a file gives to a part of the surface: factor times texture.

    `factor` is linear RGBA. `texture`, if any, is the picture as stored: 8-bit sRGB with linear
    alpha, shape (h, w, 4), its top row at v = 1. `double_sided` is what the file says of it.
    `unlit`: the base color is what the surface sends out already, under no other light
    (KHR_materials_unlit of glTF). `wrap`: what stands beyond [0, 1], "repeat", "clamp" or "mirror"
    as in `imaging.sample_texture`; between the outermost texels and the edge too;
    another raises `ValueError`.

    **Example**

    >>> from jaxsh import geometry
    >>> geometry.BaseColor("brick", (0.5, 0.2, 0.1, 1.0)).double_sided
    False
    """

    name: str = eqx.field(static=True, default="")
    factor: Float[Array | np.ndarray, "4"] | tuple[float, float, float, float] = (
        1.0,
        1.0,
        1.0,
        1.0,
    )
    texture: UInt8[Array | np.ndarray, "h w 4"] | None = None
    double_sided: bool = eqx.field(static=True, default=False)
    unlit: bool = eqx.field(static=True, default=False)
    wrap: Wrap = eqx.field(static=True, default="repeat")

    def __check_init__(self):
        check_choice("wrap", self.wrap, get_args(Wrap))
