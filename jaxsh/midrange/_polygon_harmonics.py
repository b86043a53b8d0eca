"""Coefficients of the light of a polygon, exact, and their gradient."""

import functools
import math
import warnings
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import (
    align,
    as_finite,
    check_all,
    check_batches,
    check_degree,
    check_type,
    check_vectors,
)
from .._core.known import is_concrete
from .._core.xla import as_one, in_blocks, rows_at_once
from ._arcs import group_bytes, pair_bytes
from ._emitters import Polygon, is_convex, unit_normal
from ._vectors import inverse_power
from ._visible import Plan, Scene, seen

# Bytes of what is made on the way for one block of receivers.
_CACHE = 700_000
# With more arcs than twice as many there are fewer receivers to a block, in proportion.
_ARCS = 128


def polygon_harmonics(
    polygon: Polygon,
    point: Float[ArrayLike, "*batch 3"],
    degree: int,
    *,
    horizon: Float[ArrayLike, "*normals 3"] | None = None,
    blockers: Sequence[Polygon] = (),
) -> Float[Array, "*out 3 k"]:
    """Compute the coefficients ∫ L y_i dω of a polygon's light at a point, exactly.

    The integral over the polygon becomes one over the great-circle arcs of its boundary, exact
    for every degree and for arcs of every length (docs/near_light_polygons.md). Exact for what
    Annen et al. 2004 sample in eq. 5; the boundary form is not theirs.

    **Arguments**

    - `polygon`: concave or convex. From behind a one-sided polygon there is no light; where all
      values are known and all points are behind, that is said by a warning.
    - `point`: (..., 3), the receivers. Pass all of them rather than use `jax.vmap`.
    - `degree`: the largest l, known at trace time.
    - `horizon`: unit normals (..., 3) of the receivers: only the part of the polygon above the
      plane through the point counts.
    - `blockers`: convex polygons, opaque from both sides, whose shadow is taken away. Only what
      lies in front of the polygon's plane casts one. Any number may overlap: the union counts
      once. The cost grows with the square of their number, and the first call with none.

    **Returns** (..., 3, K) in the dtype of `point`, for which vertices and radiance are cast; the
    batches of `point` and `horizon` broadcast. Relative rounding error about ε/angle where the
    polygon is seen under a small angle (in radians). Right beside a lamp, down to 1e-6 of its
    size from plane, edge and corner, float32 is within 1e-5 of float64, and the gradient within
    5e-5 of its largest component (degrees 1 to 8). Any unit of length will do.

    Differentiable in vertices, radiance, point, horizon and blockers, forward and reverse. Zero
    with zero slope at points in the polygon's plane. At a point on an edge or vertex it is finite,
    but the light has no limit there; the slope grows as 1/distance towards it.

    Receivers may be shared out between devices; corners and blockers are held by each.

    Raises `ValueError` for shapes that do not fit and, where values are known, for blockers that
    are not convex and for points and normals that are not finite.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> corners = jnp.array([[1.0, -1, 2], [-1, -1, 2], [-1, 1, 2], [1, 1, 2]])
    >>> light = midrange.Polygon(corners, jnp.ones(3))
    >>> c = midrange.polygon_harmonics(light, jnp.zeros(3), degree=1)
    >>> c.shape, round(float(c[0, 0]), 3)
    ((3, 4), 0.227)
    """
    return _light(polygon, point, degree, horizon, blockers, False)[0]


def polygon_harmonics_with_gradient(
    polygon: Polygon,
    point: Float[ArrayLike, "*batch 3"],
    degree: int,
    *,
    horizon: Float[ArrayLike, "*normals 3"] | None = None,
    blockers: Sequence[Polygon] = (),
) -> tuple[Float[Array, "*out 3 k"], Float[Array, "*out 3 k 3"]]:
    """Compute the coefficients of `polygon_harmonics` and their gradient d/d point, together.

    ∇c_i = -L Σ ∫ y_i m (1/r) dt over the boundary of what is seen, where r is the distance of the
    edge that bounds it, the polygon's or a blocker's; so, unlike eq. 8 of Annen et al. 2004, it
    has the motion of shadows in it. `horizon` is held fixed while the point moves.

    **Returns** (..., 3, K) and (..., 3, K, 3). All else as for `polygon_harmonics`.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> corners = jnp.array([[1.0, -1, 2], [-1, -1, 2], [-1, 1, 2], [1, 1, 2]])
    >>> light = midrange.Polygon(corners, jnp.ones(3))
    >>> c, gradient = midrange.polygon_harmonics_with_gradient(light, jnp.zeros((5, 3)), degree=1)
    >>> c.shape, gradient.shape
    ((5, 3, 4), (5, 3, 4, 3))
    """
    return _light(polygon, point, degree, horizon, blockers, True)


def _light(polygon, point, degree, horizon, blockers, gradient: bool):
    check_type("polygon", polygon, Polygon)
    check_all("blockers", blockers, Polygon, least=0)
    point = as_finite(point, "point")
    normals = jnp.zeros(3, point.dtype) if horizon is None else as_finite(horizon, "horizon")
    check_vectors("point", point)
    check_vectors("horizon", normals)
    check_batches(point=point.shape, horizon=normals.shape)
    for blocker in blockers:
        if is_concrete(blocker.vertices) and not is_convex(np.asarray(blocker.vertices)):
            raise ValueError("a blocker must be convex, got a concave one: split it")
    _check_side(polygon, point)
    clipped = horizon is not None or len(blockers) > 0
    convex = is_concrete(polygon.vertices) and is_convex(np.asarray(polygon.vertices))
    dtype = point.dtype
    scene = Scene(polygon.vertices.astype(dtype), _plane(polygon, dtype), _corners(blockers, dtype))
    plan = Plan(
        check_degree(degree),
        gradient,
        polygon.two_sided,
        horizon=horizon is not None,
        triangles=clipped and not convex,
        in_front=not polygon.two_sided and _all_in_front(polygon, blockers),
    )
    return _compiled(scene, point, normals.astype(dtype), polygon.radiance.astype(dtype), plan)


def _check_side(polygon: Polygon, point: Float[Array, "*batch 3"]) -> None:
    """Warn where values are known, and all points are behind a polygon that is dark from there."""
    if polygon.two_sided or not (is_concrete(polygon.vertices) and is_concrete(point)):
        return
    if point.size == 0 or not point.is_fully_addressable:
        return
    vertices = np.asarray(polygon.vertices, np.float64)
    normal = unit_normal(vertices)
    height = np.asarray(point) @ normal.astype(point.dtype) - vertices[0] @ normal
    if (height < 0).all():
        warnings.warn(
            f"none of the {height.size} points is before the polygon, which is dark from behind: "
            "reverse the order of its corners, or make it two_sided",
            stacklevel=4,
        )


def _plane(polygon: Polygon, dtype) -> Float[Array, "2 3"]:
    """The unit normal, rounded, and the rest of it: which side a point near the plane is on."""
    if is_concrete(polygon.vertices):
        normal = unit_normal(np.asarray(polygon.vertices).astype(dtype))
        rounded = normal.astype(dtype)
        return jnp.asarray(np.stack([rounded, (normal - rounded).astype(dtype)]))
    vertices = jax.lax.stop_gradient(polygon.vertices).astype(dtype)
    spokes = (vertices - vertices[:1]) * _inverse_size(vertices)
    area = jnp.cross(spokes, jnp.roll(spokes, -1, axis=0)).sum(axis=0)
    size = jnp.linalg.norm(area)
    normal = area / jnp.where(size > 0, size, 1)
    return jnp.stack([normal, jnp.zeros_like(normal)])


def _corners(blockers: Sequence[Polygon], dtype) -> Float[Array, "b m 3"]:
    """The corners of all, as many for each: the last is repeated."""
    most = max((len(blocker.vertices) for blocker in blockers), default=0)
    rows = []
    for blocker in blockers:
        corners = blocker.vertices.astype(dtype)
        last = jnp.broadcast_to(corners[-1:], (most - len(corners), 3))
        rows.append(jnp.concatenate([corners, last]))
    return jnp.stack(rows) if rows else jnp.zeros((0, 0, 3), dtype)


def _all_in_front(polygon: Polygon, blockers: Sequence[Polygon]) -> bool:
    """Tell if values are known, and all of the blockers is on the light's side of its plane."""
    if not all(is_concrete(shape.vertices) for shape in (polygon, *blockers)):
        return False
    vertices = np.asarray(polygon.vertices, np.float64)
    normal = unit_normal(vertices)
    sides = [(np.asarray(b.vertices, np.float64) - vertices[0]) @ normal for b in blockers]
    return all((side >= 0).all() and (side > 0).any() for side in sides)


@functools.partial(jax.jit, static_argnums=4)
def _compiled(scene: Scene, point, normals, radiance, plan: Plan):
    batch = np.broadcast_shapes(point.shape[:-1], normals.shape[:-1])
    # The solid angle has no unit of length: in one of about the light's size no square overflows.
    inverse = _inverse_size(scene.vertices)
    point = point * inverse
    scene = scene._replace(vertices=scene.vertices * inverse, blockers=scene.blockers * inverse)
    rows = [
        jnp.broadcast_to(align(a, jnp.zeros((*batch, 1)))[0], (*batch, a.shape[-1])).reshape(
            math.prod(batch), a.shape[-1]
        )
        for a in (point, normals)
    ]
    light, *slopes = _unit_lights(scene, rows[0], rows[1], plan)
    lights = [light, *(slope * inverse for slope in slopes)]
    values = []
    count = (plan.degree + 1) ** 2
    for light, shape in zip(lights, ((count,), (count, 3)), strict=False):
        light = light.reshape(*batch, 1, *shape)
        color = radiance.reshape(3, *(1,) * len(shape))
        values.append(jnp.multiply(*align(color, light)))
    return tuple(values)


def _inverse_size(vertices: Float[Array, "n 3"]) -> Float[Array, ""]:
    return inverse_power(jnp.max(jnp.abs(vertices - vertices[:1])))


def _unit_lights(scene: Scene, points, normals, plan: Plan):
    """(N, K), and (N, 3K) with the gradient, of radiance 1 at N points, block by block."""

    def block(points, normals):
        lights = as_one(functools.partial(seen, plan), scene, points.T, normals.T)
        rows = (light.reshape(math.prod(light.shape[:-1]), light.shape[-1]).T for light in lights)
        return tuple(rows)

    corners, (count, most) = len(scene.vertices), scene.blockers.shape[:2]
    loops, length = (corners - 2, 3) if plan.triangles else (1, corners)
    arcs = loops * (length + plan.horizon) * (count + 1)
    arcs += loops * count * (most + (not plan.in_front)) * (count + 1 if count > 1 else 1)
    fewer = max(1, arcs // _ARCS)
    most = rows_at_once(fewer * pair_bytes(plan.degree, points.dtype))
    size = max(1, _block(plan.degree, points.dtype) // fewer)
    return in_blocks(block, points, normals, size=size, most=most)


def _block(degree: int, dtype) -> int:
    """Receivers per block, so that what is made of the arcs taken at once stays in cache."""
    return min(512, max(32, _CACHE // group_bytes(degree, dtype)) // 16 * 16)
