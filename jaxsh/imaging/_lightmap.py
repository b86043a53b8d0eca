"""Light per texel, written as a picture that goes with a mesh's UV."""

import os
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_finite, as_path, check_known, check_number, check_type
from ..geometry import Texels
from ._display import tone_map
from ._write import write_image

# A brightest texel that is scaled to 1 may come out a little above.
_WHITE = 1 + 1e-5


def write_lightmap(
    path: str | os.PathLike[str],
    texels: Texels,
    values: Float[ArrayLike, "n c"],
    *,
    exposure: float = 1.0,
) -> Path:
    """Write light at the texels of a mesh as a picture, a lightmap, and return the path.

    The picture is that of `texels.image`: its lower left corner at UV (0, 0), gutters filled, 0
    where no texel is near. It goes with `texels.mesh`, whose UV are the mesh's own or those of the
    unwrapping: write that with `geometry.write_mesh`.

    **Arguments**

    - `path`: .exr keeps linear values in float32, or float16 where they come in it: irradiance,
      what leaves a white surface, radiance. .png has 8 bits of what a screen shows,
      `tone_map(values, exposure)`. An existing file is replaced; missing folders are made.
    - `texels`: as from `geometry.texels`, n of them.
    - `values`: (n, 3), or (n, 1) for gray, in floats, as from `transfer.shade_diffuse`.
    - `exposure`: what a .png's values are multiplied by; divide by it what is read. Not for .exr.

    Runs on the host. Raises `ValueError` for other extensions and shapes, for NaN and infinite
    values, and for an exposure in an .exr; `OSError` where the file cannot be written. One
    `UserWarning` counts the texels that a .png cuts off at 1. Below 0, where a light rings, it is
    black.

    **Example**

    >>> import dataclasses, pathlib, tempfile
    >>> import jax.numpy as jnp
    >>> import numpy as np
    >>> from jaxsh import geometry, imaging
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> square = geometry.make_mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    >>> square = dataclasses.replace(square, uv=square.vertices[:, :2])
    >>> texels = geometry.texels(square, 16)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "light.png"
    ...     imaging.write_lightmap(path, texels, 0.5 * jnp.abs(texels.normals)).name
    'light.png'
    """
    path = as_path(path)
    check_type("texels", texels, Texels)
    check_known("texels", texels)
    check_known("values", values)
    suffix = path.suffix.lower()
    if suffix not in (".exr", ".png"):
        raise ValueError(f"{path}: cannot write {suffix or 'no extension'}, only .exr and .png")
    exposure = check_number("exposure", exposure, above=0.0)
    if suffix == ".exr" and exposure != 1:
        raise ValueError(f"{path}: an .exr keeps values as they are, got exposure={exposure:g}")
    light = _checked(values, texels)
    if suffix == ".png":
        brightest = exposure * np.asarray(light, np.float64).max(axis=1)
        if cut := int((brightest > _WHITE).sum()):
            warnings.warn(
                f"{path}: {cut:,} of {len(light):,} texels are cut off at 1, the brightest of "
                f"{brightest.max():.3g}: give a lower exposure, or write .exr",
                stacklevel=2,
            )
        # An exposure may be beyond float16, and so may what it makes of a value.
        light = tone_map(light.astype(np.promote_types(light.dtype, np.float32)), exposure)
    return write_image(path, texels.image(light))


def _checked(values: Any, texels: Texels) -> Float[Array, "n c"]:
    light = as_finite(values, "values", wait=True)
    if light.ndim != 2 or len(light) != texels.num_points or light.shape[1] not in (1, 3):
        raise ValueError(
            f"expected values ({texels.num_points}, 3) or ({texels.num_points}, 1), one row per "
            f"texel, got shape {light.shape}"
        )
    return light
