"""Rotation of functions on the sphere."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import (
    align,
    as_float,
    check_batches,
    check_coefficients,
    check_degree,
)
from .._core.linalg import einsum, matmul
from .._core.vectors import checked_rotation
from ._basis import evaluate
from ._indexing import degrees, orders
from ._tables import even_grid


def rotation_matrix(
    rotation: Float[ArrayLike, "*batch 3 3"], degree: int
) -> Float[Array, "*batch k k"]:
    """Build the matrix D that turns functions by R: `D @ c` are the coefficients of f(Rᵀω).

    D_ij = ∫ y_i(ω) y_j(Rᵀω) dω by a quadrature that is exact for it, so D is as smooth in R as the
    basis in its argument: there are no Euler angles to be singular, and derivatives are right at
    the identity and at half turns too.

    **Arguments**

    - `rotation`: (..., 3, 3), orthogonal; reflections too. Differentiable along any direction:
      f(Rᵀω/|Rᵀω|) is the extension to matrices that are not orthogonal.
    - `degree`: any, known at trace time.

    **Returns** (..., K, K), block diagonal with one block per degree. Raises `ValueError` for a
    wrong shape and, where values are known before tracing, for a matrix that is not orthogonal to
    1e-3.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import harmonics
    >>> harmonics.rotation_matrix(jnp.eye(3), degree=2).shape
    (9, 9)
    """
    rotation = checked_rotation(rotation)
    return _rotation_matrix(rotation, check_degree(degree))


def rotate(
    coefficients: Float[ArrayLike, "*batch k"], rotation: Float[ArrayLike, "*rotations 3 3"]
) -> Float[Array, "*out k"]:
    """Turn functions by rotations: coefficients of f(Rᵀω). See `rotation_matrix`.

    **Arguments**

    - `coefficients`: (..., K).
    - `rotation`: (..., 3, 3). Batches of functions and of rotations broadcast.

    **Returns** (..., K) in the dtype of the coefficients. Linear in the coefficients and
    differentiable in both. Raises `ValueError` as `rotation_matrix` does.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import harmonics
    >>> x = harmonics.evaluate(jnp.array([1.0, 0.0, 0.0]), degree=1)  # a lobe along +x
    >>> about_z = jnp.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    >>> y = harmonics.rotate(x, about_z)
    >>> round(float(y[1]), 3)  # along +y: √(3/4π)
    0.489
    """
    coefficients = as_float(coefficients, "coefficients")
    degree = check_coefficients("coefficients", coefficients)
    rotation = checked_rotation(rotation)
    check_batches(coefficients=coefficients.shape, rotation=rotation.shape[:-1])
    return _rotate(coefficients, rotation, degree)


@functools.partial(jax.jit, static_argnums=2)
def _rotate(coefficients, rotation, degree: int):
    matrix = _rotation_matrix(rotation.astype(coefficients.dtype), degree)
    if matrix.ndim == 2:
        return matmul(coefficients, matrix.T)
    return einsum("...ij,...j->...i", matrix, coefficients)


def rotate_z(
    coefficients: Float[ArrayLike, "*batch k"], angle: Float[ArrayLike, "*angles"]
) -> Float[Array, "*out k"]:
    """Turn functions by `angle` radians about +z, from +x towards +y: O(K), no matrix.

    c'_lm = cos(mα) c_lm - sin(mα) c_l,-m (Habel et al. 2008, eq. 4, with m signed).

    **Arguments**

    - `coefficients`: (..., K).
    - `angle`: (...), in radians. Batches of functions and of angles broadcast.

    **Returns** (..., K) in the dtype of the coefficients. Differentiable in both. Raises
    `ValueError` where K is not a square or batches do not broadcast.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import harmonics
    >>> x = harmonics.evaluate(jnp.array([1.0, 0.0, 0.0]), degree=1)  # a lobe along +x
    >>> round(float(harmonics.rotate_z(x, jnp.pi / 2)[1]), 3)  # along +y: √(3/4π)
    0.489
    """
    coefficients = as_float(coefficients, "coefficients")
    degree = check_coefficients("coefficients", coefficients)
    angle = as_float(angle, "angle")
    check_batches(coefficients=coefficients.shape, angle=(*angle.shape, 1))
    return _rotate_z(coefficients, angle, degree)


@functools.partial(jax.jit, static_argnums=2)
def _rotate_z(coefficients, angle, degree: int):
    m = orders(degree)
    mirrored = coefficients[..., np.arange(len(m), dtype=np.int32) - 2 * m]
    phase = angle.astype(coefficients.dtype)[..., None]
    phase = jnp.multiply(*align(phase, jnp.asarray(m, phase.dtype)))
    coefficients, mirrored, phase = align(coefficients, mirrored, phase)
    return jnp.cos(phase) * coefficients - jnp.sin(phase) * mirrored


@functools.partial(jax.jit, static_argnums=1)
def _rotation_matrix(rotation: Float[Array, "*batch 3 3"], degree: int) -> Float[Array, "..."]:
    grid = even_grid(degree)
    directions = jnp.asarray(grid.directions, rotation.dtype)
    turned = matmul(directions, rotation)  # rows Rᵀω
    weighted = jnp.asarray(grid.basis * grid.weights, rotation.dtype)
    matrix = einsum("in,j...n->...ij", weighted, evaluate(turned, degree, axis=0))
    same_degree = np.equal.outer(degrees(degree), degrees(degree))
    return jnp.where(same_degree, matrix, jnp.zeros_like(matrix))
