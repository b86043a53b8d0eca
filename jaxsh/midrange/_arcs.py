"""Integrals of harmonics over a region of the sphere, from the great-circle arcs around it.

Derived in docs/near_light_polygons.md, whose equations (1) to (5) are named here. Exact for arcs
of any length below π: there is nothing to split.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._core.xla import materialize, on_mesh, varying_as
from ..harmonics import degrees, evaluate
from ..harmonics._tables import gradient_table
from ._vectors import cross, dot, inverse_length, reciprocal, scale

_Y0 = float(np.sqrt(1 / (4 * np.pi)))

Rows = Float[Array, "*arcs 3 n"]


class Arcs(NamedTuple):
    """The boundary of a region as n receivers see it, arc by arc, in any order.

    From `start` to `end`, vectors of any length, in the plane square to the unit vector `normal`,
    which points out of the region: the arcs go counter-clockwise around it, seen from the
    sphere's center, and clockwise around what is taken away from it. 1/r = near·ω for the light's
    or blocker's edge that lies behind ω; `near` is zero where the boundary is at rest on the
    sphere, not in space.
    """

    start: Rows
    end: Rows
    normal: Rows
    near: Rows


def edge_arcs(start: Rows, end: Rows) -> Arcs:
    """The arcs of edges: normal s×e/|s×e|, and near = f/|f|² with f the foot on the edge's line.

    Both are zero for an edge that points at the receiver or has no length.
    """
    along = end - start
    area = cross(start, along)  # not start×end: far away these are almost parallel
    inverse = inverse_length(area)
    # along × area, divided by |area|².
    squared = inverse * inverse
    near = scale(squared * dot(along, along), start) - scale(squared * dot(along, start), along)
    return Arcs(start, end, scale(inverse, area), near)


@functools.partial(jax.custom_jvp, nondiff_argnums=(3,))
def coefficients(
    start: Float[Array, "arcs 3 n"],
    end: Float[Array, "arcs 3 n"],
    normal: Float[Array, "arcs 3 n"],
    degree: int,
) -> Float[Array, "k n"]:
    """∫ y_k dω over the region within closed loops of arcs, eqs. (1) and (2).

    The derivative is eq. (5): the arcs' ends carry their points, whose speed across the arc is
    all that counts.
    """

    def add_arc(total, arc):
        flux, turn = total
        span, normal, triangle = arc
        if degree:
            nodes, weights = materialize(functools.partial(_nodes, degree), span)
            integral = materialize(_integrate_even, _basis(nodes, degree - 1), weights)
            flux = flux + normal[:, None] * integral[None]
        return (flux, _product(turn, triangle)), None

    nothing, no_turn = _nothing(start, degree**2, 3)
    spans, triangles = _spans(start, end, normal)
    (flux, turn), _ = jax.lax.scan(add_arc, (nothing, no_turn), (spans, normal, triangles))
    return _from_flux(flux, _argument(turn), degree)


@coefficients.defjvp
def _coefficients_jvp(degree, primals, tangents):
    start, end, normal = primals
    start_moves, end_moves, _ = tangents  # the normal's follows from those of the ends
    value = coefficients(start, end, normal, degree)
    return value, _rate(start, end, normal, start_moves, end_moves, degree)


def _rate(start: Rows, end: Rows, normal: Rows, start_moves: Rows, end_moves: Rows, degree: int):
    """Σ ∫ y_k v dt, eq. (5). The speed v across an arc is linear in ω, as 1/r and λ/r are."""
    along, near = end - start, edge_arcs(start, end).near
    # λ/r for the point start + λ (end - start): 0 at the start, 1/r at the end.
    end_share = scale(reciprocal(dot(along, along)), along - scale(dot(start, along), near))
    speed = scale(dot(normal, start_moves), near - end_share)
    speed = speed + scale(dot(normal, end_moves), end_share)

    @jax.checkpoint  # in reverse, evaluate an arc's basis again rather than hold those of all
    def add_arc(total, arc):
        span, speed = arc
        nodes, weights = materialize(functools.partial(_nodes, degree + 2), span)
        return total + _integrate_odd(_basis(nodes, degree), _times(weights, nodes, speed)), None

    nothing, _ = _nothing(start, (degree + 1) ** 2)
    return jax.lax.scan(add_arc, nothing, (_spans(start, end, normal)[0], speed))[0]


def coefficients_with_gradient(
    arcs: Arcs, degree: int
) -> tuple[Float[Array, "k n"], Float[Array, "3 k n"]]:
    """∫ y_k dω, and its gradient by the receiver's position, eq. (4), at the same nodes."""
    lower = degree**2
    sloped_nodes = functools.partial(_sloped_nodes, degree + 2)

    @jax.checkpoint
    def add_arc(total, arc):
        flux, pull, turn = total
        span, normal, near, triangle = arc
        nodes, weights, slopes = materialize(sloped_nodes, span, near)
        change, *integrals = materialize(_integrate_both, _basis(nodes, degree), weights, slopes)
        if degree:
            flux = flux + normal[:, None] * integrals[0][None]
        return (flux, pull + normal[:, None] * change[None], _product(turn, triangle)), None

    start, end, normal, near = arcs
    no_flux, no_turn = _nothing(start, lower, 3)
    no_pull, _ = _nothing(start, (degree + 1) ** 2, 3)
    spans, triangles = _spans(start, end, normal)
    each = spans, normal, near, triangles
    (flux, pull, turn), _ = jax.lax.scan(add_arc, (no_flux, no_pull, no_turn), each)
    return _from_flux(flux, _argument(turn), degree), -pull


Complex = tuple[Array, Array]


def _nothing(start: Rows, rows: int, *axes: int) -> tuple[Array, Complex]:
    """Zeros (*axes, rows, n), and the number 1."""
    n = start.shape[-1]
    zero, one = jnp.zeros((*axes, rows, n), start.dtype), jnp.ones(n, start.dtype)
    return varying_as((zero, (one, jnp.zeros_like(one))), start)


def _product(a: Complex, b: Complex) -> Complex:
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def _argument(turn: Complex) -> Float[Array, " n"]:
    """The solid angle, eq. (2): twice the argument of the product over all arcs.

    Multiplied first, no branch is lost while the whole is in (-2π, 2π), whatever single triangles
    are.
    """
    x, y = turn
    return 2 * jnp.arctan2(y, jnp.where((x == 0) & (y == 0), 1, x))


class _Spans(NamedTuple):
    """Arcs as their middles, the tangents there, and sine and cosine of half their angles."""

    middle: Rows
    tangent: Rows
    sine: Float[Array, "*arcs n"]
    cosine: Float[Array, "*arcs n"]


def _spans(start: Rows, end: Rows, normal: Rows) -> tuple[_Spans, Complex]:
    """Arcs by their middles, and the complex numbers of eq. (2).

    Those belong to the arcs' triangles, which have one apex, the first start.
    """
    inverse_start, inverse_end = inverse_length(start), inverse_length(end)
    a = scale(inverse_start, start)
    both = a + scale(inverse_end, end)
    inverse = inverse_length(both)
    squared = dot(both, both)  # 2 + 2 cos θ
    middle = scale(inverse, both)
    # Zero for an arc of no length: a receiver on the edge.
    cosine = jnp.where(inverse == 0, 1, squared * inverse / 2)
    area = cross(start, end - start)
    sine = dot(normal, area) * (inverse_start * inverse_end) * inverse
    apex = a[:1]
    triangles = squared / 2 + dot(apex, both), -dot(apex, area) * inverse_start * inverse_end
    return _Spans(middle, cross(normal, middle), sine, cosine), triangles


def _nodes(count: int, span: _Spans) -> tuple[Float[Array, "3 count n"], Complex]:
    """Nodes on an arc's great circle, and their weights for even and for odd integrands.

    Exact up to degree count - 1, eq. (3).
    """
    t = (np.arange(count) - (count - 1) / 2) * np.pi / count
    k = np.arange(1, count)[:, None]
    table = 4 / (count * k) * np.cos(k * t)
    middle, tangent, sine, cosine = span
    cos, sin, factors = (
        jnp.asarray(x, sine.dtype)[..., None] for x in (np.cos(t), np.sin(t), table)
    )
    sines = [jnp.zeros_like(sine), sine]  # of kθ/2
    for _ in range(2, count):
        sines.append(2 * cosine * sines[-1] - sines[-2])
    even = jnp.broadcast_to(2 * jnp.arctan2(sine, cosine)[None] / count, (count, len(sine)))
    odd = jnp.zeros_like(even)
    for k in range(2, count, 2):
        even = even + factors[k - 1] * sines[k][None]
    for k in range(1, count, 2):
        odd = odd + factors[k - 1] * sines[k][None]
    points = cos[None] * middle[:, None] + sin[None] * tangent[:, None]
    return points, (even, odd)


def _sloped_nodes(count: int, span: _Spans, slope: Float[Array, "3 n"]):
    """Place the nodes of `_nodes`, and weigh slope·ω at them too."""
    nodes, weights = _nodes(count, span)
    return nodes, weights, _times(weights, nodes, slope)


def _times(weights: Complex, nodes: Float[Array, "3 j n"], slope: Float[Array, "3 n"]) -> Complex:
    """The weights times slope·ω at each node."""
    x, y, z = nodes
    value = slope[0][None] * x + slope[1][None] * y + slope[2][None] * z
    return weights[0] * value, weights[1] * value


def _basis(nodes: Float[Array, "3 j n"], degree: int) -> Float[Array, "k j n"]:
    if on_mesh(nodes):  # receivers first, since rows of nodes and receivers would be gathered
        return jnp.swapaxes(evaluate(nodes.T, degree, axis=0), 1, 2)
    return materialize(lambda rows: evaluate(jnp.moveaxis(rows, 0, -1), degree, axis=0), nodes)


def _integrate_even(basis: Array, weights: tuple[Array, Array]) -> Float[Array, "k n"]:
    """∫ y_k dt: integrands of the parity of l."""
    return _integrate(basis, weights, 0)


def _integrate_odd(basis: Array, weights: tuple[Array, Array]) -> Float[Array, "k n"]:
    """∫ y_k (slope·ω) dt: integrands of the parity of l + 1."""
    return _integrate(basis, weights, 1)


def _integrate_both(basis: Float[Array, "k j n"], weights: Complex, slopes: Complex):
    """∫ y_k (slope·ω) dt, and ∫ y_k dt for all degrees but the last."""
    lower = (round(len(basis) ** 0.5) - 1) ** 2
    odd = _integrate_odd(basis, slopes)
    return (odd, _integrate_even(basis[:lower], weights)) if lower else (odd,)


def _integrate(basis: Array, weights: tuple[Array, Array], parity: int) -> Float[Array, "k n"]:
    l = degrees(round(len(basis) ** 0.5) - 1)
    odd = ((l + parity) % 2).astype(bool)[:, None]
    total = jnp.zeros_like(basis[:, 0])
    for j, (w_even, w_odd) in enumerate(zip(*weights, strict=True)):
        total = total + basis[:, j] * jnp.where(odd, w_odd[None], w_even[None])
    return total


def _from_flux(flux: Float[Array, "3 k n"], angle: Array, degree: int) -> Float[Array, "_ n"]:
    """c_k = -1/(l(l+1)) Σ m·∫∇y_k, where ∂(r^l y_k) is at most two harmonics of degree l-1."""
    first = angle[None] * _Y0
    if degree == 0:
        return first
    table, l = gradient_table(degree), degrees(degree)
    below = degree**2 * np.arange(3, dtype=np.int32)[:, None]  # the rows of the axes before
    rows = np.concatenate([table.first_row + below, table.second_row + below])[:, 1:]
    factors = -np.concatenate([table.first, table.second])[:, 1:] / (l * (l + 1))[1:]
    terms = flux.reshape(3 * degree**2, len(angle)).at[rows].get(mode="promise_in_bounds")
    terms = jnp.asarray(factors, angle.dtype)[..., None] * terms
    return jnp.concatenate([first, functools.reduce(jnp.add, list(terms))])
