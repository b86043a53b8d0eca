"""Samples to coefficients and back, and irradiance: the basis is never held as a whole.

On the CPU a block's basis is multiplied while it is still in cache; on an accelerator blocks are as
large as memory allows, mostly all at once.
"""

import functools

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import (
    as_finite,
    as_float,
    check_coefficients,
    check_degree,
    check_type,
    check_vectors,
    flatten_batch,
)
from .._core.linalg import matmul
from .._core.xla import equal_blocks, keep_rows, on_mesh, rows_at_once
from ..harmonics import clamped_cosine, convolve, degree_of, evaluate, synthesize
from ._quadrature import Quadrature

# Directions per block on a CPU: 1 MB of basis at degree 10 in float32.
_BLOCK = 2048


def project(
    values: Float[ArrayLike, "*batch n"], quadrature: Quadrature, degree: int
) -> Float[Array, "*batch k"]:
    """Project a function, sampled at the directions of a quadrature, onto the basis: ∫ f y_i dω.

    **Arguments**

    - `values`: (..., N), one per direction.
    - `quadrature`: N directions and weights.
    - `degree`: the largest l, known at trace time.

    **Returns** coefficients (..., K), K = (degree+1)², in the dtype of `values`: as exact as the
    quadrature is for f·y_i. Linear in the values; differentiable in values, directions and
    weights, forward and reverse, and in reverse too without holding the basis. Values sharded
    over the directions are summed where they lie. Raises `ValueError` where N is not the
    quadrature's.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import sphere
    >>> quadrature = sphere.gauss_legendre(degree=2)
    >>> c = sphere.project(quadrature.directions[:, 2], quadrature, degree=1)  # f = z
    >>> round(float(c[2]), 3)  # √(4π/3)
    2.047
    """
    values = as_float(values, "values")
    check_type("quadrature", quadrature, Quadrature)
    count = len(quadrature.weights)
    if values.ndim == 0 or values.shape[-1] != count:
        raise ValueError(
            f"expected values (..., {count}), one per direction, got shape {values.shape}"
        )
    return _project(values, quadrature, check_degree(degree))


def reconstruct(
    coefficients: Float[ArrayLike, "*batch k"], directions: Float[ArrayLike, "n 3"]
) -> Float[Array, "*batch n"]:
    """Evaluate functions, given by coefficients, at directions: f(ω_n) = Σ_i c_i y_i(ω_n).

    **Arguments**

    - `coefficients`: (..., K).
    - `directions`: (N, 3), nonzero, of any length.

    **Returns** values (..., N), in the dtype of the coefficients. Differentiable in both, to every
    order, and in reverse too without holding the basis. A zero direction gives NaN. Raises
    `ValueError` where K is not a square and for directions of another shape.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import sphere
    >>> c = jnp.zeros((3, 4))  # three functions of degree 1
    >>> sphere.reconstruct(c, sphere.fibonacci(5).directions).shape
    (3, 5)
    """
    coefficients = as_float(coefficients, "coefficients")
    directions = as_float(directions, "directions")
    if directions.ndim != 2 or directions.shape[-1] != 3:
        raise ValueError(f"expected directions (N, 3), got shape {directions.shape}")
    check_coefficients("coefficients", coefficients)
    return _reconstruct(coefficients, directions)


def irradiance(
    light: Float[ArrayLike, "*lights k"], normals: Float[ArrayLike, "*points 3"]
) -> Float[Array, "..."]:
    """Light surfaces that nothing shadows: irradiance E(n) = ∫ L(ω) max(0, n·ω) dω at normals n.

    E(n) = Σ_lm λ_l L_lm y_lm(n) with the clamped cosine's λ_l = π, 2π/3, π/4, 0, −π/24, …
    (Ramamoorthi & Hanrahan 2001, eq. 7, there A_l), for lights of any degree. Beyond degree 2 the
    λ_l are small: nine coefficients carry nearly all of the irradiance of real light.

    **Arguments**

    - `light`: coefficients (C, K) in C channels, shared by all normals, or with more axes
      (..., C, K), which broadcast against those of the normals: (V, C, K) is one light for each
      of V normals, (B, 1, C, K) a batch of shared ones. One channel may also come as (K,).
    - `normals`: (..., 3), nonzero, of any length: E(n/|n|) is meant.

    **Returns** irradiance (..., C), or (...) for a light (K,), in the dtype of the light. A
    diffuse surface leaves albedo/π times it. Linear in the light; differentiable in both to every
    order, forward and reverse, with the gradient in a normal tangential to it. A zero normal gives
    NaN. A light that rings may give values below zero: see `harmonics.dering`. Raises `ValueError`
    where K is not a square, the normals have no three components or leading axes do not broadcast,
    and for a light that is at hand and not finite (`docs/conventions.md`).

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import sphere
    >>> light = jnp.zeros((3, 9)).at[:, 0].set(3.5449077)  # radiance 1 everywhere: √(4π)
    >>> E = sphere.irradiance(light, jnp.array([[0.0, 0.0, 1.0], [1.0, 1.0, 0.0]]))
    >>> E.shape, round(float(E[1, 0]), 3)
    ((2, 3), 3.142)
    """
    light, normals = as_finite(light, "light"), as_float(normals, "normals")
    check_vectors("normals", normals)
    check_coefficients("light", light)
    if light.ndim == 1:
        return _irradiance(light[None], normals)[..., 0]
    try:
        jnp.broadcast_shapes(light.shape[:-2], normals.shape[:-1])
    except ValueError:
        raise ValueError(
            f"leading axes must broadcast, got light {light.shape}, where they stand before "
            f"channels and coefficients, and normals {normals.shape}"
        ) from None
    return _irradiance(light, normals)


@functools.partial(jax.jit, static_argnums=2)
def _project(values, quadrature, degree: int):
    weighted = flatten_batch(values) * quadrature.weights.astype(values.dtype)[None]
    directions = quadrature.directions.astype(values.dtype)
    count = len(directions)

    def whole(directions, weighted):
        return matmul(evaluate(directions, degree, axis=0), weighted.T)

    def streamed(size, directions, weighted):
        if count <= size:
            return whole(directions, weighted)

        @jax.checkpoint  # in reverse too, evaluate a block again rather than hold all of them
        def add(total, block):
            directions, rows = block
            return total + matmul(evaluate(directions, degree, axis=0), rows), None

        start = jnp.zeros(((degree + 1) ** 2, len(weighted)), values.dtype)
        blocks = (
            _blocks(directions, size, pad=(0, 0, 1)),
            _blocks(weighted.T, size, pad=(0,) * len(weighted)),
        )
        total, _ = jax.lax.scan(add, start, blocks)
        return total

    if count <= _BLOCK or on_mesh(values, quadrature):
        total = keep_rows(whole, directions, weighted, like=weighted, axis=1, out=None)
    else:
        large = equal_blocks(count, _most(degree, values.dtype))
        total = jax.lax.platform_dependent(
            directions,
            weighted,
            cpu=functools.partial(streamed, _BLOCK),
            default=functools.partial(streamed, large),
        )
    return total.T.reshape(*values.shape[:-1], len(total))


@jax.jit
def _reconstruct(coefficients, directions):
    rows = flatten_batch(coefficients)
    values = synthesize(rows, directions.astype(rows.dtype)).T
    return values.reshape(*coefficients.shape[:-1], len(directions))


@jax.jit
def _irradiance(light, normals):
    cosine = clamped_cosine(degree_of(light.shape[-1]))
    return synthesize(convolve(light, cosine), normals)


def _most(degree: int, dtype) -> int:
    """Directions whose basis an accelerator has at once."""
    return rows_at_once((degree + 1) ** 2 * dtype.itemsize)


def _blocks(
    rows: Float[Array, "n c"], size: int, pad: tuple[int, ...]
) -> Float[Array, "blocks size c"]:
    """Rows in blocks of equal size, the last one filled up with rows of `pad`."""
    missing = -len(rows) % size
    filler = jnp.broadcast_to(jnp.asarray(pad, rows.dtype), (missing, len(pad)))
    filled = jnp.concatenate([rows, filler])
    return filled.reshape(len(filled) // size, size, rows.shape[-1])
