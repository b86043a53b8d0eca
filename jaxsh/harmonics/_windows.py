"""Windows: factors per band against the ringing that leaves a truncated light negative."""

import functools
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, as_float, check_choice, check_degree
from .._core.host import put
from .._core.known import is_concrete
from ._indexing import degrees, orders

WINDOWS = ("none", "hann", "lanczos", "zonal-sinc", "positive")


def window(
    kind: Literal["none", "hann", "lanczos", "zonal-sinc", "positive"], degree: int
) -> Float[Array, " k"]:
    """Make a fixed window to multiply coefficients by, shape (K,) in JAX's default float type.

    For N = degree + 1 bands the factors are:

    - `"none"`: ones;
    - `"hann"`: (1 + cos(πl/N))/2;
    - `"lanczos"`: sinc(πl/N) = sin(πl/N)/(πl/N), also called the sinc window or Lanczos σ;
    - `"zonal-sinc"`: the same, but on m = 0 alone (Habel et al. 2008, eq. 5), for an edge along
      the horizon;
    - `"positive"`: of all windows whose kernel Σ (2l+1)/4π w_l P_l is nowhere negative, the nearest
      to none, min Σ (2l+1)/l² (1 - w_l)²: weights between those of a bright spot and those of what
      a diffuse surface sees. Any light without negative values has none under it either, which
      the others do not promise.

    The stronger the window, the less ringing and the more blur: `dering` finds the least that a
    given light needs, and `docs/ringing.md` says what each costs. Raises `ValueError` for another
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
        case "positive":
            values = _positive(degree)[l]
    return put(values, jnp.result_type(float))


def damping(strength: Float[ArrayLike, "*batch"], degree: int) -> Float[Array, "*batch k"]:
    """Make the window 1 / (1 + strength·l²(l+1)²) of Sloan 2008.

    It minimises the squared error plus `strength` times the squared Laplacian. `dering` has a
    better one, `softening`.

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
    return _damping(strength, degree)


@functools.partial(jax.jit, static_argnums=1)
def _damping(strength, degree: int):
    strength = strength[..., None]
    squared = ((degrees(degree) * (degrees(degree) + 1.0)) ** 2).astype(strength.dtype)
    strength, squared = align(strength, jnp.asarray(squared))
    # The mean is set apart: an infinite strength times its zero would be NaN.
    damped = 1 / (1 + strength * jnp.where(squared > 0, squared, 1))
    return jnp.where(squared > 0, damped, jnp.ones_like(damped))


def softening(strength: Float[ArrayLike, "*batch"], degree: int) -> Float[Array, "*batch k"]:
    """Make the window of `dering`: none at 0, `"positive"` at 1, nothing but the mean at 2.

    Linear in between: the value of a windowed function in any direction is, too.

    **Arguments**

    - `strength`: (...), from 0 to 2. At 1 nothing is left negative of a light that had no negative
      value before it was projected. Differentiable, with kinks at 0, 1 and 2.
    - `degree`: the largest l, known at trace time.

    **Returns** factors (..., K) in the dtype of the strength. Raises `ValueError` for a strength
    outside, where its value is known before tracing.

    **Example**

    >>> from jaxsh import harmonics
    >>> window = harmonics.softening(0.5, degree=1)  # halfway to 1, 1/3, 1/3, 1/3
    >>> [round(float(w), 3) for w in window]
    [1.0, 0.667, 0.667, 0.667]
    """
    strength, degree = as_float(strength, "strength"), check_degree(degree)
    if is_concrete(strength):
        known = np.asarray(strength)
        if (outside := (known < 0) | (known > 2)).any():
            raise ValueError(
                f"a window's strength must be from 0 to 2, got {known[outside].flat[0]:g}"
            )
    return _softening(strength, degree)


@functools.partial(jax.jit, static_argnums=1)
def _softening(strength, degree: int):
    strength = strength[..., None]
    l = degrees(degree)
    strength, positive, higher = align(
        strength,
        jnp.asarray(_positive(degree)[l], strength.dtype),
        jnp.asarray(l > 0, strength.dtype),
    )
    to_mean = jnp.clip(strength - 1, 0, 1)
    return 1 - higher * (positive * to_mean + (1 - positive) * jnp.clip(strength, 0, 1))


@functools.cache
def _positive(degree: int) -> Float[np.ndarray, " bands"]:
    """The window `"positive"`, by band.

    With a_l = √(2l+1)/l and u_l = a_l w_l it is the point nearest to a where the kernel
    1 + Σ (2l+1)/a_l P_l(z) u_l >= 0 at all z: least distance programming, which is non-negative
    least squares in disguise (Lawson & Hanson 1974, ch. 23).
    """
    if degree == 0:
        return np.ones(1)
    from scipy.optimize import nnls

    l = np.arange(1, degree + 1)
    none = np.sqrt(2 * l + 1.0) / l

    def kernels(count: int) -> Float[np.ndarray, "z bands"]:
        z = np.cos(np.linspace(0, np.pi, count * (degree + 1)))
        return np.polynomial.legendre.legvander(z, degree)[:, 1:] * ((2 * l + 1) / none)

    # The shortest y = u - a with kernel y >= -(1 + kernel a).
    kernel = kernels(64)
    system = np.vstack([kernel.T, -(1 + kernel @ none)])
    aim = np.eye(degree + 1)[-1]
    residual = system @ nnls(system, aim, maxiter=100 * degree)[0] - aim
    u = none - residual[:-1] / residual[-1]
    # Between the points it dips below zero, ever so little beside its mean, which is 1.
    dip = max(0.0, -1 - float((kernels(512) @ u).min()))
    return np.append(1, u / none / (1 + dip))
