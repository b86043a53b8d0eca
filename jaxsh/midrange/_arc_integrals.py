"""Integrals of harmonics along great-circle arcs, seen by many receivers, without derivatives.

Equations (3) and (5) of docs/near_light_polygons.md. At a node a harmonic is a product of two
rows, an azimuth row of x and y and a zenith row of z alone, and only the latter takes the weight.
So few rows are made, each of them by all arcs and receivers, and an integral over n nodes is n
products of two of them.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._core.host import read_only_cache
from .._core.xla import as_one, in_turn, materialize
from ..harmonics import degrees, orders
from ..harmonics._tables import zenith_table
from ._arc_nodes import Spans, basis_at, integrate_both, sloped_nodes_of
from ._vectors import dot

Nodes = Float[Array, "j a n"]


class _Products(NamedTuple):
    """Name the zenith rows, and the two rows whose product each harmonic is."""

    rows: Int[np.ndarray, " rows"]  # those of the harmonics with m >= 0, by their index
    zenith: Int[np.ndarray, " k"]
    azimuth: Int[np.ndarray, " k"]


@read_only_cache(maxsize=None)
def _products(degree: int) -> _Products:
    l, m = degrees(degree), orders(degree)
    rows = np.flatnonzero(m >= 0)
    place = np.zeros(len(m), np.int32)
    place[rows] = np.arange(len(rows))
    zenith = place[(l * (l + 1) + abs(m)).astype(np.int32)]
    azimuth = 2 * abs(m) - (m > 0)  # 1, then the cosine's and the sine's row of each m
    return _Products(rows.astype(np.int32), zenith, azimuth.astype(np.int32))


def arc_integrals(span: Spans, degree: int) -> Float[Array, "k a n"]:
    """∫ y_k dt along arcs, eq. (3)."""
    count = degree + 1
    sines = materialize(functools.partial(_sines, count), span.sine, span.cosine)
    x, y, z = materialize(functools.partial(_nodes, count), span)
    weights = materialize(functools.partial(_weights, count), sines)
    azimuth = materialize(functools.partial(_azimuth, degree), x, y)
    return _integrate(azimuth, z, weights, degree)


@functools.partial(jax.custom_jvp, nondiff_argnums=(2,))
def sloped_arc_integrals(
    span: Spans, slope: Float[Array, "a 3 n"], degree: int
) -> tuple[Float[Array, "k a n"], ...]:
    """∫ y_k (slope·ω) dt, eq. (5), and ∫ y_k dt for all degrees but the last."""

    def prepared(span, slope):
        count = degree + 1
        sines = materialize(functools.partial(_sines, count), span.sine, span.cosine)
        weights = functools.partial(_weights, count), functools.partial(_sloped_weights, count)
        return (
            materialize(functools.partial(_nodes, count), span),
            materialize(weights[0], sines),
            materialize(weights[1], span, slope, sines),
        )

    (x, y, z), weights, sloped = as_one(prepared, span, slope)
    azimuth = materialize(functools.partial(_azimuth, degree), x, y)
    pull = _integrate(azimuth, z, sloped, degree)
    return (pull, _integrate(azimuth, z, weights, degree - 1)) if degree else (pull,)


@sloped_arc_integrals.defjvp
def _sloped_arc_integrals_jvp(degree, primals, tangents):
    """By way of the basis, whose derivatives are right to every order."""

    def one_arc(arc):
        nodes, weights, slopes = materialize(functools.partial(sloped_nodes_of, degree + 2), *arc)
        return integrate_both(basis_at(nodes, degree), weights, slopes)

    def slowly(span, slope):
        rows = in_turn(one_arc, (span, slope))
        return tuple(jnp.swapaxes(row, 0, 1) for row in rows)

    return sloped_arc_integrals(*primals, degree), jax.jvp(slowly, primals, tangents)[1]


def _sines(count: int, sine: Float[Array, "a n"], cosine: Float[Array, "a n"]):
    """∫ cos kt dt over an arc, (2/k) sin(kθ/2), for k up to count, and θ for k = 0."""
    rows = [jnp.zeros_like(sine), sine]  # sin(kθ/2)
    for _ in range(1, count):
        rows.append(2 * cosine * rows[-1] - rows[-2])
    scaled = (row * (2 / k) for k, row in enumerate(rows[1:], 1))
    return jnp.stack([2 * jnp.arctan2(sine, cosine), *scaled])


def _nodes(count: int, span: Spans) -> list[Nodes]:
    """x, y and z."""
    t = _angles(count)
    cos, sin = (jnp.asarray(f(t), span.sine.dtype)[:, None, None] for f in (np.cos, np.sin))
    middle, tangent = (jnp.moveaxis(row, -2, 0)[:, None] for row in (span.middle, span.tangent))
    return [cos * middle[i] + sin * tangent[i] for i in range(3)]


def _weights(count: int, sines: Float[Array, "k a n"]) -> Float[Array, "2 j a n"]:
    """Weigh nodes for ∫ dt, for even and for odd integrands."""
    k = np.arange(count)[:, None]
    table = np.where(k > 0, 2, 1) / count * np.cos(k * _angles(count))
    return jnp.stack([_weigh(table, sines, parity) for parity in (0, 1)])


def _sloped_weights(count: int, span: Spans, slope: Array, sines: Float[Array, "k a n"]):
    """Weigh nodes for ∫ (slope·ω) dt, for even and for odd integrands."""
    along, across = (dot(slope, row)[None] for row in (span.middle, span.tangent))
    k = np.arange(count + 1)[:, None]
    cos, sin = (f(k * _angles(count)) / count for f in (np.cos, np.sin))
    # What multiplies ∫ cos kt dt: 2 cos t cos k't is cos (k'+1)t + cos (k'-1)t.
    cos_before, sin_before = (np.concatenate([0 * x[:1], x[:-1]]) for x in (cos, sin))
    cos_after, sin_after = (np.concatenate([x[1:-1], 0 * x[:2]]) for x in (cos, sin))
    straight, turned = cos_before + cos_after, sin_after - sin_before
    return jnp.stack(
        [
            along * _weigh(straight, sines, parity) + across * _weigh(turned, sines, parity)
            for parity in (1, 0)
        ]
    )


def _weigh(table: Float[np.ndarray, "k j"], sines: Float[Array, "rows a n"], parity: int) -> Nodes:
    """Sum rows k of one parity."""
    terms = [
        jnp.asarray(table[k], sines.dtype)[:, None, None] * sines[k][None]
        for k in range(parity, len(table), 2)
    ]
    if not terms:
        return jnp.zeros((table.shape[1], *sines.shape[1:]), sines.dtype)
    return functools.reduce(jnp.add, terms)


def _angles(count: int) -> Float[np.ndarray, " j"]:
    return (np.arange(count) - (count - 1) / 2) * np.pi / count


def _azimuth(degree: int, x: Nodes, y: Nodes) -> Float[Array, "rows j a n"]:
    """1, and the real and imaginary parts of (x + iy)^m."""
    rows = [jnp.ones_like(x)]
    cos, sin = x, y
    for m in range(1, degree + 1):
        rows += [cos, sin]
        if m % 2:  # (x + iy)^(m + 1), by few products
            half = (m + 1) // 2
            c, s = rows[2 * half - 1], rows[2 * half]
            cos, sin = (c - s) * (c + s), 2 * c * s
        else:
            cos, sin = x * rows[-2] - y * rows[-1], x * rows[-1] + y * rows[-2]
    return jnp.stack(rows)


def _zenith(degree: int, z: Nodes, weights: Float[Array, "2 j a n"]):
    """Zenith rows times the weights for even or for odd l."""
    table, rows = zenith_table(degree), _products(degree).rows
    which = (degrees(degree)[rows] % 2).astype(np.int32)
    e, f, factors = (
        jnp.asarray(t[..., rows], z.dtype)[..., None, None, None]
        for t in (table.e, table.f, table.factors)
    )
    z = z[None]
    value, u = _take(weights, which) * (e * z + f), z * z - 0.5
    for first, *rest in factors:
        value = value * functools.reduce(lambda sum, c: sum * u + c, rest, first)
    return value


def _integrate(azimuth: Float[Array, "_ j a n"], z: Nodes, weights: Array, degree: int):
    """Σ w y over the nodes."""
    table = _products(degree)

    def sum_nodes(azimuth, zenith):
        terms = (
            _take(azimuth[:, j], table.azimuth) * _take(zenith[:, j], table.zenith)
            for j in range(azimuth.shape[1])
        )
        return functools.reduce(jnp.add, terms)

    def integral(azimuth, z, weights):
        zenith = materialize(functools.partial(_zenith, degree), z, weights)
        return materialize(sum_nodes, azimuth, zenith)

    return as_one(integral, azimuth, z, weights)


def _take(rows: Array, index: Int[np.ndarray, " k"]) -> Array:
    return rows.at[index].get(mode="promise_in_bounds")
