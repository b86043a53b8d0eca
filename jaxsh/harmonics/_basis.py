"""Real spherical harmonics of vectors, and their gradient, in the layout that is fast.

Two kernels: the 2(L+1) azimuth rows, then all K rows of the basis at once (see `_tables`). XLA
would rather fuse the first into the second and compute each azimuth row K/(2L+2) times over; a
loop of two passes, cosines and sines, is a boundary that it keeps.

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
    unit, _ = _normalize(vectors)
    basis = _solid(unit, degree).reshape((degree + 1) ** 2, *vectors.shape[:-1])
    return basis if axis == 0 else jnp.moveaxis(basis, 0, -1)


@functools.partial(jax.jit, static_argnums=(1, 2))
def _evaluate_with_gradient(vectors, degree, axis):
    unit, length = _normalize(vectors)
    basis = _solid(unit, degree)
    # ∇y = (∇(r^l y) - l n y) / |s|, by Euler's theorem. The normal comes from y_1 = c·(y, z, x):
    # rows that are there already, where `unit` would be fused in and normalised 3K times over.
    x, y, z = (basis[i : i + 1] for i in ((3, 1, 2) if degree else (0, 0, 0)))
    scale = np.sqrt(4 * np.pi / 3) * degrees(degree)
    radial = jnp.stack([x, y, z]) * (scale.astype(basis.dtype)[:, None] * basis)[None]
    gradient = (_derivative(basis, degree) - radial) * (1 / length)[None]
    shape = ((degree + 1) ** 2, *vectors.shape[:-1])
    basis, gradient = basis.reshape(shape), gradient.reshape(3, *shape)
    if axis == 0:
        return basis, gradient
    return jnp.moveaxis(basis, 0, -1), jnp.moveaxis(gradient, (0, 1), (-1, -2))


def _normalize(
    vectors: Float[Array, "*batch 3"],
) -> tuple[Float[Array, "3 1 n"], Float[Array, "1 n"]]:
    """Unit vectors, components first, and the vectors' lengths."""
    s = vectors.reshape(-1, 3).T[:, None]
    # A length whose square would over- or underflow is none the less a length, so the largest
    # component is taken out; after a power of two, since the reciprocal of a very large one would
    # itself be flushed to zero. Both cancel and are constants to derivatives.
    largest = jax.lax.stop_gradient(jnp.max(jnp.abs(s), axis=0, keepdims=True))
    power = 2.0 ** (jnp.finfo(s.dtype).maxexp // 2)
    power = jnp.where(largest > 1, jnp.asarray(1 / power, s.dtype), jnp.asarray(power, s.dtype))
    scaled = (s * power) / (largest * power)
    length = jnp.sqrt(jnp.sum(scaled**2, axis=0, keepdims=True))
    return scaled / length, (largest * length)[0]


@functools.partial(jax.custom_jvp, nondiff_argnums=(1,))
def _solid(unit: Float[Array, "3 1 n"], degree: int) -> Float[Array, "k n"]:
    """Values of r^l y_lm on the unit sphere, with the derivatives of that polynomial."""
    table = zenith_table(degree)
    rows, (z, u) = _azimuth(unit, degree)
    e, f, factors = (t.astype(z.dtype)[..., None] for t in (table.e, table.f, table.factors))
    basis = _take(rows, table.azimuth_row) * (e * z + f)
    for first, *rest in factors:
        basis = basis * functools.reduce(lambda value, c: value * u + c, rest, first)
    return basis


@_solid.defjvp
def _solid_jvp(degree, primals, tangents):
    (unit,), (tangent,) = primals, tangents
    basis = _solid(unit, degree)
    # Axis by axis: sums of two-dimensional terms fuse, and so do their transposes.
    along = (_derivative(basis, degree, axis) * tangent[axis] for axis in range(3))
    return basis, sum(along)


def _derivative(
    basis: Float[Array, "k n"], degree: int, axes: int | slice = slice(None)
) -> Float[Array, "..."]:
    """∇(r^l y_lm) on the unit sphere, along some or all of x, y, z: (k, n) or (3, k, n)."""
    table = gradient_table(degree)
    first, second = (
        jnp.asarray(t[axes], basis.dtype)[..., None] for t in (table.first, table.second)
    )
    derivative = first * _take(basis, table.first_row[axes])
    return derivative + second * _take(basis, table.second_row[axes])


def _azimuth(unit: Float[Array, "3 1 n"], degree: int):
    """C_0 … C_L, S_0 … S_L, the real and imaginary parts of (x + iy)^m; and z, z² - ½.

    The last two ride along so that they too come out of the loop as plain rows, and not as
    normalisations fused, K times over, into the large kernel.
    """
    x, y, z = unit

    def rows(part):
        (lone, alpha, beta, gamma), square = part
        row = lone[0] + lone[1] * x + (lone[2] + lone[3] * x) * y
        for a, b, c in zip(alpha, beta, gamma, strict=True):
            row = row * (a * (x * x) + b * (y * y) + c)
        return row, jnp.where(square, z * z - 0.5, z)

    # (part, row, n) -> (part, n, row, 1): columns that broadcast along the batch.
    parts = tuple(
        jnp.asarray(np.moveaxis(t, -1, -2)[..., None], x.dtype) for t in azimuth_table(degree)
    )
    azimuth, heights = jax.lax.map(rows, (parts, np.array([False, True])))
    return azimuth.reshape(2 * (degree + 1), x.shape[-1]), heights


def _take(rows: Float[Array, "k n"], index: np.ndarray) -> Float[Array, "... n"]:
    return rows.at[index].get(mode="promise_in_bounds")
