"""The sun apart from the sky: its disc, its radiance through the atmosphere, its harmonics."""

import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, check_batches, check_degree
from .._core.linalg import matmul
from ..harmonics import degrees, evaluate
from ._angles import angles, directions, parameter
from ._colour import Space, check_space, from_xyz
from ._solar_tables import OZONE, SOLAR_RADIANCE, STEP, WATER, WAVELENGTHS, colour_matching
from ._validity import Check, check_option, check_sun, check_turbidity

# Radians: the mean over a year, 6.8e-5 sr.
SUN_RADIUS = math.radians(0.2666)

# Photometry: 683 lm/W at the peak, and kcd for cd.
_KILOLUMENS_PER_WATT = 0.683


def sun_radiance(
    sun: Float[ArrayLike, "*suns 3"],
    turbidity: Float[ArrayLike, "*turbidities"],
    *,
    space: Space = "srgb",
    check: Check = "raise",
) -> Float[Array, "*out 3"]:
    """Radiance of the sun's disc seen through the atmosphere, kcd/m²: (..., 3).

    Preetham et al. 1999, appendix A.1: the sun's spectrum above the atmosphere times the
    transmittance by Rayleigh scattering, aerosol (Ångström, α = 1.3, β = 0.04608 T - 0.04586),
    ozone (0.35 cm) and water vapour (2 cm) along the relative optical mass of Kasten. Summed
    every 10 nm from 380 to 750 nm with the colour matching of Wyman et al. 2013, which leaves
    about 1 % of doubt. The mixed gases absorb outside of that range only. Limb darkening is in
    the mean, not in the shape.

    Arguments and `check` as for `preetham_radiance`. Zero below the horizon; differentiable, with
    a step at the horizon and a cone in the zenith (derivative zero).
    """
    check_space(space)
    check_option(check)
    sun = directions(sun, "sun")
    turbidity = parameter(turbidity, sun.dtype)
    check_batches(sun=sun.shape, turbidity=(*turbidity.shape, 1))
    check_turbidity(turbidity, check)
    check_sun(sun, check)
    return _radiance(sun, turbidity, space)


def sun_harmonics(
    sun: Float[ArrayLike, "*suns 3"],
    turbidity: Float[ArrayLike, "*turbidities"],
    degree: int = 6,
    *,
    radius: float = SUN_RADIUS,
    space: Space = "srgb",
    check: Check = "raise",
) -> Float[Array, "*out 3 k"]:
    """Coefficients of the sun as a uniform disc of `sun_radiance`: (..., 3, K), kcd/m².

    c_lm = L λ_l y_lm(s) with λ_l = 2π ∫_{cos ρ}^1 P_l(x) dx in closed form: a zonal kernel turned
    to the sun. Add to the sky's coefficients for the light of both. `radius` is the disc's angle
    ρ in radians, known at trace time; the light is in proportion to the disc's solid angle. Near
    the horizon all of the disc counts while its centre is up.
    """
    degree = check_degree(degree)
    if not 0 < radius <= math.pi:
        raise ValueError(f"radius must be in (0, π] radians, got {radius}")
    radiance = sun_radiance(sun, turbidity, space=space, check=check)
    basis = evaluate(directions(sun, "sun"), degree)
    basis, lambdas = align(basis, jnp.asarray(disc_lambdas(radius, degree), basis.dtype))
    return jnp.multiply(*align(radiance[..., None], (basis * lambdas)[..., None, :]))


def disc_lambdas(radius: float, degree: int) -> Float[np.ndarray, " k"]:
    """λ_l of a disc, one for each coefficient, on the host.

    ∫_c^1 P_l = (1 - c²) P_l'(c) / (l(l+1)): the usual difference of two Legendre polynomials
    would lose as many digits as the disc is small.
    """
    cosine, sine = math.cos(radius), math.sin(radius)
    lambdas = [4 * math.pi * math.sin(radius / 2) ** 2]
    for l in range(1, degree + 1):
        slope = np.polynomial.Legendre.basis(l).deriv()(cosine)
        lambdas.append(2 * math.pi * sine**2 * slope / (l * (l + 1)))
    return np.array(lambdas)[degrees(degree)]


@functools.partial(jax.jit, static_argnames=("space",))
def _radiance(sun, turbidity, space: Space):
    turbidity, sun = align(turbidity[..., None], sun)
    geometry, turbidity = angles(sun, sun), turbidity[..., 0]
    mass = optical_mass(geometry.theta_sun, geometry.cos_sun)
    spectrum = _transmittance(*(t[..., None] for t in jnp.broadcast_arrays(mass, turbidity)))
    weights = _KILOLUMENS_PER_WATT * STEP * colour_matching() * SOLAR_RADIANCE
    x, y, z = jnp.moveaxis(matmul(spectrum, jnp.asarray(weights.T, sun.dtype)), -1, 0)
    above = (geometry.cos_sun >= 0)[..., None]
    return jnp.where(above, from_xyz(x, y, z, space), 0)


def optical_mass(
    theta_sun: Float[Array, "..."], cos_sun: Float[Array, "..."]
) -> Float[Array, "..."]:
    """Relative optical mass m (appendix A.1, Kasten 1965): 1 in the zenith, 36 on the horizon."""
    # Below the horizon, where nothing is seen, any finite value will do.
    theta = jnp.minimum(theta_sun, math.pi / 2) * (180 / math.pi)
    return 1 / (jnp.maximum(cos_sun, 0) + 0.15 * (93.885 - theta) ** -1.253)


def _transmittance(
    mass: Float[Array, "*batch 1"], turbidity: Float[Array, "*batch 1"]
) -> Float[Array, "*batch wavelengths"]:
    """Product of the transmittances of appendix A.1, wavelengths in µm there."""
    rayleigh, aerosol = 0.008735 * (WAVELENGTHS / 1000) ** -4.08, (WAVELENGTHS / 1000) ** -1.3
    rayleigh, aerosol, ozone, water = (
        align(mass, jnp.asarray(t, mass.dtype))[1]
        for t in (rayleigh, aerosol, 0.35 * OZONE, 2.0 * WATER)
    )
    beta = 0.04608 * turbidity - 0.04586
    vapour = 0.2385 * water * mass / (1 + 20.07 * water * mass) ** 0.45
    return jnp.exp(-mass * (rayleigh + beta * aerosol + ozone) - vapour)
