"""Shading by products of coefficients."""

import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, as_float
from .._core.linalg import tall_product
from .._core.xla import materialize
from ._block_sums import block_sums
from ._checks import checked_light
from ._quantized import QuantizedTransfer
from ._transfer import Transfer


def shade_diffuse(
    light: Float[ArrayLike, "... 3 k"],
    transfer: Transfer | QuantizedTransfer,
    albedo: Float[ArrayLike, "..."],
) -> Float[Array, "... v 3"]:
    """Radiance albedo/π · Σ_k light_k T_k that leaves each of V diffuse vertices.

    **Arguments**

    - `light`: coefficients (3, K) that all vertices share, or with more axes (..., V, 3, K), one
      light for each vertex. So in a batch of shared lights an axis of length 1 takes the vertices'
      place: (batch, 1, 3, K).
    - `transfer`: of the light's degree or above. A lower light is exact, since harmonics are
      orthogonal; a higher one would lose its upper bands unsaid, and is refused. What `quantize`
      made of it takes less time and memory, and shared lights alone.
    - `albedo`: a number, RGB (3,), or per vertex (V, 1) or (V, 3).

    **Returns** (..., V, 3), in the dtype of the transfer. Linear in light, transfer and
    albedo, and differentiable in each, forward and reverse. Values are not looked at.

    Raises `ValueError` for shapes that do not fit.
    """
    quantized = isinstance(transfer, QuantizedTransfer)
    count, dtype = transfer.count, transfer.dtype
    light, albedo = checked_light(light, count, transfer.degree, dtype), as_float(albedo)
    if quantized and light.ndim > 2 and light.shape[-3] != 1:
        raise ValueError(
            f"expected lights that all vertices share, for a quantized transfer, got {light.shape}"
        )
    if albedo.shape not in ((), (3,), (count, 1), (count, 3)):
        raise ValueError(
            f"expected albedo as a number, (3,), ({count}, 1) or ({count}, 3), got shape "
            f"{albedo.shape}"
        )
    return _shade_diffuse(light, transfer, albedo.astype(dtype))


@jax.jit
def _shade_diffuse(light, transfer, albedo):
    if light.ndim == 2 or light.shape[-3] == 1:
        batch = light.shape[:-3]
        products = irradiances(light.reshape(math.prod(batch) * 3, light.shape[-1]), transfer)
        irradiance = jnp.moveaxis(products.reshape(len(products), *batch, 3), 0, -2)
    else:
        coefficients = transfer.coefficients[:, : light.shape[-1]]
        irradiance = jnp.sum(jnp.multiply(*align(light, coefficients[:, None])), axis=-1)
    return jnp.multiply(*align(irradiance, albedo / math.pi))


def irradiances(
    rows: Float[Array, "n k"], transfer: Transfer | QuantizedTransfer
) -> Float[Array, "v n"]:
    """Of lights of the transfer's degree or below."""
    if isinstance(transfer, Transfer):
        width = transfer.coefficients.shape[-1]
        filled = jnp.pad(rows, ((0, 0), (0, width - rows.shape[1])))
        return tall_product(transfer.coefficients, filled)
    width = rows.shape[1]
    scaled = (rows * transfer.steps[None, :width])[None]
    sums = materialize(block_sums, scaled, transfer.whole[:, :width])
    return jnp.swapaxes(sums, 1, 2).reshape(-1, len(rows))[: transfer.count]
