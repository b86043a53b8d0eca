"""Products of light, transfer and lobe, level by level (Lee & Kim 2014, figure 5)."""

import functools

import jax.numpy as jnp
from jaxtyping import Array, Float

from .._core.linalg import PRECISION
from ..harmonics import convolve, evaluate, num_coefficients, phong


def lobe_kernel(
    axis: Float[Array, "3 n"], exponent: Float[Array, "..."], degree: int, normalized: bool
) -> Float[Array, "k n"]:
    """α_i y_i(B)."""
    ones = jnp.ones(num_coefficients(degree), axis.dtype)
    alpha = convolve(ones, phong(exponent, degree, normalized=normalized))
    basis = evaluate(axis.T, degree, axis=0)
    return basis * (alpha[:, None] if alpha.ndim == 1 else alpha.T)


def base_product(
    matrix: Float[Array, "3 k k"],
    kernel: Float[Array, "kernel n"],
    transfer: Float[Array, "transfer n"],
    count: int,
) -> Float[Array, "3 n"]:
    """S = Σ_ij α_i y_i(B) L̂_ij O_j over the first `count` harmonics."""
    rows = _rows(matrix[:, :count, :count], transfer[:count])
    return jnp.sum(rows * kernel[None, :count], axis=1)


def increment(
    matrix: Float[Array, "3 k k"],
    kernel: Float[Array, "kernel n"],
    transfer: Float[Array, "transfer n"],
    old: int,
    new: int,
) -> Float[Array, "3 n"]:
    """What harmonics `old` to `new` add to S: algorithm 3, which repeats no product.

    Its first loop is over new rows i and all columns. Its second, over old rows and new columns,
    uses that L̂ is symmetric. The paper's adds R_i whole once more there; only the new columns'
    part is to be added.
    """
    block = matrix[:, old:new]
    by_row = _rows(block[..., :new], transfer[:new]) * kernel[None, old:new]
    by_column = _rows(block[..., :old], kernel[:old]) * transfer[None, old:new]
    return jnp.sum(by_row + by_column, axis=1)


_rows = functools.partial(jnp.tensordot, axes=1, precision=PRECISION)
