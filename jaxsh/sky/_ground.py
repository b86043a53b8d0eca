"""Ground below the sky: the lower hemisphere as a diffuse surface lit from above."""

import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, as_finite, as_float, check_batches, check_coefficients
from .._core.known import is_concrete
from ..harmonics import degree_of, index, num_coefficients


def horizontal_irradiance(
    coefficients: Float[ArrayLike, "*batch k"],
) -> Float[Array, "*batch"]:
    """Irradiance of level ground, with its factor π, by a light from above alone.

    Exact at any degree from 1 on, not only in the limit: where there is no light below the
    horizon, the clamped cosine may be replaced by cos θ, and E = √(4π/3) c_10. Takes (..., K),
    gives (...) in the light's unit times sr. Linear. Raises `ValueError` for degree 0.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> light = sky.preetham_harmonics(np.array([0.6, 0.0, 0.8]), 3.0, 1)
    >>> sky.horizontal_irradiance(light).shape
    (3,)
    """
    coefficients = as_finite(coefficients, "coefficients")
    _check_degree("coefficients", coefficients)
    return math.sqrt(4 * math.pi / 3) * coefficients[..., index(1, 0)]


def with_ground(
    light: Float[ArrayLike, "*batch c k"], albedo: Float[ArrayLike, "*albedos"]
) -> Float[Array, "*out c k"]:
    """Adds diffuse ground below the horizon to the light from above that lights it: (..., C, K).

    The lower hemisphere gets the constant radiance albedo/π · E, with E the light's own
    `horizontal_irradiance`, and its coefficients in closed form. It lessens the jump at the
    horizon, and so the ringing. `light` is that of sky, sun or their sum, without window and
    without ground.

    `albedo` is a number, one per channel (C,), or (..., C) in batches that broadcast with those
    of the light. Bilinear, differentiable in both. Raises `ValueError` for an albedo whose value
    is known and outside of [0, 1], and for a light of degree 0.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> light = sky.preetham_harmonics(np.array([0.6, 0.0, 0.8]), 3.0, 1)
    >>> sky.with_ground(light, np.array([0.3, 0.2, 0.1])).shape
    (3, 4)
    """
    light = as_finite(light, "light")
    _check_degree("light", light)
    if light.ndim < 2:
        raise ValueError(f"expected light (..., channels, K), got shape {light.shape}")
    irradiance = horizontal_irradiance(light)
    albedo = as_float(albedo, "albedo").astype(light.dtype)
    if is_concrete(albedo):
        known = np.asarray(albedo)
        if (wrong := ~((known >= 0) & (known <= 1))).any():
            raise ValueError(f"albedo must be in [0, 1], got {known[wrong].flat[0]:g}")
    check_batches(light=light.shape, albedo=(*albedo.shape, 1))
    radiance = jnp.multiply(*align(irradiance, albedo))[..., None] / math.pi
    step = jnp.asarray(_lower_hemisphere(light.shape[-1]), light.dtype)
    return jnp.add(*align(light, jnp.multiply(*align(radiance, step))))


def _check_degree(name: str, light: Array) -> None:
    if check_coefficients(name, light) < 1:
        raise ValueError(f"irradiance needs {name} of degree 1 or more, got degree 0")


def _lower_hemisphere(count: int) -> Float[np.ndarray, " k"]:
    """Coefficients of 1 below the horizon: zonal, from ∫_{-1}^0 P_l, zero for even l > 0."""
    degree = degree_of(count)
    coefficients = np.zeros(num_coefficients(degree))
    for l in range(degree + 1):
        antiderivative = np.polynomial.Legendre.basis(l).integ(lbnd=-1)
        scale = 2 * math.pi * math.sqrt((2 * l + 1) / (4 * math.pi))
        if l == 0 or l % 2:
            coefficients[index(l, 0)] = scale * antiderivative(0.0)
    return coefficients
