"""Functions of the sphere at directions: the basis is summed as it is evaluated, never held."""

import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import (
    align,
    as_float,
    check_coefficients,
    check_vectors,
    flatten_batch,
)
from .._core.linalg import einsum, matmul
from .._core.xla import in_blocks, on_mesh, rows_at_once
from ._basis import evaluate
from ._indexing import degree_of
from ._low_degree import LOW_DEGREE
from ._synthesis import by_products, per_point, shared

# More functions are multiplied with the basis.
_FEW_FUNCTIONS = 4
# Vectors per block on a CPU. Blocks of coefficients are copied, so that few are better.
_BLOCK = 2**17


def synthesize(
    coefficients: Float[ArrayLike, "*functions k"], vectors: Float[ArrayLike, "*points 3"]
) -> Float[Array, "..."]:
    """Evaluate functions given by coefficients: Σ_k c_k y_k(s/|s|) at nonzero vectors s.

    What shading does with the basis: the colors of a million splats, each with coefficients and a
    direction of its own, or one light at a million normals. The same as `evaluate` and a sum over
    K, but on one device the basis is not held as a whole, neither here nor for reverse mode.

    **Arguments**

    - `coefficients`: (C, K), C functions or channels that all vectors share, or with more axes
      (..., C, K), which broadcast against those of the vectors: (N, C, K) is one set for each of N
      vectors, (B, 1, C, K) a batch of shared ones. One function may also come as (K,).
      Differentiable.
    - `vectors`: (..., 3), of any length. Differentiable.

    **Returns** values (..., C), or (...) for coefficients (K,), in the dtype of the coefficients.
    Derivatives in both arguments to every order and in every mode; those in a vector are
    tangential. A zero vector gives NaN. Raises `ValueError` where K is not a square, the vectors
    have no three components or leading axes do not broadcast.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import harmonics
    >>> coefficients = jnp.ones((5, 3, 16))  # 5 splats of degree 3, red, green and blue
    >>> directions = jnp.array([[0.0, 0.0, 1.0]] * 5)
    >>> harmonics.synthesize(coefficients, directions).shape
    (5, 3)
    """
    coefficients, vectors = as_float(coefficients, "coefficients"), as_float(vectors, "vectors")
    check_vectors("vectors", vectors)
    check_coefficients("coefficients", coefficients)
    if coefficients.ndim == 1:
        return _synthesize(coefficients[None], vectors)[..., 0]
    try:
        jnp.broadcast_shapes(coefficients.shape[:-2], vectors.shape[:-1])
    except ValueError:
        raise ValueError(
            f"leading axes must broadcast, got coefficients {coefficients.shape}, where they stand "
            f"before functions and coefficients, and vectors {vectors.shape}"
        ) from None
    return _synthesize(coefficients, vectors)


@jax.jit
def _synthesize(coefficients, vectors):
    vectors = vectors.astype(coefficients.dtype)
    points, channels = vectors.shape[:-1], coefficients.shape[-2]
    aligned = max(0, coefficients.ndim - 2 - len(points))
    if math.prod(coefficients.shape[aligned:-2]) == 1:  # all vectors share each
        batch = coefficients.shape[:aligned]
        values = _shared(flatten_batch(coefficients), vectors)
        values = values.reshape(*points, *batch, channels)
        return jnp.moveaxis(values, range(len(points)), range(-1 - len(points), -1))
    return _per_point(coefficients, vectors)


def _shared(rows: Float[Array, "b k"], vectors: Float[Array, "*points 3"]):
    """Values (..., B) of B functions."""
    degree = degree_of(rows.shape[-1])
    if on_mesh(rows, vectors):  # flat, vectors would lose their sharding
        if vectors.ndim > 2:
            return einsum("bk,k...->...b", rows, evaluate(vectors, degree, axis=0))
        return matmul(rows, evaluate(vectors, degree, axis=0)).T
    vectors = vectors.reshape(-1, 3)
    if degree <= LOW_DEGREE and len(rows) <= _FEW_FUNCTIONS:
        return shared(rows, vectors)
    return by_products(rows, vectors)


def _per_point(coefficients, vectors):
    degree = degree_of(coefficients.shape[-1])
    if on_mesh(coefficients, vectors):
        basis = evaluate(vectors, degree)
        return jnp.sum(jnp.multiply(*align(coefficients, basis[..., None, :])), axis=-1)
    batch = jnp.broadcast_shapes(coefficients.shape[:-2], vectors.shape[:-1])
    flat = jnp.broadcast_to(coefficients, (*batch, *coefficients.shape[-2:]))
    flat = flat.reshape(math.prod(batch), *coefficients.shape[-2:])
    vectors = jnp.broadcast_to(vectors, (*batch, 3)).reshape(-1, 3)
    if degree <= LOW_DEGREE:
        values = per_point(flat, vectors)
    else:

        def block(coefficients, vectors):
            return einsum("nck,nk->nc", coefficients, evaluate(vectors, degree))

        most = rows_at_once(math.prod(flat.shape[1:]) * flat.dtype.itemsize)
        values = in_blocks(block, flat, vectors, size=_BLOCK, most=most)
    return values.reshape(*batch, coefficients.shape[-2])
