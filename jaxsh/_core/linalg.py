"""Products of matrices at the one precision that the package computes in.

Accelerators multiply float32 matrices in fewer bits by default, which would cost the projections
three of their digits; everything goes through here, so that there is one switch.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

PRECISION = jax.lax.Precision.HIGHEST


def matmul(a: ArrayLike, b: ArrayLike) -> Array:
    return jnp.matmul(a, b, precision=PRECISION)


def dot(a: ArrayLike, b: ArrayLike) -> Array:
    return jnp.dot(a, b, precision=PRECISION)


def einsum(subscripts: str, *operands: ArrayLike) -> Array:
    return jnp.einsum(subscripts, *operands, precision=PRECISION)


def tensordot(a: ArrayLike, b: ArrayLike) -> Array:
    """Sums over the last axis of `a` and the first one of `b`."""
    return jnp.tensordot(a, b, 1, precision=PRECISION)


def tall_product(tall: Float[Array, "v k"], rows: Float[Array, "n k"]) -> Float[Array, "v n"]:
    """tall @ rowsᵀ, with rows of zeros up to eight: XLA's CPU kernel is faster with eight."""
    filled = jnp.pad(rows, ((0, max(0, 8 - len(rows))), (0, 0)))
    return matmul(tall, filled.T)[:, : len(rows)]
