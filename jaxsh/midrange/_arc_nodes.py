"""Quadrature of harmonics along one great-circle arc, seen by many receivers.

Equation (3) of docs/near_light_polygons.md.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._core.xla import materialize, on_mesh
from ..harmonics import degrees, evaluate

Rows = Float[Array, "*arcs 3 n"]
Pair = tuple[Array, Array]  # of a complex number, or of weights for even and odd integrands


class Spans(NamedTuple):
    """Arcs as their middles, the tangents there, and sine and cosine of half their angles."""

    middle: Rows
    tangent: Rows
    sine: Float[Array, "*arcs n"]
    cosine: Float[Array, "*arcs n"]


def nodes_of(count: int, span: Spans) -> tuple[Float[Array, "3 count n"], Pair]:
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


def sloped_nodes_of(count: int, span: Spans, slope: Float[Array, "3 n"]):
    """Place the nodes of `nodes_of`, and weigh slope·ω at them too."""
    nodes, weights = nodes_of(count, span)
    return nodes, weights, times(weights, nodes, slope)


def times(weights: Pair, nodes: Float[Array, "3 j n"], slope: Float[Array, "3 n"]) -> Pair:
    """The weights times slope·ω at each node."""
    x, y, z = nodes
    value = slope[0][None] * x + slope[1][None] * y + slope[2][None] * z
    return weights[0] * value, weights[1] * value


def basis_at(nodes: Float[Array, "3 j n"], degree: int) -> Float[Array, "k j n"]:
    if on_mesh(nodes):  # receivers first, since rows of nodes and receivers would be gathered
        return jnp.swapaxes(evaluate(nodes.T, degree, axis=0), 1, 2)
    return materialize(lambda rows: evaluate(jnp.moveaxis(rows, 0, -1), degree, axis=0), nodes)


def integrate_even(basis: Array, weights: Pair) -> Float[Array, "k n"]:
    """∫ y_k dt: integrands of the parity of l."""
    return _integrate(basis, weights, 0)


def integrate_odd(basis: Array, weights: Pair) -> Float[Array, "k n"]:
    """∫ y_k (slope·ω) dt: integrands of the parity of l + 1."""
    return _integrate(basis, weights, 1)


def integrate_both(basis: Float[Array, "k j n"], weights: Pair, slopes: Pair):
    """∫ y_k (slope·ω) dt, and ∫ y_k dt for all degrees but the last."""
    lower = (round(len(basis) ** 0.5) - 1) ** 2
    odd = integrate_odd(basis, slopes)
    return (odd, integrate_even(basis[:lower], weights)) if lower else (odd,)


def _integrate(basis: Array, weights: Pair, parity: int) -> Float[Array, "k n"]:
    l = degrees(round(len(basis) ** 0.5) - 1)
    odd = ((l + parity) % 2).astype(bool)[:, None]
    total = jnp.zeros_like(basis[:, 0])
    for j, (w_even, w_odd) in enumerate(zip(*weights, strict=True)):
        total = total + basis[:, j] * jnp.where(odd, w_odd[None], w_even[None])
    return total
