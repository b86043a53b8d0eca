"""The glossy lobe: where it points, and what it is worth in a direction."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.polynomial import Polynomial

from .._core.host import read_only_cache
from .._core.linalg import PRECISION
from .._core.vectors import normalize
from .._core.xla import materialize
from ..harmonics import phong


@functools.partial(jax.jit, static_argnums=3)
def reflected(
    eye: Float[Array, " 3"],
    positions: Float[Array, "v 3"],
    normals: Float[Array, "v 3"],
    distant: bool,
) -> Float[Array, "3 v"]:
    """B(ω_o) = 2 (n·ω_o) n - ω_o, the direction towards the eye, mirrored about the normal.

    Always a unit vector: a normal that is undefined counts as zero, which turns B into -ω_o, and
    an eye on the vertex itself is taken to be straight above it.
    """
    rows, units = rows_of(positions, normals)
    return mirrored(eye, rows, units, distant)


def rows_of(
    positions: Float[Array, "v 3"], normals: Float[Array, "v 3"]
) -> tuple[Float[Array, "3 v"], Float[Array, "3 v"]]:
    """What `mirrored` takes: components first, normals at unit length."""
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
    """`reflected` of `rows_of`."""
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
    """Or zero; of any length, since the largest component is taken out."""
    largest = jax.lax.stop_gradient(jnp.maximum(jnp.maximum(jnp.abs(x), jnp.abs(y)), jnp.abs(z)))
    defined = largest > 0
    scale = jnp.where(defined, 1 / jnp.where(defined, largest, 1.0), 0.0)
    x, y, z = x * scale, y * scale, z * scale
    return scale * jnp.sqrt(1 / jnp.where(defined, x * x + y * y + z * z, 1.0))


def lobe_polynomial(
    exponent: Float[Array, "*v"], degree: int, normalized: bool
) -> Float[Array, "bands ..."]:
    """Coefficients of a Phong lobe, cut to a degree, as a polynomial of t = cos θ.

    Σ_l g_l y_l0(t) = E(t² - ½) + t O(t² - ½). Those of E come first, ascending. Around the middle
    of [0, 1] they stay small, where powers of t alone would cancel each other.
    """
    zonal = jnp.moveaxis(phong(exponent, degree, normalized=normalized), -1, 0)
    return jnp.tensordot(jnp.asarray(_powers(degree), zonal.dtype), zonal, 1, precision=PRECISION)


def lobe(t: Float[Array, "..."], polynomial: Float[Array, "bands ..."]) -> Float[Array, "..."]:
    """The lobe at t = cos θ from its axis. Batches of polynomials broadcast against t."""
    even, odd = jnp.split(polynomial, [(len(polynomial) + 1) // 2])
    u = t * t - 0.5

    def horner(coefficients):
        return functools.reduce(lambda value, c: value * u + c, reversed(coefficients))

    return horner(list(even)) + (t * horner(list(odd)) if len(odd) else 0.0)


def unit(vectors: Float[Array, "3 v"]) -> Float[Array, "3 v"]:
    """At unit length, or zero where there is no direction."""
    (x, y, z), (a, b, c) = vectors != 0, jnp.isfinite(vectors)
    defined = ((x | y | z) & a & b & c)[None]
    unit, _ = normalize(jnp.where(defined, vectors, 1.0)[:, None])
    return jnp.where(defined, unit[:, 0], 0.0)


@read_only_cache(maxsize=16)
def _powers(degree: int) -> Float[np.ndarray, "bands bands"]:
    """From g_l to the coefficients of E and O."""
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
