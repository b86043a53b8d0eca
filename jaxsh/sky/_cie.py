"""Fifteen standard skies of CIE S 011 / ISO 15469:2004, from overcast to clear and turbid."""

import math
import operator

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, as_finite, check_batches, described
from ._angles import angles, directions
from ._preetham import gradation
from ._validity import Check, check_option, check_sun

# a, b of the gradation and c, d, e of the indicatrix, types 1 to 15 (table 1 of the standard).
_TYPES = (
    (4.0, -0.70, 0.0, -1.0, 0.00),
    (4.0, -0.70, 2.0, -1.5, 0.15),
    (1.1, -0.80, 0.0, -1.0, 0.00),
    (1.1, -0.80, 2.0, -1.5, 0.15),
    (0.0, -1.00, 0.0, -1.0, 0.00),
    (0.0, -1.00, 2.0, -1.5, 0.15),
    (0.0, -1.00, 5.0, -2.5, 0.30),
    (0.0, -1.00, 10.0, -3.0, 0.45),
    (-1.0, -0.55, 2.0, -1.5, 0.15),
    (-1.0, -0.55, 5.0, -2.5, 0.30),
    (-1.0, -0.55, 10.0, -3.0, 0.45),
    (-1.0, -0.32, 10.0, -3.0, 0.45),
    (-1.0, -0.32, 16.0, -3.0, 0.30),
    (-1.0, -0.15, 16.0, -3.0, 0.30),
    (-1.0, -0.15, 24.0, -2.8, 0.15),
)


def cie_radiance(
    view: Float[ArrayLike, "*views 3"],
    sun: Float[ArrayLike, "*suns 3"],
    zenith_luminance: Float[ArrayLike, "*zeniths"] = 1.0,
    *,
    kind: int,
    check: Check = "raise",
) -> Float[Array, "*out 3"]:
    """Radiance of a CIE standard general sky, in units of `zenith_luminance`, e.g. kcd/m².

    L = L_z f(χ) φ(Z) / (f(Z_s) φ(0)) with φ(Z) = 1 + a exp(b/cos Z) and
    f(χ) = 1 + c (exp(dχ) - exp(dπ/2)) + e cos²χ (CIE S 011, eqs. 1 to 6).

    **Arguments**

    - `view`, `sun`: (..., 3), of any length; `zenith_luminance`: (...). Batches broadcast.
      Differentiable in all.
    - `kind`: 1 to 15. 1 and 3 are overcast, 5 is uniform, 7 to 10 partly cloudy, 12 the CIE clear
      sky, 13 the polluted, 15 the white-blue turbid.
    - `check`: a sun below the horizon raises, warns or is allowed.

    **Returns** (..., 3) linear sRGB of the white point, since the standard has no color: three
    equal channels, whose luminance is that of the sky; zero below the horizon. Kinks as for
    `preetham_radiance`. Raises `ValueError` for an unknown kind, and as `check` says.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> zenith, sun = np.array([0.0, 0.0, 1.0]), np.array([0.6, 0.0, 0.8])
    >>> luminance = sky.cie_radiance(zenith, sun, 5.0, kind=12)
    >>> [round(float(channel), 3) for channel in luminance]
    [5.0, 5.0, 5.0]
    """
    row = _coefficients(kind)
    check_option(check)
    view, sun = directions(view, "view"), directions(sun, "sun")
    dtype = jnp.result_type(view, sun)
    zenith = as_finite(zenith_luminance, "zenith_luminance", dtype=dtype)
    check_batches(view=view.shape, sun=sun.shape, zenith_luminance=(*zenith.shape, 1))
    check_sun(sun, check)
    return _radiance(view, sun, zenith, jnp.asarray(row, zenith.dtype))


@jax.jit
def _radiance(view, sun, zenith, coefficients):
    zenith, view, sun = align(zenith[..., None], view, sun)
    a, b, c, d, e = coefficients.reshape(5, *(1,) * (view.ndim - 1))
    geometry, zenith = angles(view, sun), zenith[..., 0]

    def indicatrix(angle, cosine):
        return 1 + c * (jnp.exp(d * angle) - jnp.exp(d * (math.pi / 2))) + e * cosine * cosine

    seen = gradation(a, b, geometry.cos_view) * indicatrix(geometry.gamma, geometry.cos_gamma)
    overhead = (1 + a * jnp.exp(b)) * indicatrix(geometry.theta_sun, geometry.cos_sun)
    luminance = jnp.where(geometry.cos_view >= 0, zenith * seen / overhead, 0)
    return jnp.broadcast_to(luminance[..., None], (*luminance.shape, 3))


def _coefficients(kind: int) -> tuple[float, ...]:
    try:
        number = operator.index(kind)
    except TypeError:
        number = 0
    if not 1 <= number <= len(_TYPES) or isinstance(kind, bool):
        raise ValueError(f"kind must be an integer from 1 to {len(_TYPES)}, got {described(kind)}")
    return _TYPES[number - 1]
