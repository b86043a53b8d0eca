"""Windows: what keeps a truncated light from going negative behind its bright source."""

from typing import Literal

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, as_float, check_degree, is_concrete
from ._indexing import degrees, orders

WINDOWS = ("none", "hann", "lanczos", "zonal-sinc")


def window(
    kind: Literal["none", "hann", "lanczos", "zonal-sinc"], degree: int
) -> Float[Array, " k"]:
    """Fixed window, shape (K,) in JAX's default float type: multiply coefficients by it.

    With N = degree + 1 bands:

    - `"none"`: ones;
    - `"hann"`: (1 + cos(πl/N))/2;
    - `"lanczos"`: sinc(πl/N) = sin(πl/N)/(πl/N), also called the sinc window or Lanczos σ;
    - `"zonal-sinc"`: the same, but on m = 0 alone (Habel et al. 2008, eq. 5), for an edge along
      the horizon.

    The stronger the window, the less ringing and the more blur: `dering` finds the least that a
    given function needs.
    """
    l, bands = degrees(degree), check_degree(degree) + 1
    match kind:
        case "none":
            values = np.ones(len(l))
        case "hann":
            values = (1 + np.cos(np.pi * l / bands)) / 2
        case "lanczos":
            values = np.sinc(l / bands)
        case "zonal-sinc":
            values = np.where(orders(degree) == 0, np.sinc(l / bands), 1.0)
        case _:
            raise ValueError(f"window must be one of {', '.join(WINDOWS)}, got {kind!r}")
    return jnp.asarray(values, jnp.result_type(float))


def damping(strength: Float[ArrayLike, "*batch"], degree: int) -> Float[Array, "*batch k"]:
    """The window 1 / (1 + strength·l²(l+1)²) that `dering` uses (Sloan 2008), shape (..., K).

    It minimises the squared error plus `strength` times the squared Laplacian. Strength zero is
    no window; infinity leaves the mean alone. Differentiable in the strength.
    """
    strength = as_float(strength)
    if is_concrete(strength) and np.any(np.asarray(strength) < 0):
        raise ValueError(f"a window's strength must be at least 0, got {strength}")
    strength = strength[..., None]
    squared = ((degrees(degree) * (degrees(degree) + 1.0)) ** 2).astype(strength.dtype)
    strength, squared = align(strength, jnp.asarray(squared))
    # The mean is set apart: an infinite strength times its zero would be no number.
    damped = 1 / (1 + strength * jnp.where(squared > 0, squared, 1))
    return jnp.where(squared > 0, damped, jnp.ones_like(damped))
