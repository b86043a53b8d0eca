"""Moments of a radiance cube, and from them its coefficients' Taylor expansion to any order.

A texel that sees a plane stands for the light c(p + d) = L dω (1 - q·d) y(ω′)(r/r′)³ of a patch of
that plane, with q = n/h (docs/near_light_cubes.md). Expanded in d/r, order k has L/r^k times
harmonics up to degree l+k, and L q/r^(k-1) times those up to l+k-1.
"""

import functools
import itertools
import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._core.checks import check_choice, check_degree, check_type, described
from .._core.host import read_only_cache
from .._core.linalg import einsum
from .._core.xla import in_turn, keep_batch, rows_at_once
from ..harmonics import degrees, num_coefficients
from ..harmonics._tables import gradient_table
from ._cube import RadianceCube, inverse_distances
from ._edges import edge_gradient, edge_table
from ._expansion import Expansion
from ._moments import moment_tables, moments

_ORDERS = range(4)
# Columns that order 3 makes of each texel, more than any other.
_COLUMNS = 40


def taylor(cube: RadianceCube, degree: int, order: int) -> Expansion:
    """Expand a cube's light around its point, to `order` 0, 1, 2 or 3 in the offset.

    Exact derivatives of Σ_t L dω (1 - n·d/h) y(ω′)(r/r′)³, what the texels' patches of surface send
    to the point p + d, visibility unchanged: the paper's open question of §8. Order 1 is
    `project_cube_with_gradient`, order 0 `project_cube`. The sum converges where |d| is below all
    r, and a texel's factor 1 - n·d/h is right up to its plane.

    **Arguments**: a `cube`, (...) points; `degree` and `order`, known at trace time.

    **Returns** an `Expansion`, terms (..., 3, K, M) in the cube's dtype, linear in the radiance,
    differentiable in radiance, distance, offset and normal. Texels at infinity, or whose plane is
    seen edge on, add to order 0 only. Raises `ValueError` for a wrong degree or order.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> corners = jnp.array([[1.0, -1, 2], [-1, -1, 2], [-1, 1, 2], [1, 1, 2]])
    >>> light = midrange.Polygon(corners, jnp.ones(3))
    >>> cube = midrange.capture(midrange.Scene([light]), jnp.zeros(3), 8, rays="analytic")
    >>> expansion = midrange.taylor(cube, degree=1, order=2)
    >>> expansion.order, expansion.terms.shape
    (2, (3, 4, 10))
    """
    check_type("cube", cube, RadianceCube)
    if not isinstance(order, int | np.integer) or isinstance(order, bool) or order not in _ORDERS:
        raise ValueError(f"order must be 0, 1, 2 or 3, got {described(order)}")
    tables = moment_tables(cube.resolution, check_degree(degree) + order, cube.radiance.dtype)
    return Expansion(cube.point, each(_terms, cube, tables, static=(degree, order)))


def project_cube(cube: RadianceCube, degree: int) -> Float[Array, "*batch 3 k"]:
    """Project a cube's radiance to coefficients ∫ L(ω) y_i(ω) dω (eq. 5): (..., 3, K).

    With exact solid angles of the texels and y at their centers: a constant cube is exact in l = 0,
    any other to the order of resolution^-1 along edges of lights. Linear and differentiable in the
    radiance. Raises `ValueError` for a wrong degree.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> corners = jnp.array([[1.0, -1, 2], [-1, -1, 2], [-1, 1, 2], [1, 1, 2]])
    >>> light = midrange.Polygon(corners, jnp.ones(3))
    >>> cube = midrange.capture(midrange.Scene([light]), jnp.zeros(3), 8, rays="analytic")
    >>> midrange.project_cube(cube, degree=1).shape
    (3, 4)
    """
    return taylor(cube, degree, 0).coefficients


@functools.partial(jax.jit, static_argnums=(0,), static_argnames="static")
def each(function: Callable[..., Array], cube: RadianceCube, tables: Any, *, static=()) -> Array:
    """`function` of each cube of a batch."""
    batch = cube.point.ndim - 1
    (rows, cubes), (constants, rest) = jax.tree.flatten(cube), jax.tree.flatten(tables)

    def run(*leaves):
        tables = jax.tree.unflatten(rest, leaves[len(rows) :])
        shape = leaves[0].shape[:batch]
        flat = [row.reshape(math.prod(shape), *row.shape[batch:]) for row in leaves[: len(rows)]]
        flat = jax.tree.unflatten(cubes, flat)
        texels, width = cube.radiance.shape[batch], cube.radiance.dtype.itemsize
        most = rows_at_once(_COLUMNS * texels * width)
        result = in_turn(lambda cube: function(cube, tables, *static), flat, most=most)
        return result.reshape(*shape, *result.shape[1:])

    ndims = (*(row.ndim - batch for row in rows), *(constant.ndim for constant in constants))
    return keep_batch(run, *rows, *constants, ndims=ndims)


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
    """L, then for k = 1, 2, …: L/r^k, and L q/r^(k-1) for each color and axis; zeros up to 8s."""
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


def monomials(order: int) -> list[tuple[int, ...]]:
    """List those of one order, as sorted axes: xx, xy, xz, yy, yz, zz are (0, 0), (0, 1), …

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> [round(float(m), 1) for m in midrange.monomials(jnp.array([1.0, 2.0, 3.0]), 1)]
    [1.0, 1.0, 2.0, 3.0]
    """
    return list(itertools.combinations_with_replacement(range(3), order))


@read_only_cache(maxsize=32)
def times_direction(degree: int) -> Float[np.ndarray, "3 k k_up"]:
    """X_d[i, j] = ∫ ω_d y_i y_j dω, i up to `degree` and j up to degree + 1."""
    table, l = gradient_table(degree + 1), degrees(degree + 1)
    axis, i = np.indices(table.first.shape)
    down = np.zeros((3, len(l), len(l)))
    # ∂_d (|x|^l y_l) = (2l + 1) · (the part of degree l-1).
    np.add.at(down, (axis, i, table.first_row), table.first / (2 * l + 1))
    np.add.at(down, (axis, i, table.second_row), table.second / (2 * l + 1))
    return (down + down.transpose(0, 2, 1))[:, : (degree + 1) ** 2]


def derivative(degree: int, homogeneity: int) -> Float[np.ndarray, "3 k k_up"]:
    """∂_d [y_i(x/|x|) |x|^homogeneity] = Σ_j D_d[i, j] y_j(x/|x|) |x|^(homogeneity - 1)."""
    l, up = degrees(degree)[:, None], degrees(degree + 1)[None]
    return times_direction(degree) * np.where(up > l, homogeneity - l, homogeneity + l + 1)


@read_only_cache(maxsize=32)
def taylor_matrices(degree: int, order: int) -> Float[np.ndarray, "m k k_up"]:
    """The terms of one order of y_i(s/|s|)/|s|³ at s = ω - δ: Σ_α δ^α Σ_j T_α[i, j] y_j(ω).

    For each monomial α of δ, T_α = (-1)^|α| ∂^α / α!, of degree `degree` + `order`.
    """
    result = []
    for axes in monomials(order):
        matrix = np.eye((degree + 1) ** 2)
        for k, axis in enumerate(axes):
            matrix = -matrix @ derivative(degree + k, -3 - k)[axis]
        result.append(matrix / math.prod(math.factorial(axes.count(axis)) for axis in range(3)))
    return np.stack(result)


def project_cube_with_gradient(
    cube: RadianceCube, degree: int, *, gradient: str = "edges"
) -> tuple[Float[Array, "*batch 3 k"], Float[Array, "*batch 3 k 3"]]:
    """Project a cube to coefficients (..., 3, K) and their gradient d/d point, (..., 3, K, 3).

    With ω a texel's direction, dω its solid angle, t the tangential gradient of y at ω:

    - `"edges"`: ∇c = Σ_e (L_b - L_a) y ν (1/r)_near over the edges between texels, which is the
      moving boundary and nothing else: right under occlusion too, the same where nothing is hidden.
    - `"surface"`: ∇c = Σ L dω [(3ωy - t)/r - y n/h], eqs. 11 to 13 of Annen et al. 2004 with their
      signs put right, and 1/r, not the 1/r² of §4.2. What is visible is taken not to change (eq. 8
      leaves out the moving boundary): right for each light by itself, wrong, at any resolution,
      where a surface hides part of a light or one light part of another. Of 24 lights so hidden
      at 64² and degree 4 (tests/midrange/test_edges.py) its median error is 65 % of the gradient;
      that of `"edges"` is 2.5 %.

    Linear in the radiance; differentiable in all of the cube, in `"edges"` with kinks where the
    nearer of two surfaces changes. Zero from texels at infinity, and from planes seen edge on.
    Raises `ValueError` for a wrong degree or an unknown `gradient`.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> corners = jnp.array([[1.0, -1, 2], [-1, -1, 2], [-1, 1, 2], [1, 1, 2]])
    >>> light = midrange.Polygon(corners, jnp.ones(3))
    >>> cube = midrange.capture(midrange.Scene([light]), jnp.zeros(3), 8, rays="analytic")
    >>> c, gradient = midrange.project_cube_with_gradient(cube, degree=1)
    >>> c.shape, gradient.shape
    ((3, 4), (3, 4, 3))
    """
    check_type("cube", cube, RadianceCube)
    check_choice("gradient", gradient, ("surface", "edges"))
    if gradient == "surface":
        expansion = taylor(cube, degree, 1)
        return expansion.coefficients, expansion.gradient
    table = edge_table(cube.resolution, check_degree(degree), cube.radiance.dtype)
    return project_cube(cube, degree), each(edge_gradient, cube, table)
