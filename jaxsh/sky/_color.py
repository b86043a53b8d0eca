"""Conversion of a sky's chromaticity and luminance to XYZ and linear sRGB."""

from typing import Literal, get_args

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._core.checks import check_choice
from .._core.host import read_only_cache

Space = Literal["srgb", "xyz", "xyY"]

# x, y of red, green, blue and white (ITU-R BT.709; IEC 61966-2-1).
_PRIMARIES = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]])
_WHITE = np.array([0.3127, 0.3290])


@read_only_cache(maxsize=None)
def xyz_to_srgb() -> Float[np.ndarray, "3 3"]:
    """Matrix (3, 3) from XYZ to linear sRGB, derived from primaries and white in full precision.

    Primaries and white point (0.3127, 0.3290) of ITU-R BT.709; white has Y = 1, so that the three
    primaries add up to it. On the host, in float64 and read-only.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> white = np.array([0.3127 / 0.3290, 1.0, 0.3583 / 0.3290])
    >>> np.round(sky.xyz_to_srgb() @ white, 6).tolist()
    [1.0, 1.0, 1.0]
    """
    primaries, white = _xyz_at_unit_sum(_PRIMARIES), _xyz_at_unit_sum(_WHITE) / _WHITE[1]
    return np.linalg.inv(primaries.T * np.linalg.solve(primaries.T, white))


def from_xyy(
    x: Float[Array, "*batch"],
    y: Float[Array, "*batch"],
    luminance: Float[Array, "*batch"],
    space: Space,
) -> Float[Array, "*batch 3"]:
    """Color of given chromaticity and luminance in a named space; nothing is clamped."""
    if space == "xyY":
        return jnp.stack([x, y, luminance], axis=-1)
    scale = luminance / y
    return from_xyz(x * scale, luminance, (1 - x - y) * scale, space)


def from_xyz(
    x: Float[Array, "*batch"], y: Float[Array, "*batch"], z: Float[Array, "*batch"], space: Space
) -> Float[Array, "*batch 3"]:
    if space == "xyz":
        return jnp.stack([x, y, z], axis=-1)
    if space == "xyY":
        total = x + y + z
        return jnp.stack([x / total, y / total, y], axis=-1)
    # Written out: a product with a 3 × 3 matrix is no work for a matrix routine.
    rows = [row[0] * x + row[1] * y + row[2] * z for row in xyz_to_srgb().tolist()]
    return jnp.stack(rows, axis=-1)


def check_space(space: str) -> None:
    check_choice("space", space, get_args(Space))


def _xyz_at_unit_sum(chromaticity: Float[np.ndarray, "*batch 2"]) -> Float[np.ndarray, "*batch 3"]:
    return np.concatenate([chromaticity, 1 - chromaticity.sum(axis=-1, keepdims=True)], axis=-1)
