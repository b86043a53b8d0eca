"""Coefficients of near light by an integral over the surface of emitters (Annen et al., §4.1).

c_i(p) = ∫ y_i(s/|s|) g(s) L dA,  g = -n·s/|s|³,  s = x - p: eqs. 6 to 9, with g's sign put right.
No visibility but that of a surface's own back.
"""

import functools
import math
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import (
    as_float,
    check_all,
    check_degree,
    check_size,
    check_type,
    check_vectors,
    flatten_batch,
)
from .._core.host import put
from .._core.linalg import matmul
from .._core.xla import in_turn, rows_at_once
from ..harmonics import evaluate, evaluate_with_gradient, num_coefficients
from ..sphere import fibonacci
from ._emitters import EmissiveMesh, Polygon, Sphere
from ._surfaces import Emitter, spheres, triangles


class SurfaceSamples(eqx.Module):
    """Holds n points on emitters: unit normals, areas, and the radiance on the normal's side.

    Both sides of a two-sided emitter are samples of their own.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> up = jnp.array([[0.0, 0, -1]])
    >>> midrange.SurfaceSamples(-2 * up, up, jnp.ones(1), jnp.ones((1, 3))).areas.shape
    (1,)
    """

    points: Float[Array, "n 3"] = eqx.field(converter=as_float)
    normals: Float[Array, "n 3"] = eqx.field(converter=as_float)
    areas: Float[Array, " n"] = eqx.field(converter=as_float)
    radiance: Float[Array, "n 3"] = eqx.field(converter=as_float)

    def __check_init__(self):
        n = self.areas.shape
        shapes = {name: getattr(self, name).shape for name in ("points", "normals", "radiance")}
        if len(n) != 1 or any(shape != (*n, 3) for shape in shapes.values()):
            raise ValueError(f"expected n samples, got shapes {shapes} and areas {n}")


def surface_samples(emitters: Sequence[Emitter], count: int) -> SurfaceSamples:
    """Sample emitters: `count` points on each sphere and, or a few more, on each triangle.

    On triangles by products of Gauss–Legendre nodes, m² for the least m² >= count: what is
    integrated is smooth, and the error falls exponentially in m where the point is off the
    surface. On spheres evenly. In JAX's default float. Raises `ValueError` where there is none.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> corners = jnp.array([[1.0, -1, 2], [-1, -1, 2], [-1, 1, 2], [1, 1, 2]])
    >>> light = midrange.Polygon(corners, jnp.ones(3))
    >>> samples = midrange.surface_samples([light], 4)
    >>> samples.points.shape, round(float(samples.areas.sum()), 3)
    ((8, 3), 4.0)
    """
    check_all("emitters", emitters, Polygon, Sphere, EmissiveMesh, least=0)
    m = math.isqrt(check_size("count", count) - 1) + 1
    nodes, weights = np.polynomial.legendre.leggauss(m)
    nodes, weights = (nodes + 1) / 2, weights / 2
    u, v = (axis.ravel() for axis in np.meshgrid(nodes, nodes, indexing="ij"))
    # The unit square folded onto a triangle; twice its area times u is the area's element.
    barycentric = np.stack([1 - u, u * (1 - v), u * v])
    share = 2 * u * np.multiply.outer(weights, weights).ravel()
    flat, parts = triangles(emitters), []
    for sign, light in ((1, flat.front), (-1, flat.back)):
        lit = light.any(axis=-1)
        points = np.einsum("bn,tbd->tnd", barycentric, flat.corners[lit]).reshape(-1, 3)
        areas = np.multiply.outer(flat.areas[lit], share).ravel()
        normals, light = (np.repeat(a[lit], m * m, axis=0) for a in (sign * flat.normals, light))
        parts.append((points, normals, areas, light))
    even = np.asarray(fibonacci(count).directions, np.float64)
    for center, radius, light in zip(*spheres(emitters), strict=True):
        areas = np.full(count, 4 * np.pi * radius**2 / count)
        parts.append((center + radius * even, even, areas, np.tile(light, (count, 1))))
    points, normals, areas, radiance = map(np.concatenate, zip(*parts, strict=True))
    if not len(areas):
        raise ValueError("surface_samples needs an emitter that gives light, got none")
    dtype = jnp.result_type(float)
    return SurfaceSamples(*(put(a, dtype) for a in (points, normals, areas, radiance)))


def project_surface(
    samples: SurfaceSamples, point: Float[ArrayLike, "*batch 3"], degree: int
) -> Float[Array, "*batch 3 k"]:
    """Sum coefficients Σ y_i(s/|s|) g L A over samples of emitters that nothing hides (eqs. 6, 7).

    Eq. 7 lacks a minus: n·s < 0 where the emitter faces the point; other samples give nothing.
    Returns (..., 3, K) in the samples' dtype. Differentiable in points and samples. A point on a
    sample has no coefficients. Raises `ValueError` for wrong shapes.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> corners = jnp.array([[1.0, -1, 2], [-1, -1, 2], [-1, 1, 2], [1, 1, 2]])
    >>> light = midrange.Polygon(corners, jnp.ones(3))
    >>> samples = midrange.surface_samples([light], 16)
    >>> c = midrange.project_surface(samples, jnp.zeros(3), degree=1)
    >>> c.shape, round(float(c[0, 0]), 3)
    ((3, 4), 0.227)
    """
    return _at_points(_project, samples, point, check_degree(degree))


def project_surface_with_gradient(
    samples: SurfaceSamples, point: Float[ArrayLike, "*batch 3"], degree: int
) -> tuple[Float[Array, "*batch 3 k"], Float[Array, "*batch 3 k 3"]]:
    """Sum coefficients and d/d point, -Σ (∇y g + y ∇g) L A with ∇ = d/ds (eqs. 10 to 12).

    With the sign of eq. 9 goes that of eq. 12: ∇g = -n/|s|³ + 3 s (n·s)/|s|⁵. ∇y is d/ds y(s/|s|).

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> corners = jnp.array([[1.0, -1, 2], [-1, -1, 2], [-1, 1, 2], [1, 1, 2]])
    >>> light = midrange.Polygon(corners, jnp.ones(3))
    >>> samples = midrange.surface_samples([light], 16)
    >>> c, gradient = midrange.project_surface_with_gradient(samples, jnp.zeros(3), degree=1)
    >>> c.shape, gradient.shape
    ((3, 4), (3, 4, 3))
    """
    return _at_points(_project_with_gradient, samples, point, check_degree(degree))


def _at_points(project, samples, point, degree):
    check_type("samples", samples, SurfaceSamples)
    point = as_float(point, "point")
    check_vectors("point", point)
    point = point.astype(samples.points.dtype)
    if point.ndim == 1:
        return project(samples, point, degree)
    slopes = 4 if project is _project_with_gradient else 1
    size = slopes * len(samples.areas) * num_coefficients(degree) * point.dtype.itemsize
    each = functools.partial(project, samples, degree=degree)
    rows = in_turn(each, flatten_batch(point), most=rows_at_once(size))
    return jax.tree.map(lambda a: a.reshape(*point.shape[:-1], *a.shape[1:]), rows)


@functools.partial(jax.jit, static_argnames="degree")
def _project(samples: SurfaceSamples, point: Float[Array, " 3"], degree: int):
    s = samples.points - point[None]
    light = (_geometry(samples, s) * samples.areas)[:, None] * samples.radiance
    return matmul(evaluate(s, degree, axis=0), light).T


@functools.partial(jax.jit, static_argnames="degree")
def _project_with_gradient(samples: SurfaceSamples, point: Float[Array, " 3"], degree: int):
    s = samples.points - point[None]
    basis, slope = evaluate_with_gradient(s, degree, axis=0)
    g = _geometry(samples, s)
    squared = _dot(s, s)
    cubed = squared * jnp.sqrt(squared)
    slope_of_g = -samples.normals / cubed[:, None] - 3 * s * (g / squared)[:, None]
    slope_of_g = jnp.where((g > 0)[:, None], slope_of_g, 0)
    power = samples.areas[:, None] * samples.radiance
    light = g[:, None] * power
    moved = power[:, :, None] * slope_of_g[:, None, :]
    gradient = jnp.moveaxis(matmul(slope, light[None]), 0, -1)  # K, 3 colors, 3 axes
    gradient += matmul(basis, moved.reshape(-1, 9)).reshape(-1, 3, 3)
    return matmul(basis, light).T, -jnp.moveaxis(gradient, 0, 1)


def _geometry(samples: SurfaceSamples, s: Float[Array, "n 3"]) -> Float[Array, " n"]:
    """g, the solid angle by area at each sample; zero from behind."""
    squared = _dot(s, s)
    return jnp.maximum(-_dot(samples.normals, s), 0) / (squared * jnp.sqrt(squared))


def _dot(a: Float[Array, "n 3"], b: Float[Array, "n 3"]) -> Float[Array, " n"]:
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]
