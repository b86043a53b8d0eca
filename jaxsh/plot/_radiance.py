"""Lights in any form, seen along directions."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from .._core.pictures import as_picture
from ..imaging import look_up
from ..sphere import reconstruct
from ._arrays import read, read_coefficients


def read_light(light: ArrayLike, name: str = "light") -> Float[np.ndarray, "..."]:
    """Read coefficients (C, K) or a lat-long picture (H, W, C), C = 1 or 3, or raise."""
    values = read(name, light)
    if values.ndim == 3:
        as_picture(name, light, lat_long=True)
    if values.ndim == 3 and values.shape[-1] in (1, 3) and values.size:
        return values
    if values.ndim == 1 or (values.ndim == 2 and values.shape[0] in (1, 3)):
        return np.atleast_2d(read_coefficients(values))
    raise ValueError(
        f"expected {name} as coefficients (K,), (1, K) or (3, K), or as a lat-long picture "
        f"(height, width, 1 or 3), got shape {values.shape}"
    )


def along(
    light: Float[np.ndarray, "..."], directions: Float[np.ndarray, "*shape 3"]
) -> Float[np.ndarray, "*shape c"]:
    """Look up the radiance of what `read_light` gave along directions."""
    flat = jnp.asarray(directions.reshape(-1, 3).astype(light.dtype))
    if light.ndim == 3:
        values = np.asarray(look_up(jnp.asarray(light), flat))
    else:
        values = np.asarray(reconstruct(jnp.asarray(light), flat)).T
    return values.reshape(*directions.shape[:-1], -1)
