"""From samples to coefficients and back, in blocks: the basis is never held as a whole.

A block's basis is multiplied while it is still in cache, and there is never more of it in memory.
"""

import functools

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_float, check_degree, flatten_batch
from .._core.linalg import matmul
from ..harmonics import degree_of, evaluate
from ._quadrature import Quadrature

# Directions per block: 1 MB of basis at degree 10 in float32.
_BLOCK = 2048


def project(
    values: Float[ArrayLike, "*batch n"], quadrature: Quadrature, degree: int
) -> Float[Array, "*batch k"]:
    """Coefficients ∫ f y_i dω of a function sampled at the directions of a quadrature.

    `values` are (..., N), one per direction; the result is (..., K) in their dtype. As exact as
    the quadrature is for f·y_i. Linear in the values, differentiable in everything, also in
    reverse without holding the basis. Raises `ValueError` where N is not the quadrature's.
    """
    values = as_float(values)
    count = len(quadrature.weights)
    if values.ndim == 0 or values.shape[-1] != count:
        raise ValueError(
            f"expected values (..., {count}), one per direction, got shape {values.shape}"
        )
    return _project(values, quadrature, check_degree(degree))


def reconstruct(
    coefficients: Float[ArrayLike, "*batch k"], directions: Float[ArrayLike, "n 3"]
) -> Float[Array, "*batch n"]:
    """Values f(ω_n) = Σ_i c_i y_i(ω_n) at given directions: (..., K), (N, 3) -> (..., N).

    Differentiable in both, in reverse too without holding the basis.
    """
    coefficients, directions = as_float(coefficients), as_float(directions)
    if directions.ndim != 2 or directions.shape[-1] != 3:
        raise ValueError(f"expected directions (N, 3), got shape {directions.shape}")
    degree_of(coefficients.shape[-1] if coefficients.ndim else 0)
    return _reconstruct(coefficients, directions)


@functools.partial(jax.jit, static_argnums=2)
def _project(values, quadrature, degree: int):
    weighted = flatten_batch(values) * quadrature.weights.astype(values.dtype)[None]
    directions = _blocks(quadrature.directions.astype(values.dtype), pad=(0, 0, 1))
    blocks = _blocks(weighted.T, pad=(0,) * len(weighted))

    @jax.checkpoint  # in reverse too, evaluate a block again rather than hold all of them
    def add(total, block):
        directions, values = block
        basis = evaluate(directions, degree, axis=0)
        return total + matmul(basis, values), None

    start = jnp.zeros(((degree + 1) ** 2, len(weighted)), values.dtype)
    total, _ = jax.lax.scan(add, start, (directions, blocks))
    return total.T.reshape(*values.shape[:-1], len(total))


@jax.jit
def _reconstruct(coefficients, directions):
    degree = degree_of(coefficients.shape[-1])
    rows = flatten_batch(coefficients)

    @jax.checkpoint
    def block(directions):
        basis = evaluate(directions.astype(rows.dtype), degree, axis=0)
        return matmul(rows, basis)

    blocks = jax.lax.map(block, _blocks(directions, pad=(0, 0, 1)))
    values = jnp.moveaxis(blocks, 0, 1).reshape(len(rows), blocks.shape[0] * blocks.shape[-1])
    return values[:, : len(directions)].reshape(*coefficients.shape[:-1], len(directions))


def _blocks(rows: Float[Array, "n c"], pad: tuple[int, ...]) -> Float[Array, "blocks size c"]:
    """Rows in blocks of equal size, the last one filled up with rows of `pad`."""
    size = max(1, min(_BLOCK, len(rows)))
    missing = -len(rows) % size
    filler = jnp.broadcast_to(jnp.asarray(pad, rows.dtype), (missing, len(pad)))
    filled = jnp.concatenate([rows, filler])
    return filled.reshape(len(filled) // size, size, rows.shape[-1])
