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
from .._core.vectors import normalize
from .._core.xla import in_blocks, in_slices, materialize, rows_at_once
from ._basis import evaluate
from ._indexing import degree_of
from ._low_degree import products
from ._polynomials import solid_rows
from ._tables import gradient_table

# Longer sums of few functions are no longer vectorized on a CPU.
_WRITTEN_OUT = 4
# Directions per block on a CPU: 1 MB of basis at degree 10 in float32.
_BLOCK = 2048
# Bytes of basis per block of derivatives on a CPU, and of those that are computed at once: larger
# arrays the C library gives back to the system, which clears each page of the next ones.
_SLICE, _AT_ONCE = 2**21, 2**24


@jax.custom_jvp
def per_point(
    coefficients: Float[Array, "n c k"], vectors: Float[Array, "n 3"]
) -> Float[Array, "n c"]:
    """Σ_k c[n, :, k] y_k, each vector with coefficients of its own."""
    rows = _rows(_units(vectors), degree_of(coefficients.shape[-1]))
    return _sum(coefficients[:, :, k] * row for k, row in enumerate(rows))


@jax.custom_jvp
def shared(coefficients: Float[Array, "c k"], vectors: Float[Array, "n 3"]) -> Float[Array, "n c"]:
    """Σ_k c[:, k] y_k, the same functions at all vectors."""
    degree = degree_of(coefficients.shape[-1])
    if degree > _WRITTEN_OUT:
        return by_products(coefficients, vectors)
    rows = _rows(_units(vectors), degree)
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
    (coefficients, vectors), (change, turn) = primals, tangents
    degree = degree_of(coefficients.shape[-1])

    def turned(turn, coefficients, vectors):
        return einsum("nck,nk->nc", coefficients, _slopes(turn, vectors, degree))

    parts = []
    if not isinstance(change, SymbolicZero):
        parts.append(_anew(_changed_each)(change, vectors))
    if degree and coefficients.size and not isinstance(turn, SymbolicZero):
        parts.append(_in_slices(turned, turn, coefficients, vectors, degree=degree))
    return per_point(*primals), _total(parts, coefficients, vectors)


@functools.partial(shared.defjvp, symbolic_zeros=True)
def _shared_jvp(primals, tangents):
    (coefficients, vectors), (change, turn) = primals, tangents
    degree = degree_of(coefficients.shape[-1])
    changes = not isinstance(change, SymbolicZero)
    turns = bool(degree and coefficients.size) and not isinstance(turn, SymbolicZero)

    def block(turn, vectors):
        unit, inverse = _stored(vectors)
        parts = []
        if changes:
            parts.append(matmul(_basis(unit, degree), change.T))
        if turns:
            parts.append(_turn_shared(_along(turn, unit, inverse), coefficients, unit))
        return _sum(parts)

    parts = []
    if changes or turns:
        parts.append(_in_slices(block, turn if turns else vectors, vectors, degree=degree))
    return shared(*primals), _total(parts, coefficients, vectors)


def _total(parts, coefficients, vectors) -> Float[Array, "n c"]:
    if not parts:
        return jnp.zeros((len(vectors), coefficients.shape[-2]), coefficients.dtype)
    # Transposed, this stores the cotangent, which is made of the values: fused, all of these would
    # be made anew for each of the coefficients.
    return materialize(lambda _, change: change, vectors, _sum(parts))


def _changed_each(change, vectors):
    """Σ_k change[n, :, k] y_k."""
    unit, _ = _stored(vectors)
    return einsum("nck,nk->nc", change, _basis(unit, degree_of(change.shape[-1])))


def _basis(unit, degree: int) -> Float[Array, "n k"]:
    x, y, z = (column[:, None] for column in unit)
    basis = products(x, y, z, degree, (1, -1))
    # One row at degree 0, where nothing depends on the vector.
    return jnp.broadcast_to(basis, (len(x), basis.shape[1]))


def _rows(unit, degree: int) -> list[Array]:
    x, y, z = unit
    return solid_rows(x, y, z, degree)


def _anew(function):
    """In reverse mode made anew from its arguments, rather than kept."""
    return jax.checkpoint(function, prevent_cse=False)


def _in_slices(function, *arrays, degree: int) -> Float[Array, "n c"]:
    row = (degree + 1) ** 2 * arrays[0].dtype.itemsize
    if len(arrays[0]) * row <= _AT_ONCE:
        return _anew(function)(*arrays)
    return in_slices(function, *arrays, size=_SLICE // row)


def _slopes(turn, vectors, degree: int) -> Float[Array, "n k"]:
    """∂y_k along `turn`."""
    unit, inverse = _stored(vectors)
    terms = _terms(degree)

    def slopes(unit, along):
        rows = _rows(unit, degree - 1)
        columns = [jnp.zeros_like(rows[0])]  # of the constant
        for k in range(1, (degree + 1) ** 2):
            columns.append(
                _sum(
                    float(factor[axis, k]) * rows[row[axis, k]] * along[axis]
                    for row, factor in terms
                    for axis in range(3)
                    if factor[axis, k]
                )
            )
        return jnp.stack(columns, axis=-1)

    return materialize(_anew(slopes), unit, _along(turn, unit, inverse))


def _turn_shared(along, coefficients, unit) -> Float[Array, "n c"]:
    """Σ_k c[:, k] ∂y_k along `along`: along each axis a sum of one degree less."""
    degree = degree_of(coefficients.shape[-1])
    slopes = einsum("ck,akj->acj", coefficients, jnp.asarray(_gradient(degree), along[0].dtype))

    def turned(unit, slopes, along):
        rows = _rows(unit, degree - 1)
        return [
            _sum(
                along[axis] * _sum(slopes[axis, c, j] * row for j, row in enumerate(rows))
                for axis in range(3)
            )
            for c in range(len(coefficients))
        ]

    return jnp.stack(materialize(_anew(turned), unit, slopes, along), axis=-1)


def _along(turn: Float[Array, "n 3"], unit, inverse) -> list[Float[Array, " n"]]:
    """Components of the unit vector's change where the vector's is `turn`."""
    columns = [turn[:, axis] for axis in range(3)]
    radial = _sum(t * u for t, u in zip(columns, unit, strict=True))
    return [(t - u * radial) * inverse for t, u in zip(columns, unit, strict=True)]


def _stored(vectors: Float[Array, "n 3"]):
    """Components of the unit vectors, and the vectors' reciprocal lengths, in memory."""

    def columns(vectors):
        (x, y, z), inverse = normalize(vectors.T[:, :, None])
        return [x[:, 0], y[:, 0], z[:, 0]], inverse[:, 0]

    return materialize(columns, vectors)


def _units(vectors: Float[Array, "n 3"]) -> Float[Array, "3 n 1"]:
    """Components first, each a column that broadcasts along functions."""
    return normalize(vectors.T[:, :, None])[0]


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
