"""Weighted sums over blocks of vertices, in one loop."""

import functools

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Num

from .._core.linalg import matmul

# Sums side by side: a term waits for the one before it in its own sum alone.
_CHAINS = 8


@jax.custom_jvp
def block_sums(
    weights: Float[Array, "#blocks r n"], values: Num[Array, "blocks n b"]
) -> Float[Array, "blocks r b"]:
    """Σ_n w_rn f_nv for each vertex v of each block; f may be whole numbers of few bits.

    XLA's CPU backend multiplies so many narrow matrices one after the other on one core, and each
    is copied first, whole numbers as others. With the sum over n written out the whole is one loop
    over vertices, which it vectorises and splits over the cores.
    """
    return jax.lax.platform_dependent(weights, values, cpu=_written_out, default=_as_matrices)


@block_sums.defjvp
def _block_sums_jvp(primals, tangents):
    # The written-out sum would be transposed term by term.
    (weights, values), (turned, moved) = primals, tangents
    change = _as_matrices(turned, values)
    if jnp.issubdtype(values.dtype, jnp.inexact):
        change = change + _as_matrices(weights, moved)
    return block_sums(*primals), change


def _written_out(weights, values):
    terms = [
        weights[:, :, n, None] * values[:, n, None].astype(weights.dtype)
        for n in range(values.shape[1])
    ]
    sums = (functools.reduce(jnp.add, terms[i::_CHAINS]) for i in range(min(_CHAINS, len(terms))))
    return functools.reduce(jnp.add, sums)


def _as_matrices(weights, values):
    return matmul(weights, values.astype(weights.dtype))
