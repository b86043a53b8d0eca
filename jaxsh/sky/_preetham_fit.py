"""Preetham's sky in the parametrisation that makes it nearly polynomial."""

import functools
import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ._azimuth import zenith_angle
from ._chebyshev import Axis
from ._colour import xyz_to_srgb
from ._error import smallest_luminance
from ._fit import fit
from ._preetham import gradation, indicatrix, preetham_radiance, zenith_luminance, zenith_value
from ._preetham_constants import preetham_constants
from ._sky_fit import SkyFit

# From X, Y and W = X + Y + Z to linear sRGB.
MIX = xyz_to_srgb() @ np.array([[1.0, 0, 0], [0, 1, 0], [-1, -1, 1]])


def prefactor(sun: Float[Array, "n 3"], turbidity: Float[Array, " n"]) -> Float[Array, "n 3"]:
    """What X, Y and W are divided by before the fit: p_Y p_x / p_y, p_Y and p_Y / p_y.

    p_q = q_z(θ, τ) / F_q(0, θ) is all of the model that is not smooth where the sun passes the
    zenith, and nearly vanishes at τ ≈ 2, where the rest does not.
    """
    theta, cos_theta, table = zenith_angle(*sun.T), sun[:, 2], preetham_constants("paper")

    def over_gradation(zenith, coefficients):
        a, b, c, d, e = (slope * turbidity + intercept for slope, intercept in coefficients)
        return zenith / (
            gradation(a, b, jnp.ones_like(theta)) * indicatrix(c, d, e, theta, cos_theta)
        )

    luminance = over_gradation(zenith_luminance(theta, turbidity), table.luminance)
    x = over_gradation(zenith_value(table.zenith_x, theta, turbidity), table.x)
    y = over_gradation(zenith_value(table.zenith_y, theta, turbidity), table.y)
    return jnp.stack([luminance * x / y, luminance, luminance / y], axis=-1)


def preetham_fit(
    terms: tuple[int, int] = (12, 6),
    turbidity: tuple[float, float] = (2.5, 6.0),
    degree: int = 6,
    *,
    lawson: int = 0,
    **options,
) -> SkyFit:
    """The fit behind `preetham_harmonics` with any number of terms, range and degree.

    X, Y and W = X + Y + Z over their `prefactor`, as sin^m θ · T_i(θ²) T_j(log τ), weighted by
    1/L_min. Linear sRGB, kcd/m², the paper's constants. Further options as for `fit`.
    """
    return fit(
        _MODEL,
        {"turbidity": turbidity},
        degree=degree,
        terms=terms,
        log=["turbidity"],
        prefactor=prefactor,
        mix=MIX,
        weight=_weight,
        lawson=lawson,
        **options,
    )


def preetham_axes(low: float, high: float) -> tuple[Axis, ...]:
    """The variables of a `preetham_fit` for turbidities in [low, high]."""
    return (Axis("θ²", 0.0, math.pi**2 / 4), Axis("turbidity", low, high, log=True))


_MODEL = functools.partial(preetham_radiance, check="allow")


def _weight(sun, turbidity):
    return 1 / smallest_luminance(sun, turbidity)[..., 0]
