"""The sums of a tile's vertices: numbers times weights that change across the tile."""

import functools

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Num

from .._core.linalg import shading_matmul

# Sums side by side: a term waits for the one before it in its own sum alone.
_CHAINS = 8
# Of the functions that weights are sums of: 1; u, w; u², u w, w².
ORDERS = (0, 1, 1, 2, 2, 2)


@jax.custom_jvp
def lobe_sums(
    weights: Float[Array, "blocks r m"],
    values: Num[Array, "blocks n b"],
    changes: Float[Array, "blocks 5 b"],
) -> Float[Array, "blocks r b"]:
    """Sums Σ_n (w_0n + Σ_j c_jv w_jn) f_nv for each vertex v of each block; f may be of few bits.

    `weights` are w_0, then w_1 to w_5. With the sum over n written out the whole is one loop over
    vertices, which XLA's CPU backend vectorises and splits over the cores.
    """
    return jax.lax.platform_dependent(
        weights, values, changes, cpu=_written_out, default=_as_matrices
    )


@lobe_sums.defjvp
def _lobe_sums_jvp(primals, tangents):
    # The written-out sum would be transposed term by term.
    (weights, values, changes), (turned, moved, stepped) = primals, tangents
    change = _as_matrices(turned, values, changes)
    for row, part in enumerate(_parts(weights)[1:]):
        change += stepped[:, row, None] * _product(part, values)
    if jnp.issubdtype(values.dtype, jnp.inexact):
        change += _as_matrices(weights, moved, changes)
    return lobe_sums(*primals), change


def _written_out(weights, values, changes):
    count = values.shape[1]

    def term(n):
        weight = weights[:, :, n, None]
        for row in range(len(ORDERS) - 1):
            weight = weight + weights[:, :, (row + 1) * count + n, None] * changes[:, row, None]
        return weight * values[:, n, None].astype(weights.dtype)

    terms = [term(n) for n in range(count)]
    sums = (functools.reduce(jnp.add, terms[i::_CHAINS]) for i in range(min(_CHAINS, count)))
    return functools.reduce(jnp.add, sums)


def _as_matrices(weights, values, changes):
    first, *others = _parts(weights)
    total = _product(first, values)
    for row, part in enumerate(others):
        total += changes[:, row, None] * _product(part, values)
    return total


def _parts(weights):
    return jnp.split(weights, len(ORDERS), axis=-1)


def _product(weights, values):
    return shading_matmul(weights, values.astype(weights.dtype))
