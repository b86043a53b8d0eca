"""Radiance of the sky by the analytic daylight model of Preetham, Shirley and Smits 1999."""

import functools
from typing import Literal, NamedTuple, get_args

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, check_batches, check_choice
from ._angles import Angles, angles, directions, parameter
from ._color import Space, check_space, from_xyy
from ._validity import Check, check_luminance, check_option, check_sun, check_turbidity

Constants = Literal["paper", "code"]
Coefficients = tuple[tuple[float, float], ...]  # A to E, each slope·τ + intercept
Matrix = tuple[tuple[float, float, float, float], ...]  # rows τ², τ, 1; columns θ³, θ², θ, 1


class PreethamConstants(NamedTuple):
    """Constants of appendix A.2 of Preetham et al. 1999, as nested tuples of numbers.

    `luminance`, `x`, `y`: A to E of F(θ, γ), each a slope and an intercept in turbidity;
    `zenith_x`, `zenith_y`: rows for τ², τ, 1 and columns for θ³, θ², θ, 1. See
    `preetham_constants`.

    **Example**

    >>> from jaxsh import sky
    >>> sky.preetham_constants("paper").luminance[0]  # A = 0.1787 τ - 1.4630
    (0.1787, -1.463)
    """

    luminance: Coefficients
    x: Coefficients
    y: Coefficients
    zenith_x: Matrix
    zenith_y: Matrix


_PAPER = PreethamConstants(
    luminance=(
        (0.1787, -1.4630),
        (-0.3554, 0.4275),
        (-0.0227, 5.3251),
        (0.1206, -2.5771),
        (-0.0670, 0.3703),
    ),
    x=(
        (-0.0193, -0.2592),
        (-0.0665, 0.0008),
        (-0.0004, 0.2125),
        (-0.0641, -0.8989),
        (-0.0033, 0.0452),
    ),
    y=(
        (-0.0167, -0.2608),
        (-0.0950, 0.0092),
        (-0.0079, 0.2102),
        (-0.0441, -1.6537),
        (-0.0109, 0.0529),
    ),
    zenith_x=(
        (0.00166, -0.00375, 0.00209, 0.0),
        (-0.02903, 0.06377, -0.03202, 0.00394),
        (0.11693, -0.21196, 0.06052, 0.25886),
    ),
    zenith_y=(
        (0.00275, -0.00610, 0.00317, 0.0),
        (-0.04214, 0.08970, -0.04153, 0.00516),
        (0.15346, -0.26756, 0.06670, 0.26688),
    ),
)

_CODE = PreethamConstants(
    luminance=(
        (0.17872, -1.46303),
        (-0.35540, 0.42749),
        (-0.02266, 5.32505),
        (0.12064, -2.57705),
        (-0.06696, 0.37027),
    ),
    x=(
        (-0.01925, -0.25922),
        (-0.06651, 0.00081),
        (-0.00041, 0.21247),
        (-0.06409, -0.89887),
        (-0.00325, 0.04517),
    ),
    y=(
        (-0.01669, -0.26078),
        (-0.09495, 0.00921),
        (-0.00792, 0.21023),
        (-0.04405, -1.65369),
        (-0.01092, 0.05291),
    ),
    zenith_x=(
        (0.00165, -0.00374, 0.00208, 0.0),
        (-0.02902, 0.06377, -0.03202, 0.00394),
        (0.11693, -0.21196, 0.06052, 0.25885),
    ),
    zenith_y=(
        (0.00275, -0.00610, 0.00316, 0.0),
        (-0.04214, 0.08970, -0.04153, 0.00515),
        (0.15346, -0.26756, 0.06669, 0.26688),
    ),
)


def preetham_constants(name: str) -> PreethamConstants:
    """Looks up the constants of Preetham et al. 1999, appendix A.2.

    `"paper"` are the printed ones, `"code"` the set with five decimals that many programs share.
    Raises `ValueError` for any other name.

    **Example**

    >>> from jaxsh import sky
    >>> [sky.preetham_constants(name).zenith_x[2][3] for name in ("paper", "code")]
    [0.25886, 0.25885]
    """
    check_choice("name of constants", name, get_args(Constants))
    return _PAPER if name == "paper" else _CODE


def preetham_radiance(
    view: Float[ArrayLike, "*views 3"],
    sun: Float[ArrayLike, "*suns 3"],
    turbidity: Float[ArrayLike, "*turbidities"],
    *,
    constants: Constants = "paper",
    space: Space = "srgb",
    check: Check = "raise",
) -> Float[Array, "*out 3"]:
    """Radiance of the sky without the sun's disc, in kcd/m² (times 1000: cd/m²).

    Preetham et al. 1999, appendix A.2, as Habel et al. 2008 use it: luminance Y and chromaticity
    x, y, each its zenith value times F(θ, γ) / F(0, θ_s), with
    F(θ, γ) = (1 + A exp(B/cos θ)) (1 + C exp(Dγ) + E cos²γ).

    **Arguments**

    - `view`, `sun`: (..., 3), vectors of any length towards sky and sun; `turbidity`: (...).
      Batches broadcast. Differentiable in all three.
    - `constants`: `"paper"`, the printed ones, or `"code"`, the set with five decimals that many
      programs share. They differ by up to 0.6 % of the maximum at sunset.
    - `space`: `"srgb"` (linear, Rec. 709 primaries), `"xyz"`, or `"xyY"`.
    - `check`: what becomes of a turbidity outside of [1.7, 10], a sun below the horizon (by more
      than rounding, 1e-6) and a negative luminance: `"raise"` a `ValueError`, `"warn"`
      (`SkyWarning`) or `"allow"`. Only values known outside of `jit` and `grad` can be looked at.

    **Returns** (..., 3), exactly zero below the horizon (z < 0). Nothing is clamped: blue in
    linear sRGB turns negative near sunset, and the luminance itself below a turbidity of about
    1.6 and for suns well below the horizon.

    Derivatives are finite everywhere. Kinks: the cone of exp(Dγ) at the sun and the antisolar
    point, and that of the zenith values where the sun stands in the zenith (the derivative along
    a cone's axis is set to zero); the step at the horizon (that of the sky above is given).
    Raises `ValueError` for shapes that do not broadcast and options that there are not.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> views = np.array([[0.0, 0.0, 1.0], [0.0, 0.6, -0.8]])  # up, and below the horizon
    >>> radiance = sky.preetham_radiance(views, np.array([0.6, 0.0, 0.8]), 3.0)
    >>> radiance.shape, bool((radiance[1] == 0).all())
    ((2, 3), True)
    """
    preetham_constants(constants)
    check_space(space)
    check_option(check)
    view, sun = directions(view, "view"), directions(sun, "sun")
    turbidity = parameter(turbidity, jnp.result_type(view, sun), "turbidity")
    check_batches(view=view.shape, sun=sun.shape, turbidity=(*turbidity.shape, 1))
    check_turbidity(turbidity, check)
    check_sun(sun, check)
    result, luminance = _radiance(view, sun, turbidity, constants, space)
    check_luminance(luminance, check)
    return result


@functools.partial(jax.jit, static_argnames=("constants", "space"))
def _radiance(view, sun, turbidity, constants: Constants, space: Space):
    """Color and, for the check, luminance."""
    table = preetham_constants(constants)
    turbidity, view, sun = align(turbidity[..., None], view, sun)
    geometry, turbidity = angles(view, sun), turbidity[..., 0]
    luminance, x, y = (
        zenith * _relative(coefficients, geometry, turbidity)
        for zenith, coefficients in (
            (zenith_luminance(geometry.theta_sun, turbidity), table.luminance),
            (zenith_value(table.zenith_x, geometry.theta_sun, turbidity), table.x),
            (zenith_value(table.zenith_y, geometry.theta_sun, turbidity), table.y),
        )
    )
    above = geometry.cos_view >= 0
    color = jnp.where(above[..., None], from_xyy(x, y, luminance, space), 0)
    return color, jnp.where(above, luminance, 0)


def zenith_luminance(
    theta_sun: Float[Array, "..."], turbidity: Float[Array, "..."]
) -> Float[Array, "..."]:
    """Luminance Y_z of the zenith in kcd/m² (appendix A.2)."""
    chi = (4 / 9 - turbidity / 120) * (jnp.pi - 2 * theta_sun)
    return (4.0453 * turbidity - 4.9710) * jnp.tan(chi) - 0.2155 * turbidity + 2.4192


def zenith_value(matrix: Matrix, theta_sun, turbidity):
    """Chromaticity x_z or y_z of the zenith: (τ², τ, 1) · M · (θ³, θ², θ, 1)ᵀ."""
    quadratic, linear, constant = (
        ((row[0] * theta_sun + row[1]) * theta_sun + row[2]) * theta_sun + row[3] for row in matrix
    )
    return (quadratic * turbidity + linear) * turbidity + constant


def _relative(coefficients: Coefficients, geometry: Angles, turbidity):
    """Ratio F(θ, γ) / F(0, θ_s)."""
    a, b, c, d, e = (slope * turbidity + intercept for slope, intercept in coefficients)
    seen = gradation(a, b, geometry.cos_view)
    seen = seen * indicatrix(c, d, e, geometry.gamma, geometry.cos_gamma)
    zenith = (1 + a * jnp.exp(b)) * indicatrix(c, d, e, geometry.theta_sun, geometry.cos_sun)
    return seen / zenith


def gradation(a, b, cos_theta):
    """Gradation 1 + a exp(b/cos θ) for b < 0, and its limit 1 from the horizon downwards."""
    # exp(b/c) is zero in every precision well before c is as small as this, and its derivative
    # b/c² is still finite.
    above = cos_theta > 1e-6
    return 1 + a * jnp.where(above, jnp.exp(b / jnp.where(above, cos_theta, 1)), 0)


def indicatrix(c, d, e, gamma, cos_gamma):
    return 1 + c * jnp.exp(d * gamma) + e * cos_gamma * cos_gamma
