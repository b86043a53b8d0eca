"""Integrals of harmonics over a region of the sphere, from the great-circle arcs around it.

Derived in docs/near_light_polygons.md, whose equations (1) to (6) are named here. Exact for arcs
of any length below π: there is nothing to split.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .._core.xla import as_one, materialize, on_mesh, rows_at_once, varying_as
from ..harmonics import degrees
from ..harmonics._tables import gradient_table
from ._arc_integrals import arc_integrals, sloped_arc_integrals
from ._arc_nodes import Pair, Rows, Spans, basis_at, integrate_odd, nodes_of, times
from ._vectors import (
    close_cross,
    cross,
    cross_high,
    difference,
    dot,
    inverse_length,
    reciprocal,
    scale,
    select,
)

_Y0 = float(np.sqrt(1 / (4 * np.pi)))
# Arcs that the CPU takes at once: those of a quadrilateral.
_GROUP = 4

Vectors = Float[Array, "*_ 3 _"]  # of any shapes that broadcast


class Arcs(NamedTuple):
    """The boundary of a region as n receivers see it, arc by arc, in any order.

    From `start` to `end`, vectors of any length, counter-clockwise around the unit vector
    `normal`. That points out of the region; around what is taken away from it the arcs run the
    other way, and it points in. 1/r = line·ω for the line in space on which both ends lie, and
    `near` is `line` where that is an edge of the light or of a blocker, and zero where the
    boundary is at rest on the sphere.
    """

    start: Rows
    end: Rows
    normal: Rows
    line: Rows
    near: Rows


def edge_arcs(first: Vectors, second: Vectors, point: Vectors) -> Arcs:
    """The arcs of edges from s to e, seen from the receiver: normal s×e/|s×e|, line f/|f|².

    f is the foot of the receiver on the edge's line. Both are zero for an edge that points at the
    receiver or has no length. In float32 they are right to rounding down to |f| = 1e-4 of the
    distance of the corners: what the differences leave counts, since s and e are almost parallel
    there.
    """
    # Stored, since each component of what follows takes all of it.
    start, end, along, area = materialize(_between, first, second, point)
    normal, line = _line(along, area)
    return Arcs(start, end, normal, line, line)


def _between(first: Vectors, second: Vectors, point: Vectors) -> tuple[Vectors, ...]:
    """s, e, e - s and s × e."""
    (start, rest), (end, _), (along, left) = (
        difference(a, b) for a, b in ((first, point), (second, point), (second, first))
    )
    if start.dtype != jnp.float32:
        return start, end, along, cross(start, along)
    high, low = cross_high(start, along)
    return start, end, along, high + (low + cross(rest, along) + cross(start, left))


def resting_arcs(start: Rows, end: Rows, normal: Rows) -> Arcs:
    """Arcs at rest on the sphere, in the plane of a normal."""
    along = end - start
    _, line = _line(along, close_cross(start, along))
    return Arcs(start, end, normal, line, jnp.zeros_like(line))


def _line(along: Vectors, area: Vectors) -> tuple[Vectors, Vectors]:
    """Compute a line's area/|area| and along × area/|area|²."""
    inverse = inverse_length(area)
    normal = scale(inverse, area)
    return normal, scale(inverse, cross(along, normal))


@functools.partial(jax.custom_jvp, nondiff_argnums=(3,))
def coefficients(
    arcs: Arcs, apex: Float[Array, "3 n"], active: Bool[Array, " arcs"] | None, degree: int
) -> Float[Array, "k n"]:
    """∫ y_k dω over the region within closed loops of arcs, eqs. (1) and (2).

    `apex` is a direction no further than π/2 from all of the region. Arcs that are not `active`
    have no length for any receiver.

    The derivative is eq. (6): the arcs' ends carry their points, whose speed across the arc is
    all that counts.
    """

    def add_arcs(total, some):
        flux, angle = total
        span, normal, triangle = some
        if degree:
            integral = as_one(functools.partial(arc_integrals, degree=degree - 1), span)
            flux = flux + materialize(_outer_sum, normal, integral)
        return flux, angle + _sum_over(0, _angle(triangle))

    spans, triangles = materialize(_spans_and_triangles, arcs, apex)
    nothing = _nothing(arcs.start, 3, degree**2), _nothing(arcs.start)
    each = spans, arcs.normal, triangles
    flux, angle = _sum(add_arcs, nothing, each, active, degree, _GROUP)
    return materialize(functools.partial(_from_flux, degree=degree), flux, angle)


@coefficients.defjvp
def _coefficients_jvp(degree, primals, tangents):
    arcs, apex, active = primals
    moves, _, _ = tangents  # the normal's follows from those of the ends, and no apex counts
    return coefficients(arcs, apex, active, degree), _rate(arcs, moves, active, degree)


def _rate(arcs: Arcs, moves: Arcs, active: Array | None, degree: int):
    """Σ ∫ y_k v dt, eq. (6). The speed v across an arc is linear in ω, as 1/r and λ/r are."""
    start, end, normal, line, _ = arcs
    along = end - start
    # λ/r for the point start + λ (end - start): 0 at the start, 1/r at the end.
    end_share = scale(reciprocal(dot(along, along)), along - scale(dot(start, along), line))
    speed = scale(dot(normal, moves.start), line - end_share)
    speed = speed + scale(dot(normal, moves.end), end_share)

    @jax.checkpoint  # in reverse, evaluate an arc's basis again rather than hold those of all
    def add_arc(total, arc):
        span, speed = arc
        nodes, weights = materialize(functools.partial(nodes_of, degree + 2), span)
        return total + integrate_odd(basis_at(nodes, degree), times(weights, nodes, speed))

    nothing = _nothing(start, (degree + 1) ** 2)
    return _sum(add_arc, nothing, (_spans(arcs), speed), active, degree)


def coefficients_with_gradient(
    arcs: Arcs, apex: Float[Array, "3 n"], active: Bool[Array, " arcs"] | None, degree: int
) -> tuple[Float[Array, "k n"], Float[Array, "k 3 n"]]:
    """∫ y_k dω, and its gradient by the receiver's position, eq. (4), at the same nodes."""

    def outer(normal, change, *integrals):
        return _pull(normal, change), *(_outer_sum(normal, row) for row in integrals)

    @jax.checkpoint
    def add_arcs(total, some):
        pull, *flux, angle = total
        span, normal, near, triangle = some
        integrals = as_one(functools.partial(sloped_arc_integrals, degree=degree), span, near)
        sums = materialize(outer, normal, *integrals)
        added = (a + b for a, b in zip((pull, *flux), sums, strict=True))
        return *added, angle + _sum_over(0, _angle(triangle))

    lower = [(3, degree**2)] if degree else []
    nothing = tuple(_nothing(arcs.start, *shape) for shape in (((degree + 1) ** 2, 3), *lower, ()))
    spans, triangles = materialize(_spans_and_triangles, arcs, apex)
    each = spans, arcs.normal, arcs.near, triangles
    pull, *flux, angle = _sum(add_arcs, nothing, each, active, degree, _GROUP)
    light = materialize(functools.partial(_from_flux, degree=degree), *flux, angle)
    return light, pull


def _pull(normal: Rows, change: Float[Array, "k a n"]) -> Float[Array, "k 3 n"]:
    """-Σ normal ∫ over the arcs, as a gradient is given: the axis last."""
    normal, change = -jnp.moveaxis(normal, 0, 1)[None], change[:, None]
    return _sum_over(2, normal, change)


def _outer_sum(normal: Rows, integrals: Float[Array, "k a n"]) -> Float[Array, "3 k n"]:
    """Σ normal ∫ over the arcs."""
    return _sum_over(2, jnp.moveaxis(normal, 0, 1)[:, None], integrals[None])


def _sum_over(axis: int, *factors: Array) -> Array:
    """Sum products over arcs: written out for few, where XLA's sum is slow on the CPU."""
    count = factors[0].shape[axis]
    if count > _GROUP:
        return jnp.sum(functools.reduce(jnp.multiply, factors), axis=axis)
    rows = [
        [jax.lax.index_in_dim(f, a, axis, keepdims=False) for f in factors] for a in range(count)
    ]
    return functools.reduce(jnp.add, [functools.reduce(jnp.multiply, row) for row in rows])


def pair_bytes(degree: int, dtype) -> int:
    """Bytes of the basis at the nodes of one arc, seen by one receiver."""
    return (degree + 2) * (degree + 1) ** 2 * jnp.dtype(dtype).itemsize


def group_bytes(degree: int, dtype) -> int:
    """Bytes of the rows at the nodes of the arcs that the CPU takes at once, for one receiver."""
    rows = 2 * degree + 1 + (degree + 1) ** 2  # azimuth rows, and zenith rows with two weights
    return _GROUP * (degree + 1) * rows * jnp.dtype(dtype).itemsize


def _sum(add, total, arcs, active: Bool[Array, " arcs"] | None, degree: int, group: int = 0):
    """Add up arcs: `add(total, arc)` of zeros and one arc after the other.

    With `group`, `add` takes several at once, that many of them on the CPU. There those that no
    receiver has are left out. An accelerator takes as many at once as its memory allows, and all
    that are given.
    """
    once = jax.jit(add)  # traced once for all ways
    count = len(jax.tree.leaves(arcs)[0])

    def in_turn(total, arcs, active):
        if group:
            # Where arcs are left out, one by one.
            groups = -(-count // group) if active is None else count
            size = -(-count // groups)
            arcs = jax.tree.map(lambda a: _fill(a, groups * size), arcs)
            arcs = jax.tree.map(lambda a: a.reshape(groups, size, *a.shape[1:]), arcs)
            if groups == 1:
                return once(total, jax.tree.map(lambda a: a[0], arcs))

        def add(total, some):
            arcs, used = some
            if used is None:
                return once(total, arcs), None
            return jax.lax.cond(used, once, lambda total, _: total, total, arcs), None

        return jax.lax.scan(add, total, (arcs, active))[0]

    def together(total, arcs, _):
        like = jax.tree.leaves(total)[0]
        size = min(count, rows_at_once(pair_bytes(degree, like.dtype) * like.shape[-1]))

        def add(sums, some):
            if group:
                return once(sums, some), None
            parts = jax.vmap(functools.partial(once, total))(some)
            return jax.tree.map(lambda a, b: a + jnp.sum(b, axis=0), sums, parts), None

        whole = count // size * size
        first, rest = (
            jax.tree.map(lambda a, at=at: a[at], arcs) for at in (np.s_[:whole], np.s_[whole:])
        )
        if whole > size:
            groups = jax.tree.map(lambda a: a.reshape(-1, size, *a.shape[1:]), first)
            sums, _ = jax.lax.scan(add, total, groups)
        else:
            sums, _ = add(total, first)
        return add(sums, rest)[0] if whole < count else sums

    if on_mesh(arcs):
        return in_turn(total, arcs, None)
    return jax.lax.platform_dependent(total, arcs, active, cpu=in_turn, default=together)


def _fill(rows: Float[Array, "..."], count: int) -> Array:
    """Add arcs of zeros, which have no length."""
    return jnp.pad(rows, [(0, count - len(rows))] + [(0, 0)] * (rows.ndim - 1))


def _nothing(start: Rows, *shape: int) -> Array:
    """Zeros (*shape, n)."""
    return varying_as(jnp.zeros((*shape, start.shape[-1]), start.dtype), start)


def _angle(triangle: Pair) -> Float[Array, "a n"]:
    """The solid angles of arcs' triangles, in [-π, π] as no corner is beyond π/2 of the apex."""
    x, y = triangle  # both zero for a receiver on the edge
    return 2 * jnp.arctan2(y, jnp.where((x == 0) & (y == 0), 1, x))


def _spans_and_triangles(arcs: Arcs, apex: Float[Array, "3 n"]) -> tuple[Spans, Pair]:
    """Arcs by their middles, and the complex numbers of eq. (2) of their triangles (apex, a, b)."""
    spans, apex = _spans(arcs), apex[None]
    real = dot(apex, spans.middle) + spans.cosine
    return spans, (real, -dot(apex, arcs.normal) * spans.sine)


def _spans(arcs: Arcs) -> Spans:
    """Arcs by their middles.

    A middle is along a + b for arcs below π/2; above, b - a along the tangent has the digits.
    """
    start, end, normal = arcs.start, arcs.end, arcs.normal
    both, chord, inverse_start, inverse_end = materialize(_both_and_chord, start, end)
    closed, opened = dot(both, both), dot(chord, chord)  # 2 ± 2 cos θ
    wide = opened > closed
    inverse = inverse_length(select(wide, chord, both))
    larger = jnp.where(wide, opened, closed) * inverse / 2
    nearer = select(inverse_start > inverse_end, start, end)
    area = dot(normal, cross(nearer, end - start)) * (inverse_start * inverse_end)
    smaller = jnp.abs(area) * inverse  # sin θ/2, of the other, divided by the larger
    axis = scale(inverse, select(wide, chord, both))
    # Both ends at the receiver: any axis will do for an arc of no length, but the basis wants one.
    axis = axis + (inverse == 0).astype(axis.dtype)[..., None, :]
    aside = cross(normal, axis)
    turned = wide & (dot(normal, normal) > 0)  # no normal: a receiver on the edge
    middle, tangent = select(turned, -aside, axis), select(turned, axis, aside)
    sine = jnp.where(wide, larger, smaller)
    # Zero for an arc of no length: a receiver on the edge.
    cosine = jnp.where(inverse == 0, 1, jnp.where(wide, smaller, larger))
    return Spans(middle, tangent, sine, cosine)


def _both_and_chord(start: Rows, end: Rows) -> tuple[Rows, Rows, Array, Array]:
    """a + b and b - a of unit vectors, and what the lengths of both were."""
    inverse_start, inverse_end = inverse_length(start), inverse_length(end)
    a, b = scale(inverse_start, start), scale(inverse_end, end)
    return a + b, b - a, inverse_start, inverse_end


def _from_flux(*flux_and_angle: Array, degree: int) -> Float[Array, "_ n"]:
    """c_k = -1/(l(l+1)) Σ m·∫∇y_k, where ∂(r^l y_k) is at most two harmonics of degree l-1."""
    *flux, angle = flux_and_angle
    first = angle[None] * _Y0
    if degree == 0:
        return first
    table, l = gradient_table(degree), degrees(degree)
    below = degree**2 * np.arange(3, dtype=np.int32)[:, None]  # the rows of the axes before
    rows = np.concatenate([table.first_row + below, table.second_row + below])[:, 1:]
    factors = -np.concatenate([table.first, table.second])[:, 1:] / (l * (l + 1))[1:]
    terms = flux[0].reshape(3 * degree**2, len(angle)).at[rows].get(mode="promise_in_bounds")
    terms = jnp.asarray(factors, angle.dtype)[..., None] * terms
    return jnp.concatenate([first, functools.reduce(jnp.add, list(terms))])
