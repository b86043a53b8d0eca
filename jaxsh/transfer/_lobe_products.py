"""Integrals of light, transfer and lobe, tile by tile of vertices."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..harmonics import degree_of
from ..harmonics._fence import fenced
from ._lobe import lobe
from ._nodes import product_nodes
from ._sampled import SampledTransfer, in_tiles, out_of_tiles, rows_in_tiles
from ._transfer import Transfer


def lobe_products(
    lights: Float[Array, "rows k"],
    transfer: Transfer | SampledTransfer,
    axis: Float[Array, "3 v"],
    lobes: Float[Array, "bands ..."],
) -> tuple[Float[Array, "rows v"], Float[Array, "rows v"]]:
    """∫ L O lobe(B·ω) dω and ∫ L O dω of each light and vertex, at the lights' degree."""
    nodes = product_nodes(degree_of(lights.shape[-1]))
    directions, basis, project = (jnp.asarray(array, axis.dtype) for array in nodes)
    weights = _matmul(lights, project)
    x, y, z = directions.T[..., None]

    def lobed(axis, samples, lobes):
        return samples * lobe(x * axis[:1] + y * axis[1:2] + z * axis[2:], lobes)

    @jax.checkpoint
    def tile(part):
        transfer_part, axis, lobes = part
        samples = transfer_part if sampled else _matmul(basis, transfer_part.T)
        return _matmul(weights, fenced(lobed, axis, samples, lobes)), _matmul(weights, samples)

    sampled = isinstance(transfer, SampledTransfer)
    parts = transfer.samples if sampled else rows_in_tiles(transfer.coefficients[:, : len(project)])
    axes = in_tiles(axis)
    if lobes.ndim == 1:
        lobes = lobes[:, None, None]
        tiles = jax.lax.map(lambda part: tile((*part, lobes)), (parts, axes))
    else:
        tiles = jax.lax.map(tile, (parts, axes, in_tiles(lobes[:, None])))
    glossy, irradiance = tiles
    return out_of_tiles(glossy, axis.shape[-1]), out_of_tiles(irradiance, axis.shape[-1])


def _matmul(a, b):
    return jnp.matmul(a, b, precision="highest")
