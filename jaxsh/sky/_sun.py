"""Sun apart from the sky: its disc, its radiance through the atmosphere, its harmonics."""

import functools
import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, check_batches, check_degree, check_number
from .._core.host import read_only_cache
from .._core.linalg import matmul
from ..harmonics import convolve, disc, evaluate
from ._angles import angles, directions, parameter
from ._color import Space, check_space, from_xyz
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
    every 10 nm from 380 to 750 nm with the color matching of Wyman et al. 2013, which leaves
    about 1 % of doubt. The mixed gases absorb outside of that range only. Limb darkening is in
    the mean, not in the shape.

    Arguments and `check` as for `preetham_radiance`. Zero below the horizon; differentiable, with
    a step at the horizon and a cone in the zenith (derivative zero).

    A low sun is far darker here than in newer models: in luminance 2.6 % of Hosek and Wilkie's
    (2013) at turbidity 6 and an elevation of 5°, 87 % at turbidity 3 and 30°. So beside
    `hosek_radiance` a low sun is too dark.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> low, high = sky.sun_radiance(np.array([[1.0, 0.0, 0.1], [0.6, 0.0, 0.8]]), 3.0)
    >>> bool(low[0] / low[2] > high[0] / high[2])  # redder at the horizon
    True
    """
    check_space(space)
    check_option(check)
    sun = directions(sun, "sun")
    turbidity = parameter(turbidity, sun.dtype, "turbidity")
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
    the horizon all of the disc counts while its center is up. Differentiable in sun and turbidity.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> sun = np.array([0.6, 0.0, 0.8])
    >>> light = sky.preetham_harmonics(sun, 3.0, 4) + sky.sun_harmonics(sun, 3.0, 4)
    >>> light.shape
    (3, 25)
    """
    degree = check_degree(degree)
    radius = check_number("radius", radius, above=0.0, most=math.pi)
    radiance = sun_radiance(sun, turbidity, space=space, check=check)
    basis = evaluate(directions(sun, "sun"), degree)
    solid_angle = 4 * math.pi * math.sin(radius / 2) ** 2
    spread = convolve(basis, disc(jnp.asarray(solid_angle, basis.dtype), degree))
    return jnp.multiply(*align(radiance[..., None], spread[..., None, :]))


@functools.partial(jax.jit, static_argnames=("space",))
def _radiance(sun, turbidity, space: Space):
    turbidity, sun = align(turbidity[..., None], sun)
    geometry, turbidity = angles(sun, sun), turbidity[..., 0]
    mass = optical_mass(geometry.theta_sun, geometry.cos_sun)
    spectrum = _transmittance(*(t[..., None] for t in jnp.broadcast_arrays(mass, turbidity)))
    weights = jnp.asarray(atmosphere().weights.T, sun.dtype)
    x, y, z = jnp.moveaxis(matmul(spectrum, weights), -1, 0)
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
    """Product of the transmittances of appendix A.1."""
    rayleigh, aerosol, ozone, water = (
        align(mass, jnp.asarray(table, mass.dtype))[1] for table in atmosphere()[:4]
    )
    beta = 0.04608 * turbidity - 0.04586
    vapour = 0.2385 * water * mass / (1 + 20.07 * water * mass) ** 0.45
    return jnp.exp(-mass * (rayleigh + beta * aerosol + ozone) - vapour)


WAVELENGTHS = np.arange(380.0, 751.0, 10.0)  # nm
STEP = 10.0

# Preetham et al. 1999, table 2. Radiance of the sun's disc above the atmosphere, in
# W/(cm² µm sr); ten times that is W/(m² nm sr).
SOLAR_RADIANCE = 10 * np.array([
    1655.9, 1623.37, 2112.75, 2588.82, 2582.91, 2423.23, 2676.05, 2965.83, 3054.54,
    3005.75, 3066.37, 2883.04, 2871.21, 2782.5, 2710.06, 2723.36, 2636.13, 2550.38,
    2506.02, 2531.16, 2535.59, 2513.42, 2463.15, 2417.32, 2368.53, 2321.21, 2282.77,
    2233.98, 2197.02, 2152.67, 2109.79, 2072.83, 2024.04, 1987.08, 1942.72, 1907.24,
    1862.89, 1825.92,
])  # fmt: skip


class Atmosphere(NamedTuple):
    """Holds what the sun's radiance is made of, by wavelength."""

    rayleigh: Float[np.ndarray, " wavelengths"]
    aerosol: Float[np.ndarray, " wavelengths"]  # times Ångström's β
    ozone: Float[np.ndarray, " wavelengths"]
    water: Float[np.ndarray, " wavelengths"]
    weights: Float[np.ndarray, "3 wavelengths"]  # of the transmittance in X, Y and Z


@read_only_cache(maxsize=None)
def atmosphere() -> Atmosphere:
    """Tables of appendix A.1, wavelengths in µm there."""
    return Atmosphere(
        0.008735 * (WAVELENGTHS / 1000) ** -4.08,
        (WAVELENGTHS / 1000) ** -1.3,
        0.35 * OZONE,
        2.0 * WATER,
        _KILOLUMENS_PER_WATT * STEP * color_matching() * SOLAR_RADIANCE,
    )


def _absorption(first: float, *values: float) -> Float[np.ndarray, " wavelengths"]:
    """Table of one value every 10 nm from `first` on, zero elsewhere."""
    table = np.zeros_like(WAVELENGTHS)
    start = int((first - WAVELENGTHS[0]) / STEP)
    table[start : start + len(values)] = values[: len(table) - start]
    return table


# The same table: ozone and water vapour in 1/cm. Of the mixed gases' two values only the first,
# oxygen's band at 760 nm, is listed there, and it lies beyond the spectrum.
OZONE = _absorption(
    450.0, 0.003, 0.006, 0.009, 0.014, 0.021, 0.030, 0.040, 0.048,
    0.063, 0.075, 0.085, 0.103, 0.120, 0.120, 0.115, 0.125, 0.120,
    0.105, 0.090, 0.079, 0.067, 0.057, 0.048, 0.036, 0.028, 0.023,
    0.018, 0.014, 0.011, 0.010, 0.009,
)  # fmt: skip
WATER = _absorption(690.0, 0.016, 0.024, 0.0125, 1.0, 0.87, 0.061, 0.001)


@read_only_cache(maxsize=None)
def color_matching() -> Float[np.ndarray, "3 wavelengths"]:
    """Curves x̄, ȳ, z̄ of the CIE 1931 observer: lobes of Wyman, Sloan and Shirley (2013), eq. 4."""

    def lobe(height, center, below, above):
        width = np.where(center > WAVELENGTHS, below, above)
        return height * np.exp(-(((WAVELENGTHS - center) / width) ** 2) / 2)

    return np.stack(
        [
            lobe(1.056, 599.8, 37.9, 31.0)
            + lobe(0.362, 442.0, 16.0, 26.7)
            - lobe(0.065, 501.1, 20.4, 26.2),
            lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
            lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
        ]
    )
