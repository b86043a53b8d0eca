"""Integrals of light, transfer and lobe, some tens of directions at a time."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._core.linalg import matmul
from ..harmonics import degree_of
from ._lobe import lobe
from ._nodes import node_passes
from ._sampled import SampledTransfer
from ._transfer import Transfer


def lobe_products(
    lights: Float[Array, "rows k"],
    transfer: Transfer | SampledTransfer,
    axis: Float[Array, "3 v"],
    lobes: Float[Array, "bands ..."],
) -> Float[Array, "rows v"]:
    """∫ L O lobe(B·ω) dω of each light and vertex, at the lights' degree."""
    width = lights.shape[-1]
    nodes = node_passes(degree_of(width))
    directions, basis, project = (jnp.asarray(array, axis.dtype) for array in nodes)
    weights = matmul(lights[None], project)
    sampled = isinstance(transfer, SampledTransfer)
    parts = directions, weights, transfer.samples if sampled else basis
    lobes = lobes.reshape(len(lobes), 1, -1)

    @jax.checkpoint
    def add(total, part):
        directions, weights, samples = part
        if not sampled:
            samples = matmul(samples, transfer.coefficients[:, :width].T)
        values = samples * lobe(cosines(directions, axis), lobes)
        return total + matmul(weights, values), None

    total, _ = jax.lax.scan(add, jnp.zeros((len(lights), axis.shape[1]), axis.dtype), parts)
    return total


@jax.custom_jvp
def cosines(directions: Float[Array, "n 3"], axis: Float[Array, "3 v"]) -> Float[Array, "n v"]:
    """Their inner products, written out: so they are computed where they are used, not stored."""
    x, y, z = directions.T[..., None]
    return x * axis[:1] + y * axis[1:2] + z * axis[2:]


@cosines.defjvp
def _cosines_jvp(primals, tangents):
    # The transpose of what is written out would sum over directions for each of three rows.
    _, change = jax.jvp(matmul, primals, tangents)
    return cosines(*primals), change
