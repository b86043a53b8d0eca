"""Zonal kernels, given by their zonal SH coefficients g_l, and convolution with them."""

import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import (
    align,
    as_float,
    check_batches,
    check_coefficients,
    check_degree,
    check_flag,
)
from .._core.host import put
from .._core.known import host_known, is_concrete
from ._indexing import degrees


def clamped_cosine(degree: int) -> Float[Array, " bands"]:
    """Make the zonal coefficients g_l of max(0, cos θ), which turn radiance into irradiance.

    Closed form (Ramamoorthi & Hanrahan 2001, eq. 8 and 9): λ_l = π, 2π/3, π/4, 0, -π/24, …, zero
    at odd l > 1, where λ_l = √(4π/(2l+1)) g_l. The same as `phong(1, degree)`.

    **Returns** (degree+1,) in JAX's default float type, for `convolve`. `sphere.irradiance` does
    both.

    **Example**

    >>> from jaxsh import harmonics
    >>> [round(float(g), 3) for g in harmonics.clamped_cosine(degree=3)]
    [0.886, 1.023, 0.495, 0.0]
    """
    degree, dtype = check_degree(degree), np.dtype(jnp.result_type(float))
    return put(_phong(np, np.ones((), dtype), degree, False))


def phong(
    exponent: Float[ArrayLike, "*batch"], degree: int, *, normalized: bool = False
) -> Float[Array, "*batch bands"]:
    """Make the zonal coefficients g_l of the lobe max(0, cos θ)^exponent.

    λ_l = 2π I_l, where I_l = ∫_0^1 x^k P_l(x) dx obeys I_l = I_{l-2} (k-l+2)/(k+l+1) from
    I_0 = 1/(k+1) and I_1 = 1/(k+2), for any real exponent k > -1.

    **Arguments**

    - `exponent`: (...), k above -1. Differentiable.
    - `degree`: the largest l, known at trace time.
    - `normalized`: divide by λ_0, so that the lobe integrates to one and keeps a constant light.

    **Returns** (..., degree+1) in the dtype of the exponent, for `convolve`. Raises `ValueError`
    where the exponent's value is known before tracing and not finite and above -1.

    **Example**

    >>> from jaxsh import harmonics
    >>> harmonics.phong(32.0, degree=4, normalized=True).shape
    (5,)
    """
    degree, normalized = check_degree(degree), check_flag("normalized", normalized)
    k = as_float(exponent, "exponent")
    if is_concrete(k):
        known = np.asarray(k)
        if (wrong := ~((known > -1) & np.isfinite(known))).any():
            found = known[wrong].flat[0]
            raise ValueError(f"a Phong exponent must be finite and above -1, got {found:g}")
    # A few numbers: NumPy has them before a program is compiled.
    if host_known(k):
        return put(_phong(np, np.asarray(k), degree, normalized))
    return _traced_phong(k, degree, normalized)


def _phong(numpy: Any, k: Any, degree: int, normalized: bool) -> Any:
    integrals = [1 / (k + 1), 1 / (k + 2)]
    for l in range(2, degree + 1):
        integrals.append(integrals[-2] * (k - (l - 2)) / (k + (l + 1)))
    lambdas = 2 * np.pi * numpy.stack(integrals[: degree + 1], axis=-1)
    if normalized:
        lambdas = lambdas / lambdas[..., :1]
    return lambdas / _unit_lambdas(numpy, degree, lambdas)


@functools.partial(jax.jit, static_argnums=(1, 2))
def _traced_phong(k, degree: int, normalized: bool):
    return _phong(jnp, k, degree, normalized)


def disc(solid_angle: Float[ArrayLike, "*batch"], degree: int) -> Float[Array, "*batch bands"]:
    """Make the zonal coefficients g_l of a disc of radiance 1, dark outside of it.

    λ_l = 2π ∫_c^1 P_l(x) dx = 2π (1 - c²) P_l'(c) / (l(l+1)), c the cosine of the disc's radius:
    the usual difference of two Legendre polynomials would lose as many digits as the disc is small.

    **Arguments**

    - `solid_angle`: (...), 2π (1 - c), in steradians, from 0 to 4π. Differentiable.
    - `degree`: the largest l, known at trace time.

    **Returns** (..., degree+1) in the dtype of the solid angle, for `convolve`. Raises `ValueError`
    where the solid angle's value is known before tracing and not from 0 to 4π.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import harmonics
    >>> y = harmonics.evaluate(jnp.array([0.6, 0.0, 0.8]), degree=2)
    >>> sun = harmonics.convolve(y, harmonics.disc(6.8e-5, degree=2))
    >>> round(float(sun[0] / y[0]) * 1e5, 3)
    6.8
    """
    degree = check_degree(degree)
    omega = as_float(solid_angle, "solid_angle")
    if is_concrete(omega):
        known = np.asarray(omega)
        # A little above 4π, for its rounding in float32.
        if (wrong := ~((known >= 0) & (known <= 12.56638))).any():
            found = known[wrong].flat[0]
            raise ValueError(f"expected solid_angle from 0 to 4π, got {found:g}")
    if host_known(omega):
        return put(_disc(np, np.asarray(omega), degree))
    return _traced_disc(omega, degree)


def _disc(numpy: Any, omega: Any, degree: int) -> Any:
    height = omega / (2 * np.pi)  # 1 - c
    c = 1 - height
    lambdas = [omega]
    # P_{l+1}' = P_{l-1}' + (2l+1) P_l, and P_l by its own recurrence.
    one = numpy.ones_like(c)
    before, value, slope_before, slope = one, c, numpy.zeros_like(c), one
    for l in range(1, degree + 1):
        lambdas.append(omega * (2 - height) * slope / (l * (l + 1)))
        slope_before, slope = slope, slope_before + (2 * l + 1) * value
        before, value = value, ((2 * l + 1) * c * value - l * before) / (l + 1)
    stacked = numpy.stack(lambdas, axis=-1)
    return stacked / _unit_lambdas(numpy, degree, stacked)


@functools.partial(jax.jit, static_argnums=1)
def _traced_disc(omega, degree: int):
    return _disc(jnp, omega, degree)


def convolve(
    coefficients: Float[ArrayLike, "*batch k"], zonal: Float[ArrayLike, "*kernels bands"]
) -> Float[Array, "*out k"]:
    """Convolve a function with a zonal kernel g: band l times λ_l = √(4π/(2l+1)) g_l.

    (f * g)(n) = ∫ f(ω) g(ω·n) dω.

    **Arguments**

    - `coefficients`: (..., K) of f.
    - `zonal`: (..., degree+1), one g_l per band of f, as of `phong`. Batches broadcast.

    **Returns** (..., K) in the dtype of `coefficients`. Bilinear and differentiable in both.
    Raises `ValueError` where the degrees differ.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import harmonics
    >>> light = jnp.zeros((3, 9)).at[:, 0].set(1.0)
    >>> irradiance = harmonics.convolve(light, harmonics.clamped_cosine(2))
    >>> round(float(irradiance[0, 0]), 3)
    3.142
    """
    coefficients, zonal = as_float(coefficients, "coefficients"), as_float(zonal, "zonal")
    degree = check_coefficients("coefficients", coefficients)
    if zonal.ndim == 0 or zonal.shape[-1] != degree + 1:
        raise ValueError(
            f"coefficients of degree {degree} need a zonal kernel (..., {degree + 1}), one g_l per "
            f"band, got shape {zonal.shape}"
        )
    check_batches(coefficients=coefficients.shape, zonal=zonal.shape)
    return _convolve(coefficients, zonal, degree)


@functools.partial(jax.jit, static_argnums=2)
def _convolve(coefficients, zonal, degree: int):
    lambdas = zonal * _unit_lambdas(jnp, degree, zonal)
    each = lambdas[..., degrees(degree)].astype(coefficients.dtype)
    return jnp.multiply(*align(coefficients, each))


def _unit_lambdas(numpy: Any, degree: int, like: Any) -> Any:
    """Ratios λ_l / g_l = √(4π/(2l+1)), with the dtype and the rank of an array (..., degree+1)."""
    ratios = np.sqrt(4 * np.pi / (2 * np.arange(degree + 1) + 1))
    return numpy.asarray(ratios.reshape((1,) * (like.ndim - 1) + ratios.shape), like.dtype)
