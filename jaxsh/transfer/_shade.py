"""Shading by products of coefficients."""

import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from ..harmonics._checks import align, as_float
from ._checks import checked_light
from ._transfer import Transfer


def shade_diffuse(
    light: Float[ArrayLike, "... 3 k"], transfer: Transfer, albedo: Float[ArrayLike, "..."]
) -> Float[Array, "... v 3"]:
    """Radiance albedo/π · Σ_k light_k T_k that leaves each of V diffuse vertices.

    **Arguments**

    - `light`: coefficients (3, K) that all vertices share, or with more axes (..., V, 3, K), one
      light for each vertex. So in a batch of shared lights an axis of length 1 takes the vertices'
      place: (batch, 1, 3, K).
    - `transfer`: of the light's degree or above. A lower light is exact, since harmonics are
      orthogonal; a higher one would lose its upper bands unsaid, and is refused.
    - `albedo`: a number, RGB (3,), or per vertex (V, 1) or (V, 3).

    **Returns** (..., V, 3), in the dtype of the transfer. Linear in light, transfer and
    albedo, and differentiable in each, forward and reverse. Values are not looked at.

    Raises `ValueError` for shapes that do not fit.
    """
    count, dtype = len(transfer.coefficients), transfer.coefficients.dtype
    light, albedo = checked_light(light, count, transfer.degree, dtype), as_float(albedo)
    if albedo.shape not in ((), (3,), (count, 1), (count, 3)):
        raise ValueError(
            f"expected albedo as a number, (3,), ({count}, 1) or ({count}, 3), got shape "
            f"{albedo.shape}"
        )
    return _shade_diffuse(light, transfer.coefficients, albedo.astype(dtype))


@jax.jit
def _shade_diffuse(light, coefficients, albedo):
    width = coefficients.shape[-1]
    light = jnp.pad(light, [(0, 0)] * (light.ndim - 1) + [(0, width - light.shape[-1])])
    if light.ndim == 2 or light.shape[-3] == 1:
        batch = light.shape[:-3]
        products = tall_product(coefficients, light.reshape(math.prod(batch) * 3, width))
        irradiance = jnp.moveaxis(products.reshape(len(coefficients), *batch, 3), 0, -2)
    else:
        irradiance = jnp.sum(jnp.multiply(*align(light, coefficients[:, None])), axis=-1)
    return jnp.multiply(*align(irradiance, albedo / math.pi))


def tall_product(tall: Float[Array, "v k"], rows: Float[Array, "n k"]) -> Float[Array, "v n"]:
    """tall @ rowsᵀ, with rows of zeros up to eight.

    XLA's CPU kernel is faster with eight than with three.
    """
    filled = jnp.pad(rows, ((0, max(0, 8 - len(rows))), (0, 0)))
    return jnp.matmul(tall, filled.T, precision="highest")[:, : len(rows)]
