"""Kernels of glossy light: reflection, the lobe, directions to sum over, and the sums.

The one private file that other modules may import from: `adaptive` builds on these kernels.
"""

import functools
from typing import Protocol, runtime_checkable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int8, Num
from numpy.polynomial import Polynomial

from .._core.host import read_only_cache
from .._core.linalg import matmul, shading_matmul, tensordot
from .._core.vectors import normalize
from .._core.xla import materialize, on_mesh, rows_at_once, rows_on_each
from ..harmonics import degree_of, phong
from ._ggx import ggx_lobe
from ._material import (
    Material,
    checked_albedo,
    checked_eye,
    checked_light,
    checked_material,
    checked_one_light,
)
from ._nodes import node_passes, product_nodes

__all__ = [
    "AtNodes",
    "block_sums",
    "checked_albedo",
    "checked_eye",
    "checked_light",
    "checked_material",
    "checked_one_light",
    "cosines",
    "in_steps",
    "lobe",
    "lobe_polynomial",
    "lobe_products",
    "mirrored",
    "node_passes",
    "product_nodes",
    "reflected",
    "reflection",
    "rows_of",
    "unit",
]

# Cosines between normal and eye behind a surface: GGX's share is the horizon's up to the one, and
# none from the other on.
_AS_SEEN, _UNSEEN = -0.1, -0.6


@functools.partial(jax.jit, static_argnums=3)
def reflected(
    eye: Float[Array, " 3"],
    positions: Float[Array, "v 3"],
    normals: Float[Array, "v 3"],
    distant: bool,
) -> Float[Array, "3 v"]:
    """Computes B(ω_o), as the public `reflected_direction` says, components first."""
    rows, units = rows_of(positions, normals)
    return mirrored(eye, rows, units, distant)


def rows_of(
    positions: Float[Array, "v 3"], normals: Float[Array, "v 3"]
) -> tuple[Float[Array, "3 v"], Float[Array, "3 v"]]:
    """Puts components first and normals at unit length, as `mirrored` takes them."""
    # Once, where XLA would take rows out of columns again for each component of what follows.
    return materialize(
        lambda positions, normals: (positions.T, unit(normals.T)), positions, normals
    )


def mirrored(
    eye: Float[Array, " 3"],
    positions: Float[Array, "3 v"],
    normals: Float[Array, "3 v"],
    distant: bool,
) -> Float[Array, "3 v"]:
    """Computes `reflected` from what `rows_of` gives."""
    if distant:
        eye = unit(eye[:, None])[:, 0]

    def towards(eye, positions, normals):
        there = (
            jnp.broadcast_to(eye[:, None], normals.shape) if distant else eye[:, None] - positions
        )
        x, y, z = there == 0
        return jnp.where((x & y & z)[None], normals, there)

    def scales(eye, positions, normals):
        there = towards(eye, positions, normals)
        cosine = normals[0] * there[0] + normals[1] * there[1] + normals[2] * there[2]
        inverse = jnp.ones_like(cosine) if distant else _inverse_length(*there)
        return inverse, 2 * cosine * inverse

    # These two are divisions and a root, which each component would take anew.
    inverse, twice_cosine = materialize(scales, eye, positions, normals)
    there = towards(eye, positions, normals)
    return twice_cosine[None] * normals - inverse[None] * there


def _inverse_length(x, y, z):
    """Computes 1/length, or zero; the largest component is taken out, so no square overflows."""
    largest = jax.lax.stop_gradient(jnp.maximum(jnp.maximum(jnp.abs(x), jnp.abs(y)), jnp.abs(z)))
    defined = largest > 0
    scale = jnp.where(defined, 1 / jnp.where(defined, largest, 1.0), 0.0)
    x, y, z = x * scale, y * scale, z * scale
    return scale * jnp.sqrt(1 / jnp.where(defined, x * x + y * y + z * z, 1.0))


def reflection(
    material: Material,
    axis: Float[Array, "3 v"],
    normals: Float[Array, "3 v"],
    degree: int,
    normalized: bool,
) -> tuple[Float[Array, "*v bands"], Float[Array, "..."]]:
    """Computes the lobe's zonal coefficients, and the albedo that it is multiplied with.

    Those of Phong's lobe are the material's own. A GGX lobe has one for each vertex, by the angle
    between its normal, of any length, and the axis, the mirrored direction towards the eye.
    """
    if material.exponent is not None:
        return phong(material.exponent, degree, normalized=normalized), material.specular
    assert material.roughness is not None
    if not normalized:
        raise ValueError(
            "expected normalized=True with a roughness: it is Phong's lobe that has a bare power"
        )
    # An eye behind the surface sees nothing. Points just behind a silhouette share faces with those
    # before it, and so have what is seen at the horizon; farther behind it fades.
    along = jnp.sum(axis * unit(normals), axis=0)
    zonal, share = ggx_lobe(material.roughness, material.specular, jnp.clip(along, 0, 1), degree)
    seen = jnp.clip((along - _UNSEEN) / (_AS_SEEN - _UNSEEN), 0, 1)[:, None]
    return zonal, share * seen**2 * (3 - 2 * seen)


def lobe_polynomial(zonal: Float[Array, "*v bands"]) -> Float[Array, "bands ..."]:
    """Writes a lobe, given by its zonal coefficients g_l, as a polynomial of t = cos θ.

    Σ_l g_l y_l0(t) = E(t² - ½) + t O(t² - ½). Those of E come first, ascending. Around the middle
    of [0, 1] they stay small, where powers of t alone would cancel each other.
    """
    degree = zonal.shape[-1] - 1
    return tensordot(jnp.asarray(_powers(degree), zonal.dtype), jnp.moveaxis(zonal, -1, 0))


def lobe(t: Float[Array, "..."], polynomial: Float[Array, "bands ..."]) -> Float[Array, "..."]:
    """Evaluates the lobe at t = cos θ from its axis; batches of polynomials broadcast against t."""
    even, odd = jnp.split(polynomial, [(len(polynomial) + 1) // 2])
    u = t * t - 0.5

    def horner(coefficients):
        return functools.reduce(lambda value, c: value * u + c, reversed(coefficients))

    return horner(list(even)) + (t * horner(list(odd)) if len(odd) else 0.0)


def unit(vectors: Float[Array, "3 v"]) -> Float[Array, "3 v"]:
    """Scales to unit length; zero where a vector is zero or not finite."""
    x, y, z = jnp.abs(vectors)
    largest = jnp.maximum(jnp.maximum(x, y), z)
    defined = ((largest > 0) & jnp.isfinite(largest))[None]
    unit, _ = normalize(jnp.where(defined, vectors, 1.0)[:, None])
    return jnp.where(defined, unit[:, 0], 0.0)


@read_only_cache(maxsize=16)
def _powers(degree: int) -> Float[np.ndarray, "bands bands"]:
    """Returns the matrix from g_l to the coefficients of E and O."""
    # P_l(t) is p_l(u), or t p_l(u) for odd l: Bonnet's recursion with t² = u + ½.
    polynomials = [Polynomial([1.0]), Polynomial([1.0])]
    for l in range(1, degree):
        p = (2 * l + 1) * polynomials[l] * Polynomial([0.5, 1] if l % 2 else [1.0])
        polynomials.append((p - l * polynomials[l - 1]) / (l + 1))
    matrix = np.zeros((degree + 1, degree + 1))
    for l, p in enumerate(polynomials[: degree + 1]):
        start = (degree // 2 + 1) * (l % 2)
        norm = np.sqrt((2 * l + 1) / (4 * np.pi))
        matrix[start : start + len(p.coef), l] = norm * p.coef
    return matrix


@runtime_checkable
class AtNodes(Protocol):
    """Transfer that can be evaluated at the nodes of a degree, pass by pass."""

    def node_passes(self, degree: int) -> Float[Array, "p n ..."]: ...

    def at_nodes(self, some: Float[Array, "n ..."], width: int) -> Float[Array, "n v"]: ...


def lobe_products(
    lights: Float[Array, "rows k"],
    transfer: AtNodes,
    axis: Float[Array, "3 v"],
    lobes: Float[Array, "bands ..."],
) -> Float[Array, "rows v"]:
    """Integrates L O lobe(B·ω) for each light and vertex, at the lights' degree."""
    width = lights.shape[-1]
    degree = degree_of(width)
    nodes = node_passes(degree)
    directions, project = (jnp.asarray(a, axis.dtype) for a in (nodes.directions, nodes.project))
    weights = matmul(lights[None], project)
    lobes = lobes.reshape(len(lobes), 1, -1)

    def share(directions, weights, some):
        values = transfer.at_nodes(some, width) * lobe(cosines(directions, axis), lobes)
        return shading_matmul(weights, values)

    # On one CPU the values of a pass stay in cache. Elsewhere a loop would leave devices idle: as
    # many passes as memory allows are one.
    spread = on_mesh(axis, transfer, lobes)

    def in_passes(*parts):
        if len(parts[0]) == 1:
            return share(*(part[0] for part in parts))

        @jax.checkpoint
        def add(total, part):
            return total + share(*part), None

        if spread:  # what a loop starts from is shared out as all its sums are: the first of them
            total = jax.checkpoint(share)(*(part[0] for part in parts))
            parts = tuple(part[1:] for part in parts)
        else:
            total = jnp.zeros((len(lights), axis.shape[1]), axis.dtype)
        return jax.lax.scan(add, total, parts)[0]

    def together(directions, weights, passes):
        rows = weights.reshape(-1, number, *weights.shape[1:])
        rows = jnp.moveaxis(rows, 1, 2).reshape(len(rows), len(lights), -1)
        directions, passes = (
            part.reshape(len(rows), -1, *part.shape[2:]) for part in (directions, passes)
        )
        return in_passes(directions, rows, passes)

    parts = directions, weights, transfer.node_passes(degree)
    count, size = nodes.directions.shape[:2]
    most = rows_at_once(size * rows_on_each(axis, 1) * axis.dtype.itemsize)
    number = max(n for n in range(1, count + 1) if count % n == 0 and n <= most)
    if spread:
        return together(*parts)
    return jax.lax.platform_dependent(*parts, cpu=in_passes, default=together)


@jax.custom_jvp
def cosines(directions: Float[Array, "n 3"], axis: Float[Array, "3 v"]) -> Float[Array, "n v"]:
    """Computes inner products, written out so that XLA fuses them into their use."""
    x, y, z = directions.T[..., None]
    return x * axis[:1] + y * axis[1:2] + z * axis[2:]


@cosines.defjvp
def _cosines_jvp(primals, tangents):
    # The transpose of the written-out form would sum over directions for each of three rows.
    _, change = jax.jvp(matmul, primals, tangents)
    return cosines(*primals), change


_LARGEST = 127  # of eight bits
# Sums side by side: a term waits for the one before it in its own sum alone.
_CHAINS = 8


@jax.custom_jvp
def block_sums(
    weights: Float[Array, "#blocks r n"], values: Num[Array, "blocks n b"]
) -> Float[Array, "blocks r b"]:
    """Sums Σ_n w_rn f_nv for each vertex v of each block; f may be integers of few bits.

    XLA's CPU backend multiplies so many narrow matrices one after the other on one core, and each
    is copied first, integers as others. With the sum over n written out the whole is one loop
    over vertices, which it vectorises and splits over the cores.
    """
    return jax.lax.platform_dependent(weights, values, cpu=_written_out, default=_as_matrices)


@block_sums.defjvp
def _block_sums_jvp(primals, tangents):
    # The written-out sum would be transposed term by term.
    (weights, values), (turned, moved) = primals, tangents
    change = _as_matrices(turned, values)
    if jnp.issubdtype(values.dtype, jnp.inexact):
        change = change + _as_matrices(weights, moved)
    return block_sums(*primals), change


def _written_out(weights, values):
    terms = [
        weights[:, :, n, None] * values[:, n, None].astype(weights.dtype)
        for n in range(values.shape[1])
    ]
    sums = (functools.reduce(jnp.add, terms[i::_CHAINS]) for i in range(min(_CHAINS, len(terms))))
    return functools.reduce(jnp.add, sums)


def _as_matrices(weights, values):
    return shading_matmul(weights, values.astype(weights.dtype))


@functools.partial(jax.jit, static_argnums=1)
def in_steps(
    values: Float[Array, "..."], axis: int
) -> tuple[Int8[Array, "..."], Float[Array, "..."]]:
    """Rounds to integers from -127 to 127 times a scale, which an axis shares."""
    largest = jnp.max(jnp.abs(values), axis=axis)
    # An all-zero column gets scale 1; a non-finite value makes its column non-finite.
    scales = jnp.where(largest == 0, 1.0, largest / _LARGEST)
    return jnp.round(values / jnp.expand_dims(scales, axis)).astype(jnp.int8), scales
