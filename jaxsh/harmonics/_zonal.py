"""Zonal kernels, given by their zonal SH coefficients g_l, and convolution with them."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, as_float, check_degree, is_concrete
from ._indexing import degree_of, degrees


def clamped_cosine(degree: int) -> Float[Array, " bands"]:
    """Zonal coefficients g_l of max(0, cos θ), shape (degree+1,), in JAX's default float type.

    In closed form (Ramamoorthi & Hanrahan 2001): λ_l = π, 2π/3, π/4, 0, -π/24, …, zero at odd
    l > 1. Convolution with it turns radiance into irradiance. The same as `phong(1, degree)`.
    """
    return phong(jnp.ones(()), degree)


def phong(
    exponent: Float[ArrayLike, "*batch"], degree: int, *, normalized: bool = False
) -> Float[Array, "*batch bands"]:
    """Zonal coefficients g_l of the lobe max(0, cos θ)^exponent, shape (..., degree+1).

    λ_l = 2π I_l, where I_l = ∫_0^1 x^k P_l(x) dx obeys I_l = I_{l-2} (k-l+2)/(k+l+1) from
    I_0 = 1/(k+1) and I_1 = 1/(k+2), for any real exponent k > -1; differentiable in it.
    `normalized` divides by λ_0, so that the lobe integrates to one and keeps a constant light.

    Raises `ValueError` where the exponent's value is known and not finite and above -1.
    """
    check_degree(degree)
    k = as_float(exponent)
    if is_concrete(k) and not np.all((np.asarray(k) > -1) & np.isfinite(k)):
        raise ValueError(f"a Phong exponent must be finite and above -1, got {k}")
    integrals = [1 / (k + 1), 1 / (k + 2)]
    for l in range(2, degree + 1):
        integrals.append(integrals[-2] * (k - (l - 2)) / (k + (l + 1)))
    lambdas = 2 * np.pi * jnp.stack(integrals[: degree + 1], axis=-1)
    if normalized:
        lambdas = lambdas / lambdas[..., :1]
    return jnp.divide(*align(lambdas, _unit_lambdas(degree, lambdas.dtype)))


def convolve(
    coefficients: Float[ArrayLike, "*batch k"], zonal: Float[ArrayLike, "*kernels bands"]
) -> Float[Array, "*out k"]:
    """Convolution of a function with a zonal kernel g: band l times λ_l = √(4π/(2l+1)) g_l.

    (f * g)(n) = ∫ f(ω) g(ω·n) dω. The kernel has one coefficient per band of the function.
    Batches broadcast. Bilinear and differentiable. Raises `ValueError` where the degrees differ.
    """
    coefficients, zonal = as_float(coefficients), as_float(zonal)
    degree = degree_of(coefficients.shape[-1] if coefficients.ndim else 0)
    if zonal.ndim == 0 or zonal.shape[-1] != degree + 1:
        raise ValueError(
            f"coefficients of degree {degree} need a kernel (..., {degree + 1}), one g_l per "
            f"band, got shape {zonal.shape}"
        )
    lambdas = jnp.multiply(*align(zonal, _unit_lambdas(degree, zonal.dtype)))
    return jnp.multiply(
        *align(coefficients, lambdas[..., degrees(degree)].astype(coefficients.dtype))
    )


def _unit_lambdas(degree: int, dtype) -> Float[Array, " bands"]:
    """λ_l / g_l."""
    return jnp.asarray(np.sqrt(4 * np.pi / (2 * np.arange(degree + 1) + 1)), dtype)
