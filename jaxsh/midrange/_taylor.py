"""Moments of a radiance cube, and from them its coefficients' Taylor expansion to any order.

A texel that sees a plane stands for the light c(p + d) = L dω (1 - q·d) y(ω′)(r/r′)³ of a patch of
that plane, with q = n/h (docs/near_light_cubes.md). Expanded in d/r, order k has L/r^k times
harmonics up to degree l+k, and L q/r^(k-1) times those up to l+k-1.
"""

import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._core.checks import check_degree
from .._core.linalg import einsum
from ..harmonics import num_coefficients
from ._cube import RadianceCube, inverse_distances
from ._derivatives import monomials, taylor_matrices
from ._expansion import Expansion
from ._moments import moment_tables, moments

_ORDERS = range(4)


def taylor(cube: RadianceCube, degree: int, order: int) -> Expansion:
    """Coefficients of a cube's light around its point, to `order` 0, 1, 2 or 3 in the offset.

    Exact derivatives of Σ_t L dω (1 - n·d/h) y(ω′)(r/r′)³, what the texels' patches of surface send
    to the point p + d, visibility unchanged: the paper's open question of §8. Order 1 is
    `project_cube_with_gradient`, order 0 `project_cube`. The sum converges where |d| is below all
    r, and a texel's factor 1 - n·d/h is right up to its plane.

    **Arguments**: a `cube`, (...) points; `degree` and `order`, known at trace time.

    **Returns** an `Expansion`, terms (..., 3, K, M) in the cube's dtype, linear in the radiance,
    differentiable in radiance, distance, offset and normal. Texels at infinity, or whose plane is
    seen edge on, add to order 0 only. Raises `ValueError` for a wrong degree or order.
    """
    if order not in _ORDERS:
        raise ValueError(f"order must be 0, 1, 2 or 3, got {order!r}")
    tables = moment_tables(cube.resolution, check_degree(degree) + order, cube.radiance.dtype)
    return Expansion(cube.point, each(_terms, cube, tables, degree, order))


def project_cube(cube: RadianceCube, degree: int) -> Float[Array, "*batch 3 k"]:
    """Coefficients ∫ L(ω) y_i(ω) dω of a cube's radiance (eq. 5): (..., 3, K).

    With exact solid angles of the texels and y at their centres: a constant cube is exact in l = 0,
    any other to the order of resolution^-1 along edges of lights. Linear and differentiable in the
    radiance. Raises `ValueError` for a wrong degree.
    """
    return taylor(cube, degree, 0).coefficients


def each(function: Callable[..., Array], cube: RadianceCube, tables: Any, *static: int) -> Array:
    """`function` of each cube of a batch in turn: one after the other, for the memory's sake."""
    batch = cube.point.shape[:-1]
    flat = jax.tree.map(lambda a: a.reshape(-1, *a.shape[len(batch) :]), cube)
    result = _each(function, flat, tables, static)
    return result.reshape(*batch, *result.shape[1:])


@functools.partial(jax.jit, static_argnums=(0, 3))
def _each(function, cubes, tables, static):
    return jax.lax.map(lambda cube: function(cube, tables, *static), cubes)


def _terms(cube, tables, degree: int, order: int) -> Float[Array, "3 k m"]:
    dtype = cube.radiance.dtype
    found = moments(tables, _columns(cube, order), cube.resolution, degree + order).T
    terms = [found[:3, : num_coefficients(degree), None]]
    for k in range(1, order + 1):
        radiance, planes = found[12 * k - 9 : 12 * k - 6], found[12 * k - 6 : 12 * k + 3]
        here, before = (jnp.asarray(taylor_matrices(degree, j), dtype) for j in (k, k - 1))
        radiance = radiance[:, : here.shape[-1]]
        planes = planes[:, : before.shape[-1]].reshape(3, 3, before.shape[-1])
        moved = einsum("mij,cj->cim", here, radiance)
        turned = einsum("mij,cdj->cidm", before, planes)
        # The product of q·d and the terms of one order less.
        lower = {axes: i for i, axes in enumerate(monomials(k - 1))}
        for i, axes in enumerate(monomials(k)):
            for axis in set(axes):
                rest = list(axes)
                rest.remove(axis)
                moved = moved.at[..., i].add(-turned[..., axis, lower[tuple(rest)]])
        terms.append(moved)
    return jnp.concatenate(terms, axis=-1)


def _columns(cube: RadianceCube, order: int) -> Float[Array, "n c"]:
    """L, then for k = 1, 2, …: L/r^k, and L q/r^(k-1) for each colour and axis; zeros up to 8s."""
    radiance = cube.radiance
    columns = [radiance]
    if order:
        inverse, plane = inverse_distances(cube)
        inverse = inverse[:, None]
        planes = (radiance[:, :, None] * plane[:, None, :]).reshape(len(radiance), 9)
        for _ in range(order):
            radiance = radiance * inverse
            columns += [radiance, planes]
            planes = planes * inverse
    missing = -sum(column.shape[1] for column in columns) % 8
    return jnp.concatenate([*columns, jnp.zeros_like(radiance, shape=(len(radiance), missing))], 1)
