"""Products of functions on the sphere.

All integrals are over a grid that is exact for them: sample, multiply, project. These are dense
matrix products with the basis on the grid, and need no tensor of K³ entries.
"""

import functools
import math

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
    flatten_batch,
)
from .._core.host import read_only_cache
from .._core.linalg import matmul
from .._core.xla import in_blocks, on_mesh, rows_at_once
from ._indexing import degree_of, num_coefficients
from ._tables import exact_grid

# Functions per pass of `product` on a CPU: their samples stay in cache.
_BLOCK = 1024


def gaunt(degree: int) -> Float[Array, "k k k"]:
    """Tabulate the triple integrals of the basis, G_ijk = ∫ y_i y_j y_k dω.

    **Returns** a dense (K, K, K) in JAX's default float type, computed on the host in float64.
    Exact zeros are zero. It needs 8 K³ bytes: 14 MB at degree 10, 60 MB at 13; `product` and
    `triple_integral` do without.

    **Example**

    >>> from jaxsh import harmonics
    >>> harmonics.gaunt(1).shape
    (4, 4, 4)
    """
    return jnp.asarray(_gaunt(check_degree(degree)), jnp.result_type(float))


def product(
    f: Float[ArrayLike, "*batch_f kf"],
    g: Float[ArrayLike, "*batch_g kg"],
    degree: int | None = None,
) -> Float[Array, "*batch k"]:
    """Multiply two functions: coefficients of f·g.

    **Arguments**

    - `f`, `g`: (..., K_f) and (..., K_g). Batches broadcast; degrees may differ.
    - `degree`: of the result, by default that of the larger input. f·g has the degrees of f and g
      together: up to that degree the product is exact, below it is the exact one's projection.

    **Returns** (..., K) in the wider dtype of the two. Bilinear and differentiable in both. Raises
    `ValueError` where K is not a square or batches do not broadcast.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import harmonics
    >>> z = jnp.array([0.0, 0.0, 1.0, 0.0])  # y_10
    >>> squared = harmonics.product(z, z, degree=2)
    >>> squared.shape, round(float(squared[0]), 3)  # 1/√(4π)
    ((9,), 0.282)
    """
    (f, f_degree), (g, g_degree) = _checked(f=f, g=g)
    degree = max(f_degree, g_degree) if degree is None else check_degree(degree)
    return _product(f, g, degree)


def triple_integral(
    f: Float[ArrayLike, "*batch_f kf"],
    g: Float[ArrayLike, "*batch_g kg"],
    h: Float[ArrayLike, "*batch_h kh"],
) -> Float[Array, "*batch"]:
    """Integrate the product of three functions: ∫ f g h dω = Σ_ijk G_ijk f_i g_j h_k.

    `f`, `g` and `h` are (..., K) of any degrees; batches broadcast. **Returns** (...). Trilinear
    and differentiable in all three. Raises `ValueError` where K is not a square or batches do not
    broadcast.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import harmonics
    >>> z = jnp.array([0.0, 0.0, 1.0, 0.0])  # y_10
    >>> round(float(harmonics.triple_integral(z, z, jnp.ones(1))), 3)  # 1/√(4π)
    0.282
    """
    (f, _), (g, _), (h, h_degree) = _checked(f=f, g=g, h=h)
    return jnp.sum(jnp.multiply(*align(_product(f, g, h_degree), h)), axis=-1)


def product_matrix(
    f: Float[ArrayLike, "*batch kf"], degree: int | None = None
) -> Float[Array, "*batch k k"]:
    """Build the matrix that multiplies functions by f: M @ g = coefficients of f·g.

    M_ij = ∫ f y_i y_j dω, symmetric. For a light f and a transfer function g this is the operator
    that shades with it (Lee & Kim 2014, L̂ of eq. 3).

    **Arguments**

    - `f`: (..., K_f).
    - `degree`: of g and of the result, by default f's.

    **Returns** (..., K, K). Linear and differentiable in f. Raises `ValueError` where K_f is not a
    square.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import harmonics
    >>> one = jnp.array([3.5449077, 0.0, 0.0, 0.0])  # √(4π) y_00 = 1
    >>> matrix = harmonics.product_matrix(one)
    >>> round(float(matrix[2, 2]), 3), round(float(matrix[2, 3]), 3) + 0.0
    (1.0, 0.0)
    """
    ((f, f_degree),) = _checked(f=f)
    return _product_matrix(f, f_degree if degree is None else check_degree(degree))


@read_only_cache(maxsize=4)
def _gaunt(degree: int) -> Float[np.ndarray, "k k k"]:
    grid = exact_grid(3 * degree, degree)
    weighted = (grid.basis * grid.weights).T
    tensor = np.stack([(row * grid.basis) @ weighted for row in grid.basis])
    # Rounding leaves 1e-14 where the smallest true entry is 7e-4 at degree 10 and 9e-5 at 13.
    tensor[np.abs(tensor) < 1e-9] = 0.0
    return tensor


@functools.partial(jax.jit, static_argnums=2)
def _product(f, g, degree: int):
    f_degree, g_degree = degree_of(f.shape[-1]), degree_of(g.shape[-1])
    grid = exact_grid(f_degree + g_degree + degree, max(f_degree, g_degree, degree))
    basis = jnp.asarray(grid.basis, f.dtype)
    project = jnp.asarray((grid.basis * grid.weights)[: num_coefficients(degree)].T, f.dtype)

    def multiply(f, g):
        samples = matmul(f, basis[: f.shape[-1]]) * matmul(g, basis[: g.shape[-1]])
        return matmul(samples, project)

    batch = jnp.broadcast_shapes(f.shape[:-1], g.shape[:-1])
    pair = tuple(jnp.broadcast_to(one, (*batch, one.shape[-1])) for one in (f, g))
    if math.prod(batch) <= _BLOCK or on_mesh(pair):
        return multiply(*pair)
    most = rows_at_once(3 * basis.shape[1] * basis.dtype.itemsize)  # samples of both, and of each
    rows = in_blocks(multiply, *map(flatten_batch, pair), size=_BLOCK, most=most)
    return rows.reshape(*batch, project.shape[-1])


@functools.partial(jax.jit, static_argnums=1)
def _product_matrix(f, degree: int):
    f_degree = degree_of(f.shape[-1])
    grid = exact_grid(f_degree + 2 * degree, max(f_degree, degree))
    basis = jnp.asarray(grid.basis, f.dtype)
    samples = matmul(f, jnp.asarray(grid.basis[: f.shape[-1]] * grid.weights, f.dtype))
    basis = basis[: num_coefficients(degree)]
    return matmul(jnp.multiply(*align(samples[..., None, :], basis)), basis.T)


def _checked(**functions: ArrayLike) -> list[tuple[Array, int]]:
    """Functions in their common dtype, with their degrees."""
    arrays = {name: as_float(value, name) for name, value in functions.items()}
    degrees = [check_coefficients(name, array) for name, array in arrays.items()]
    check_batches(**{name: array.shape for name, array in arrays.items()})
    dtype = functools.reduce(jnp.promote_types, (array.dtype for array in arrays.values()))
    return [(a.astype(dtype), d) for a, d in zip(arrays.values(), degrees, strict=True)]
