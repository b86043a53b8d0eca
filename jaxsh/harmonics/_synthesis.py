"""Sums over coefficients of low degree, written out, and rules for their derivatives.

The rows of the basis are polynomials that XLA fuses into the sum. Differentiated as they stand they
would be sums over directions or coefficients inside of such a fusion, which XLA's CPU backend does
one number at a time: so each derivative is said in the form that is fast, forward and transposed.
"""

import functools
from collections.abc import Iterable

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Float

from .._core.host import read_only_cache
from .._core.linalg import einsum, matmul
from .._core.xla import in_blocks, materialize, rows_at_once
from ._basis import evaluate
from ._indexing import degree_of
from ._low_degree import products
from ._polynomials import solid_rows
from ._tables import gradient_table

# Longer sums of few functions are no longer vectorized on a CPU.
_WRITTEN_OUT = 4
# Directions per block on a CPU: 1 MB of basis at degree 10 in float32.
_BLOCK = 2048


@jax.custom_jvp
def per_point(
    coefficients: Float[Array, "n c k"], unit: Float[Array, "3 n 1"]
) -> Float[Array, "n c"]:
    """Σ_k c[n, :, k] y_k, each unit vector with coefficients of its own."""
    rows = _rows(unit, degree_of(coefficients.shape[-1]))
    return _sum(coefficients[:, :, k] * row for k, row in enumerate(rows))


@jax.custom_jvp
def shared(coefficients: Float[Array, "c k"], unit: Float[Array, "3 n 1"]) -> Float[Array, "n c"]:
    """Σ_k c[:, k] y_k, the same functions at all unit vectors."""
    degree = degree_of(coefficients.shape[-1])
    if degree > _WRITTEN_OUT:
        return by_products(coefficients, unit[..., 0].T)
    rows = _rows(unit, degree)
    return _sum(coefficients[None, :, k] * row for k, row in enumerate(rows))


def by_products(
    coefficients: Float[Array, "c k"], vectors: Float[Array, "n 3"]
) -> Float[Array, "n c"]:
    """Σ_k c[:, k] y_k of any degree, for many functions: products, block by block on a CPU."""
    degree = degree_of(coefficients.shape[-1])

    def block(vectors):
        return matmul(coefficients, evaluate(vectors, degree, axis=0))

    most = rows_at_once(coefficients.shape[-1] * coefficients.dtype.itemsize)
    return in_blocks(block, vectors, size=_BLOCK, most=most, out=1).T


@functools.partial(per_point.defjvp, symbolic_zeros=True)
def _per_point_jvp(primals, tangents):
    return per_point(*primals), _change("nck,nk->nc", _turn_each, primals, tangents)


@functools.partial(shared.defjvp, symbolic_zeros=True)
def _shared_jvp(primals, tangents):
    return shared(*primals), _change("ck,nk->nc", _turn_shared, primals, tangents)


def _change(subscripts: str, turned, primals, tangents) -> Float[Array, "n c"]:
    """The sum's tangent: of changed coefficients, and of turned vectors."""
    (coefficients, unit), (change, turn) = primals, tangents
    degree = degree_of(coefficients.shape[-1])

    def changed(change, unit):
        x, y, z = _stored(unit)
        basis = products(x, y, z, degree, (1, -1))
        # One row at degree 0, where nothing depends on the vector.
        basis = jnp.broadcast_to(basis, (unit.shape[1], basis.shape[1]))
        return einsum(subscripts, change, basis)

    parts = []
    if not isinstance(change, SymbolicZero):
        parts.append(_anew(changed)(change, unit))
    if degree and coefficients.size and not isinstance(turn, SymbolicZero):
        parts.append(_anew(turned)(turn, coefficients, unit))
    count = unit.shape[1], coefficients.shape[-2]
    if not parts:
        return jnp.zeros(count, coefficients.dtype)
    # Transposed, this stores the cotangent, which is made of the values: fused, all of these would
    # be made anew for each of the coefficients.
    return materialize(lambda _, change: change, unit, _sum(parts))


def _rows(unit, degree: int) -> list[Array]:
    x, y, z = unit
    return solid_rows(x, y, z, degree)


def _anew(function):
    """In reverse mode made anew from its arguments, rather than kept."""
    return jax.checkpoint(function, prevent_cse=False)


def _turn_each(turn, coefficients, unit):
    """Σ_k c[n, :, k] ∂y_k along `turn`."""
    degree = degree_of(coefficients.shape[-1])
    rows = _rows(unit[..., 0], degree - 1)
    along = _components(turn, unit)
    terms = _terms(degree)
    slopes = [jnp.zeros_like(rows[0])]  # of the constant
    for k in range(1, (degree + 1) ** 2):
        slopes.append(
            _sum(
                float(factor[axis, k]) * rows[row[axis, k]] * along[axis]
                for row, factor in terms
                for axis in range(3)
                if factor[axis, k]
            )
        )
    return einsum("nck,nk->nc", coefficients, jnp.stack(slopes, axis=-1))


def _turn_shared(turn, coefficients, unit):
    """Σ_k c[:, k] ∂y_k along `turn`: along each axis a sum of one degree less."""
    degree = degree_of(coefficients.shape[-1])
    slopes = einsum("ck,akj->acj", coefficients, jnp.asarray(_gradient(degree), turn.dtype))
    rows = _rows(unit[..., 0], degree - 1)
    along = _components(turn, unit)
    columns = [
        _sum(
            along[axis] * _sum(slopes[axis, c, j] * row for j, row in enumerate(rows))
            for axis in range(3)
        )
        for c in range(len(coefficients))
    ]
    return jnp.stack(columns, axis=-1)


def _components(turn, unit) -> list[Float[Array, " n"]]:
    """x, y and z of `turn`, whose transpose is one array and stands in memory.

    What turns a normal's derivative into a vector's takes each component three times: fused, it
    would make each anew.
    """
    turn = materialize(lambda _, turn: turn[..., 0].T, unit, turn)
    return [column[:, 0] for column in jax.lax.split(turn, (1, 1, 1), axis=1)]


def _stored(unit):
    return materialize(lambda unit: unit, unit)


@read_only_cache(maxsize=None)
def _gradient(degree: int) -> Float[np.ndarray, "3 k j"]:
    """∂_axis (r^l y_k) = Σ_j gradient[axis, k, j] y_j, of one degree less."""
    matrix = np.zeros((3, (degree + 1) ** 2, degree**2))
    for row, factor in _terms(degree):
        for axis, k in zip(*np.nonzero(factor), strict=True):
            matrix[axis, k, row[axis, k]] += factor[axis, k]
    return matrix


def _terms(degree: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """The two terms of each derivative: rows of the basis, and factors."""
    table = gradient_table(degree)
    return [(table.first_row, table.first), (table.second_row, table.second)]


def _sum(terms: Iterable[Array]) -> Array:
    return functools.reduce(jnp.add, terms)
