"""Windows: factors per band against the ringing that leaves a truncated light negative."""

from typing import Literal

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, as_float, check_choice, check_degree, is_concrete
from ._indexing import degrees, orders

WINDOWS = ("none", "hann", "lanczos", "zonal-sinc")


def window(
    kind: Literal["none", "hann", "lanczos", "zonal-sinc"], degree: int
) -> Float[Array, " k"]:
    """Make a fixed window to multiply coefficients by, shape (K,) in JAX's default float type.

    For N = degree + 1 bands the factors are:

    - `"none"`: ones;
    - `"hann"`: (1 + cos(πl/N))/2;
    - `"lanczos"`: sinc(πl/N) = sin(πl/N)/(πl/N), also called the sinc window or Lanczos σ;
    - `"zonal-sinc"`: the same, but on m = 0 alone (Habel et al. 2008, eq. 5), for an edge along
      the horizon.

    The stronger the window, the less ringing and the more blur: `dering` finds the least that a
    given light needs, and its docstring says what each costs. Raises `ValueError` for another
    kind.

    **Example**

    >>> from jaxsh import harmonics
    >>> [round(float(w), 3) for w in harmonics.window("hann", degree=1)]
    [1.0, 0.5, 0.5, 0.5]
    """
    check_choice("kind of window", kind, WINDOWS)
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
    return jnp.asarray(values, jnp.result_type(float))


def damping(strength: Float[ArrayLike, "*batch"], degree: int) -> Float[Array, "*batch k"]:
    """Make the window 1 / (1 + strength·l²(l+1)²) that `dering` uses (Sloan 2008).

    It minimises the squared error plus `strength` times the squared Laplacian.

    **Arguments**

    - `strength`: (...), at least 0. Zero is no window; infinity keeps nothing but the mean.
      Differentiable.
    - `degree`: the largest l, known at trace time.

    **Returns** factors (..., K) in the dtype of the strength. Raises `ValueError` for a negative
    strength, where its value is known before tracing.

    **Example**

    >>> from jaxsh import harmonics
    >>> window = harmonics.damping(0.25, degree=2)
    >>> round(float(window[1]), 3), round(float(window[4]), 3)
    (0.5, 0.1)
    """
    strength, degree = as_float(strength, "strength"), check_degree(degree)
    if is_concrete(strength) and (negative := np.asarray(strength) < 0).any():
        found = np.asarray(strength)[negative].flat[0]
        raise ValueError(f"a window's strength must be at least 0, got {found:g}")
    strength = strength[..., None]
    squared = ((degrees(degree) * (degrees(degree) + 1.0)) ** 2).astype(strength.dtype)
    strength, squared = align(strength, jnp.asarray(squared))
    # The mean is set apart: an infinite strength times its zero would be NaN.
    damped = 1 / (1 + strength * jnp.where(squared > 0, squared, 1))
    return jnp.where(squared > 0, damped, jnp.ones_like(damped))
