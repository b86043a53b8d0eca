"""Real spherical harmonics of vectors, and their gradient, in the layout that is fast.

Two kernels: the 2(L+1) azimuth rows, then all K rows of the basis at once (see `_tables`). XLA
would rather fuse the first into the second and compute each azimuth row K/(2L+2) times over; on
the CPU a conditional is a boundary that it keeps.

Derivatives never go through the products. As a solid harmonic r^l y_lm has derivatives that are
combinations of at most two solid harmonics of degree l-1, one rule written in terms of the basis
itself is right to every order, forward, reverse and mixed, and regular at the poles.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from ._checks import as_float
from ._indexing import check_degree, degrees
from ._tables import azimuth_table, gradient_table, zenith_table


def evaluate(
    vectors: Float[ArrayLike, "*batch 3"], degree: int, *, axis: int = -1
) -> Float[Array, "..."]:
    """Real orthonormal spherical harmonics y_i(s/|s|) of nonzero vectors s of any length.

    Index i = l(l+1) + m, no Condon–Shortley phase: y_1 = √(3/4π)·(y, z, x)/|s|.

    **Arguments**

    - `vectors`: (..., 3). Differentiable.
    - `degree`: the largest l, known at trace time.
    - `axis`: where the K = (degree+1)² coefficients go: -1 for (..., K), or 0 for (K, ...), the
      layout that they are computed in, which saves a transpose.

    **Returns** an array of the input's dtype. Derivatives to every order and in every mode are
    finite in every direction, the poles included, as long as |s|^-order fits the dtype. A zero
    vector has no direction and gives NaN; components that are subnormal count as zero. Raises
    `ValueError` for a wrong shape, degree or axis.

    The batch is the axis along which the kernels run: pass a whole batch rather than `jax.vmap`
    over single vectors.
    """
    return _evaluate(*_checked(vectors, degree, axis))


def evaluate_with_gradient(
    vectors: Float[ArrayLike, "*batch 3"], degree: int, *, axis: int = -1
) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
    """Spherical harmonics y_i(s/|s|) and their gradient d/ds, together.

    Arguments, errors and derivatives as for `evaluate`. Returns (..., K) and (..., K, 3), or with
    `axis=0` (K, ...) and (3, K, ...), the fast layout. The gradient is tangential, s·∇y = 0, and
    falls off as 1/|s|.
    """
    return _evaluate_with_gradient(*_checked(vectors, degree, axis))


def _checked(vectors, degree, axis):
    if axis not in (0, -1):
        raise ValueError(
            f"axis must be -1, coefficients last, or 0, coefficients first, got {axis}"
        )
    vectors = as_float(vectors)
    if vectors.ndim == 0 or vectors.shape[-1] != 3:
        raise ValueError(f"expected vectors (..., 3) with x, y, z last, got shape {vectors.shape}")
    return vectors, check_degree(degree), axis


@functools.partial(jax.jit, static_argnums=(1, 2))
def _evaluate(vectors, degree, axis):
    unit, _ = _normalize(_components_first(vectors))
    basis = _solid(unit, degree).reshape((degree + 1) ** 2, *vectors.shape[:-1])
    return basis if axis == 0 else jnp.moveaxis(basis, 0, -1)


@functools.partial(jax.jit, static_argnums=(1, 2))
def _evaluate_with_gradient(vectors, degree, axis):
    unit, inverse_length = _normalize(_components_first(vectors))
    basis = _solid(unit, degree)
    # ∇y = (∇(r^l y) - l n y) / |s|, by Euler's theorem. The normal comes from y_1 = c·(y, z, x):
    # rows that are there already, where `unit` would be fused in and normalised 3K times over.
    x, y, z = (basis[i : i + 1] for i in ((3, 1, 2) if degree else (0, 0, 0)))
    scale = np.sqrt(4 * np.pi / 3) * degrees(degree)
    radial = jnp.stack([x, y, z]) * (scale.astype(basis.dtype)[:, None] * basis)[None]
    gradient = (_derivative(basis, degree) - radial) * inverse_length[None]
    shape = ((degree + 1) ** 2, *vectors.shape[:-1])
    basis, gradient = basis.reshape(shape), gradient.reshape(3, *shape)
    if axis == 0:
        return basis, gradient
    return jnp.moveaxis(basis, 0, -1), jnp.moveaxis(gradient, (0, 1), (-1, -2))


def _components_first(vectors: Float[Array, "*batch 3"]) -> Float[Array, "3 1 n"]:
    return vectors.reshape(-1, 3).T[:, None]


@jax.custom_jvp
def _normalize(s: Float[Array, "3 1 n"]) -> tuple[Float[Array, "3 1 n"], Float[Array, "1 n"]]:
    """Unit vectors and the reciprocals of the vectors' lengths, components first.

    Sums are written out and √(1/a) is not 1/√a: on the CPU, XLA's reductions over three rows and
    its reciprocal square root in float64 each cost more than all the rest.
    """
    # A length whose square would over- or underflow is none the less a length, so the largest
    # component is taken out; after a power of two, since the reciprocal of a very large one would
    # itself be flushed to zero.
    x, y, z = jnp.abs(s)
    largest = jnp.maximum(jnp.maximum(x, y), z)
    power = 2.0 ** (jnp.finfo(s.dtype).maxexp // 2)
    power = jnp.where(largest > 1, jnp.asarray(1 / power, s.dtype), jnp.asarray(power, s.dtype))
    scaled = (s * power[None]) / (largest * power)[None]
    inverse = jnp.sqrt(1 / _dot(scaled, scaled))
    return scaled * inverse[None], inverse / largest


@_normalize.defjvp
def _normalize_jvp(primals, tangents):
    unit, inverse_length = _normalize(*primals)
    (tangent,) = tangents
    along = _dot(unit, tangent)
    # Component by component, so that the transpose has no sums over three rows either.
    turned = [(t - u * along) * inverse_length for t, u in zip(tangent, unit, strict=True)]
    return (unit, inverse_length), (jnp.stack(turned), -(along * inverse_length) * inverse_length)


def _dot(a: Float[Array, "3 1 n"], b: Float[Array, "3 1 n"]) -> Float[Array, "1 n"]:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


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


def _derivative(basis: Float[Array, "k n"], degree: int) -> Float[Array, "3 k n"]:
    """∇(r^l y_lm) on the unit sphere."""
    table = gradient_table(degree)
    first, second = (jnp.asarray(t, basis.dtype)[..., None] for t in (table.first, table.second))
    derivative = first * _take(basis, table.first_row)
    return derivative + second * _take(basis, table.second_row)


def _derivative_along(
    basis: Float[Array, "k n"], direction: Float[Array, "3 1 n"], degree: int
) -> Float[Array, "k n"]:
    """direction · ∇(r^l y_lm), a row of the basis at a time.

    For its transpose's sake: reverse mode adds up K rows, and a loop that makes each row anew from
    the basis does so within the cache, where XLA's reduction over all of them at once is 2 to 40
    times slower on the CPU.
    """

    @functools.partial(jax.checkpoint, prevent_cse=False)
    def along(basis, x, y, z, terms):
        first_row, first, second_row, second = terms
        axes = zip((x, y, z), first_row, first, second_row, second, strict=True)
        return sum((a * _take(basis, i) + b * _take(basis, j)) * t for t, i, a, j, b in axes)

    table = gradient_table(degree)
    first, second = (jnp.asarray(t.T, basis.dtype) for t in (table.first, table.second))
    terms = jnp.asarray(table.first_row.T), first, jnp.asarray(table.second_row.T), second
    return jax.lax.map(functools.partial(along, basis, *direction[:, 0]), terms)


def _azimuth(
    unit: Float[Array, "3 1 n"], degree: int
) -> tuple[Float[Array, "rows n"], Float[Array, "1 n"], Float[Array, "1 n"]]:
    """C_0 … C_L, S_0 … S_L, the real and imaginary parts of (x + iy)^m; z; and z² - ½."""
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

    def apart(unit):
        # Never true; but a branch that might be taken is a boundary that XLA does not fuse across.
        never = jnp.any(unit[:, :, :1] > 2)
        return jax.lax.cond(never, lambda u: jax.tree.map(jnp.zeros_like, rows(u)), rows, unit)

    return jax.lax.platform_dependent(unit, cpu=apart, default=rows)


def _take(rows: Float[Array, "k n"], index: Array | np.ndarray) -> Float[Array, "... n"]:
    return rows.at[index].get(mode="promise_in_bounds")
