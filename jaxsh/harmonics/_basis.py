"""Real spherical harmonics of vectors, and their gradient, in the layout that is fast.

Two kernels: the 2(L+1) azimuth rows, then all K rows of the basis at once (see `_tables`). XLA
would rather fuse the first into the second and compute each azimuth row K/(2L+2) times over. Values
of low degree alone are one pass over the vectors (see `_low_degree`).

Derivatives never go through the products. A solid harmonic r^l y_lm has derivatives that are
combinations of at most two solid harmonics of degree l-1, so one rule written in terms of the basis
itself is right to every order, forward, reverse and mixed, and regular at the poles.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from .._core.checks import as_float, check_degree, check_vectors, described
from .._core.vectors import components_first, normalize
from .._core.xla import materialize, on_mesh
from ._indexing import degrees
from ._low_degree import LOW_DEGREE, coefficients_first, points_first
from ._tables import azimuth_table, gradient_table, zenith_table


def evaluate(
    vectors: Float[ArrayLike, "*batch 3"], degree: int, *, axis: int = -1
) -> Float[Array, "..."]:
    """Evaluate the real orthonormal spherical harmonics y_i(s/|s|) of nonzero vectors s.

    Vectors may have any length. Index i = l(l+1) + m, no Condon–Shortley phase:
    y_1 = √(3/4π)·(y, z, x)/|s|.

    **Arguments**

    - `vectors`: (..., 3). Differentiable.
    - `degree`: the largest l, known at trace time.
    - `axis`: where the K = (degree+1)² coefficients go: -1 for (..., K), or 0 for (K, ...), the
      layout that degrees above 6 and derivatives are computed in, which saves a transpose.

    **Returns** an array of the input's dtype. Derivatives to every order and in every mode are
    finite in every direction, the poles included, as long as |s|^-order fits the dtype. A zero
    vector has no direction and gives NaN; components that are subnormal count as zero. Raises
    `ValueError` for a wrong shape, degree or axis.

    The batch is the axis along which the kernels run: pass a whole batch rather than `jax.vmap`
    over single vectors. It may be sharded.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import harmonics
    >>> basis = harmonics.evaluate(jnp.array([[0.0, 0.0, 1.0], [1.0, 1.0, 0.0]]), degree=2)
    >>> basis.shape, round(float(basis[0, 2]), 3)  # √(3/4π)
    ((2, 9), 0.489)
    """
    return _evaluate(*_checked(vectors, degree, axis))


def evaluate_with_gradient(
    vectors: Float[ArrayLike, "*batch 3"], degree: int, *, axis: int = -1
) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
    """Evaluate spherical harmonics y_i(s/|s|) and their gradient d/ds, together.

    Arguments, errors and derivatives are those of `evaluate`. The gradient needs no second
    recursion: each ∂_k (r^l y_lm) is a combination of at most two harmonics of degree l-1.

    **Returns** (..., K) and (..., K, 3), or with `axis=0` (K, ...) and (3, K, ...), the fast
    layout. The gradient is tangential, s·∇y = 0, and falls off as 1/|s|. Differentiable again.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import harmonics
    >>> basis, gradient = harmonics.evaluate_with_gradient(jnp.array([0.0, 0.0, 2.0]), degree=1)
    >>> gradient.shape, round(float(gradient[3, 0]), 3)  # ∂y_11/∂x = √(3/4π)/2
    ((4, 3), 0.244)
    """
    return _evaluate_with_gradient(*_checked(vectors, degree, axis))


def _checked(vectors, degree, axis):
    if not isinstance(axis, int) or isinstance(axis, bool) or axis not in (0, -1):
        raise ValueError(
            f"axis must be -1, coefficients last, or 0, coefficients first, got {described(axis)}"
        )
    vectors = as_float(vectors, "vectors")
    check_vectors("vectors", vectors)
    return vectors, check_degree(degree), axis


@functools.partial(jax.jit, static_argnums=(1, 2))
def _evaluate(vectors, degree, axis):
    if vectors.ndim > 2 and on_mesh(vectors):
        # One batch axis at a time: two as one would lose the sharding of the second.
        return jax.vmap(lambda v: _evaluate(v, degree, axis), out_axes=1 + axis)(vectors)
    flat, count = vectors.reshape(-1, 3), (degree + 1) ** 2
    values = (
        _values(flat, degree, axis) if 0 < degree <= LOW_DEGREE else _by_rows(flat, degree, axis)
    )
    batch = vectors.shape[:-1]
    return values.reshape((count, *batch) if axis == 0 else (*batch, count))


@functools.partial(jax.custom_jvp, nondiff_argnums=(1, 2))
def _values(vectors: Float[Array, "n 3"], degree: int, axis: int) -> Float[Array, "..."]:
    """Values at low degree, in one pass; where they are differentiated, those of `_by_rows`."""
    return (coefficients_first if axis == 0 else points_first)(vectors, degree)


@_values.defjvp
def _values_jvp(degree, axis, primals, tangents):
    return jax.jvp(lambda vectors: _by_rows(vectors, degree, axis), primals, tangents)


def _by_rows(vectors: Float[Array, "n 3"], degree: int, axis: int) -> Float[Array, "..."]:
    unit, _ = normalize(components_first(vectors))
    basis = _solid(unit, degree)
    return basis if axis == 0 else basis.T


@functools.partial(jax.jit, static_argnums=(1, 2))
def _evaluate_with_gradient(vectors, degree, axis):
    if vectors.ndim > 2 and on_mesh(vectors):
        out = (0, 0) if axis else (1, 2)
        return jax.vmap(lambda v: _evaluate_with_gradient(v, degree, axis), out_axes=out)(vectors)
    basis, gradient = _with_gradient(*normalize(components_first(vectors)), degree)
    shape = ((degree + 1) ** 2, *vectors.shape[:-1])
    basis, gradient = basis.reshape(shape), gradient.reshape(3, *shape)
    if axis == 0:
        return basis, gradient
    return jnp.moveaxis(basis, 0, -1), jnp.moveaxis(gradient, (0, 1), (-1, -2))


@functools.partial(jax.custom_jvp, nondiff_argnums=(1,))
def _solid(unit: Float[Array, "3 1 n"], degree: int) -> Float[Array, "k n"]:
    """Values of r^l y_lm on the unit sphere, with the derivatives of that polynomial."""
    table = zenith_table(degree)
    rows, z, u = _azimuth(unit, degree)
    e, f, factors = (t.astype(z.dtype)[..., None] for t in (table.e, table.f, table.factors))
    basis = _take(rows, table.azimuth_row) * (e * z + f)
    for first, *rest in factors:
        basis = basis * functools.reduce(lambda value, c: value * u + c, rest, first)
    return basis


@_solid.defjvp
def _solid_jvp(degree, primals, tangents):
    (unit,), (tangent,) = primals, tangents
    basis = _solid(unit, degree)
    return basis, _derivative_along(basis, tangent, degree)


@functools.partial(jax.custom_jvp, nondiff_argnums=(2,))
def _with_gradient(
    unit: Float[Array, "3 1 n"], inverse_length: Float[Array, "1 n"], degree: int
) -> tuple[Float[Array, "k n"], Float[Array, "3 k n"]]:
    """The basis, and ∇y = (∇(r^l y) - l n y) / |s|, by Euler's theorem."""
    basis = _solid(unit, degree)
    # The normal comes from y_1 = c·(y, z, x): rows that are there already, where `unit` would be
    # fused in and normalised 3K times over.
    normal = jnp.stack([basis[i : i + 1] for i in ((3, 1, 2) if degree else (0, 0, 0))])
    scale = np.sqrt(4 * np.pi / 3) * degrees(degree)
    radial = normal * (scale.astype(basis.dtype)[:, None] * basis)[None]
    table = gradient_table(degree)
    first, second = (jnp.asarray(t, basis.dtype)[..., None] for t in (table.first, table.second))
    solid = first * _take(basis, table.first_row) + second * _take(basis, table.second_row)
    return basis, (solid - radial) * inverse_length[None]


@_with_gradient.defjvp
def _with_gradient_jvp(degree, primals, tangents):
    basis, gradient = _with_gradient(*primals, degree)
    normal, inverse_length = _rows(primals[0]), primals[1][0]
    turn, stretch = _rows(tangents[0]), tangents[1][0]

    def row(k, basis, normal, inverse_length, turn, stretch, terms, l):
        """Row k of the basis's tangent and, for x, y and z, of its gradient's."""
        value, change = _take(basis, k), _along(basis, turn, terms, k)
        changes = []
        for axis in range(3):
            (i, a), (j, b) = ((row[k, axis], factor[k, axis]) for row, factor in terms)
            solid = a * _take(basis, i) + b * _take(basis, j)
            bend = a * _along(basis, turn, terms, i) + b * _along(basis, turn, terms, j)
            radial = l[k] * normal[axis] * value
            radial_change = l[k] * (turn[axis] * value + normal[axis] * change)
            changes.append((bend - radial_change) * inverse_length + (solid - radial) * stretch)
        return change, changes

    l = jnp.asarray(degrees(degree), basis.dtype)
    arguments = basis, normal, inverse_length, turn, stretch, _terms(degree, basis.dtype), l
    change, changes = _row_by_row(row, *arguments)
    return (basis, gradient), (change, jnp.stack(changes))


def _derivative_along(
    basis: Float[Array, "k n"], direction: Float[Array, "3 1 n"], degree: int
) -> Float[Array, "k n"]:
    """Derivative of the solid harmonics on the unit sphere: direction · ∇(r^l y_lm)."""

    def row(k, basis, direction, terms):
        return _along(basis, direction, terms, k)

    return _row_by_row(row, basis, _rows(direction), _terms(degree, basis.dtype))


def _row_by_row(row, basis: Float[Array, "k n"], *arguments):
    """All rows k of `row(k, basis, *arguments)`, which is linear in some of its arguments.

    On the CPU a loop, for its transpose's sake: reverse mode adds up K rows, and a loop that makes
    each row anew from the basis does so within the cache, where XLA's reduction over all of them
    at once is many times slower. Vectors come as three rows: of one array with three, the
    transposed loop would copy all of it for each row that it adds to.
    """
    numbers = np.arange(len(basis), dtype=np.int32)

    def one_by_one(basis, *arguments):
        once = jax.checkpoint(row, prevent_cse=False)
        return jax.lax.map(lambda k: once(k, basis, *arguments), jnp.asarray(numbers))

    # Checkpointed too: what it kept for reverse mode would be given space for on the CPU as well.
    @functools.partial(jax.checkpoint, prevent_cse=False)
    def at_once(basis, *arguments):
        return jax.vmap(lambda k: row(k, basis, *arguments))(jnp.asarray(numbers))

    return jax.lax.platform_dependent(basis, *arguments, cpu=one_by_one, default=at_once)


def _rows(vectors: Float[Array, "3 1 n"]) -> tuple[Float[Array, " n"], ...]:
    return tuple(vectors[:, 0])


def _terms(degree: int, dtype) -> list[tuple[Int[Array, "k 3"], Float[Array, "k 3"]]]:
    """The two terms of each derivative: rows of the basis, and factors."""
    table = gradient_table(degree)
    pairs = (table.first_row, table.first), (table.second_row, table.second)
    return [(jnp.asarray(row.T), jnp.asarray(factor.T, dtype)) for row, factor in pairs]


def _along(basis: Float[Array, "k n"], direction, terms, k) -> Float[Array, " n"]:
    """Derivative of row k along a direction."""
    slopes = (
        factor[k, axis] * _take(basis, row[k, axis]) * direction[axis]
        for row, factor in terms
        for axis in range(3)
    )
    return functools.reduce(jnp.add, slopes)


def _azimuth(
    unit: Float[Array, "3 1 n"], degree: int
) -> tuple[Float[Array, "rows n"], Float[Array, "1 n"], Float[Array, "1 n"]]:
    """Azimuth rows C_0 … C_L, S_0 … S_L, the parts of (x + iy)^m; z; and z² - ½."""
    # The kind of row, real or imaginary, becomes part of the row, and columns broadcast along n.
    lone, *factors = (np.concatenate(list(table)).T[..., None] for table in azimuth_table(degree))

    def rows(unit):
        x, y, z = unit
        a, b, c, d = (jnp.asarray(t, x.dtype) for t in lone)
        row = a + b * x + (c + d * x) * y
        for alpha, beta, gamma in zip(*factors, strict=True):
            alpha, beta, gamma = (jnp.asarray(t, x.dtype) for t in (alpha, beta, gamma))
            row = row * (alpha * (x * x) + beta * (y * y) + gamma)
        return row, z, z * z - 0.5

    return materialize(rows, unit)


def _take(rows: Float[Array, "k n"], index: Array | np.ndarray) -> Float[Array, "... n"]:
    return rows.at[index].get(mode="promise_in_bounds")
