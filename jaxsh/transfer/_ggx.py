"""GGX reflection as a zonal lobe: the best one for each degree, roughness and angle of view."""

import functools
import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.polynomial.chebyshev import chebvander
from numpy.polynomial.legendre import leggauss, legvander

from .._core.host import read_only_cache
from .._core.linalg import matmul, tensordot
from .._core.xla import in_blocks, materialize, rows_at_once
from ..harmonics import clamped_cosine, legendre, orders
from ._nodes import product_nodes

# Chebyshev polynomials in roughness and in the cosine of the angle of view, and their places.
_TERMS = 14, 18
_PLACES = 18, 24
_BLOCK = 1024  # vertices whose terms stay in cache
_HALFWAYS = 32, 48  # halfway vectors by height and azimuth
# Keeps the fit from adding what no surface of it sees.
_STIFFNESS = 1e-6
_LEAST = 1e-6  # share of light at grazing angles that is told from none
_UNIFORM = (4 * np.pi) ** -0.5  # what light 1 from all around is integrated with


def ggx_lobe(
    roughness: Float[Array, "..."],
    specular: Float[Array, "..."],
    cosine: Float[Array, " v"],
    degree: int,
) -> tuple[Float[Array, "v bands"], Float[Array, "v channels"]]:
    """Evaluate the lobe's zonal coefficients g_l, and the share of uniform light it reflects.

    With F_0 the reflectance along the normal, Schlick's Fresnel term F_0 + (1 - F_0)(1 - o·h)⁵ is
    mixed of one for F_0 = 1 and one for F_0 = 0. So is the lobe, for the mean of `specular` over
    the channels, and each channel's share for its own. Through an open surface's transfer of this
    degree the lobe itself takes up uniform light in full. `cosine` is that between normal and eye;
    both it and the roughness are from 0 to 1.
    """
    table, bands, dtype = ggx_table(degree), degree + 1, cosine.dtype
    if roughness.ndim == 0:
        along = _chebyshev(roughness.astype(dtype), _TERMS[0])
        values = matmul(tensordot(along, jnp.asarray(table, dtype)), _across(cosine)).T
    else:
        evaluate = functools.partial(_by_vertex, table=table)
        most = rows_at_once(math.prod(table.shape[:2]) * dtype.itemsize)
        values = in_blocks(evaluate, cosine, roughness.astype(dtype), size=_BLOCK, most=most)
    white, black = values[:, :bands], values[:, bands : 2 * bands]
    # Polynomials overshoot: no surface adds light, and with none of either the lobe would be 0/0.
    whole, grazing = jnp.clip(values[:, -2:-1], 0, 1), jnp.clip(values[:, -1:], _LEAST, 1)
    normal = jnp.asarray(specular, dtype).reshape(-1, *specular.shape[-1:] or (1,))
    mean = jnp.mean(normal, axis=1, keepdims=True)
    lobe = mean * white + (1 - mean) * grazing * black
    # What the transfer leaves of it: the table alone would be off by some percent.
    taken = matmul(
        lobe * materialize(functools.partial(_legendre, degree=degree), cosine),
        clamped_cosine(degree).astype(dtype),
    )
    return lobe / taken[:, None], whole * (normal + (1 - normal) * grazing)


def _across(cosine: Float[Array, " v"]) -> Float[Array, "terms v"]:
    # Once, where XLA would take each term anew from those before it.
    return materialize(functools.partial(_chebyshev, count=_TERMS[1]), cosine)


def _by_vertex(
    cosine: Float[Array, " v"],
    roughness: Float[Array, " v"],
    table: Float[np.ndarray, "i rows j"],
) -> Float[Array, "v rows"]:
    along = materialize(functools.partial(_chebyshev, count=_TERMS[0]), roughness)
    flat = jnp.asarray(table.reshape(-1, table.shape[2]), cosine.dtype)
    products = matmul(flat, _across(cosine)).reshape(*table.shape[:2], -1)
    return jnp.sum(products * along[:, None], axis=0).T


def _chebyshev(x: Float[Array, "..."], count: int) -> Float[Array, "terms ..."]:
    x = 2 * x - 1
    terms = [jnp.ones_like(x), x]
    while len(terms) < count:
        terms.append(2 * x * terms[-1] - terms[-2])
    return jnp.stack(terms)


def _legendre(x: Float[Array, " v"], degree: int) -> Float[Array, "v bands"]:
    terms = [jnp.ones_like(x), x]
    for l in range(1, degree):
        terms.append(((2 * l + 1) * x * terms[-1] - l * terms[-2]) / (l + 1))
    return jnp.stack(terms[: degree + 1], axis=1)


@read_only_cache(maxsize=16)
def ggx_table(degree: int) -> Float[np.ndarray, "i rows j"]:
    """Fits the lobe to reflection by halfway vectors, at places of roughness and angle.

    Least squares over the coefficients of what is reflected: of an open surface, and beside walls
    that hide half of its hemisphere, in front, behind or aside. Rows hold coefficients of
    T_i(2 roughness - 1) T_j(2 cosine - 1): of the lobe's bands for F_0 = 1, and of those for
    F_0 = 0, both such that the open one reflects uniform light in full; of what it truly reflects
    of that for F_0 = 1; and of the share of this for F_0 = 0.
    """
    roughness, cosine = (_chebyshev_places(count) for count in _PLACES)
    bands = degree + 1
    gathered = _gathered(cosine, degree)
    # Lagrange's multiplier keeps what the open surface reflects of uniform light.
    system = np.zeros((len(cosine), bands + 1, bands + 1))
    system[:, :-1, :-1] = np.einsum("svlk,svmk->vlm", gathered, gathered)
    system[:, :-1, :-1] += _STIFFNESS * np.diag(2 * np.arange(bands) + 1) / (4 * np.pi)
    system[:, :-1, -1] = system[:, -1, :-1] = gathered[0, :, :, 0]
    norms = np.sqrt((2 * np.arange(bands) + 1) / (4 * np.pi))

    # As many angles at once as their basis takes some 32 MB for.
    parts = np.array_split(cosine, -(-len(cosine) * math.prod(_HALFWAYS) * bands**2 // 2**22))
    values = np.zeros((len(roughness), 2 * bands + 2, len(cosine)))
    for i, one in enumerate(roughness):
        reflected = np.concatenate([_reflected(one, some, degree) for some in parts])
        uniform = reflected[:, :, 0, 0]
        reflected = _UNIFORM * reflected / uniform[:, :, None, None]
        right = np.einsum("svlk,vfsk->vlf", gathered, reflected)
        right = np.concatenate([right, np.full_like(right[:, :1], _UNIFORM)], axis=1)
        lobes = np.linalg.solve(system, right)[:, :-1] * norms[:, None]
        values[i, :-2] = lobes.T.reshape(2 * bands, len(cosine))
        values[i, -2:] = uniform[:, 0] / _UNIFORM, uniform[:, 1] / uniform[:, 0]

    along, across = (
        np.linalg.pinv(chebvander(2 * places - 1, terms - 1))
        for places, terms in zip((roughness, cosine), _TERMS, strict=True)
    )
    return np.einsum("ia,arb,jb->irj", along, values, across)


def _chebyshev_places(count: int) -> Float[np.ndarray, " n"]:
    """Roots of a Chebyshev polynomial, on [0, 1]."""
    return (1 - np.cos((np.arange(count) + 0.5) * np.pi / count)) / 2


def _seen(directions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "4 n"]:
    """Says which directions are seen: all, and beside a wall behind, in front and aside."""
    x, y, _ = directions.T
    return np.stack([np.ones_like(x), x > 0, x < 0, y > 0]).astype(np.float64)


def _basis(directions: Float[np.ndarray, "n 3"], degree: int) -> Float[np.ndarray, "k n"]:
    x, y, z = directions.T
    turned = np.exp(1j * np.arange(degree + 1)[:, None] * np.arctan2(y, x))
    azimuth = np.concatenate([turned.imag[:0:-1], turned.real])[orders(degree) + degree]
    return legendre(np.clip(z, -1, 1), degree) * azimuth


def _gathered(cosine: Float[np.ndarray, " v"], degree: int) -> Float[np.ndarray, "4 v bands k"]:
    """Computes what each band of a lobe gathers through transfer, at a degree as in shading."""
    heights, weights = leggauss(2 * degree + 32)
    z, weights = (heights + 1) / 2, weights / 2
    # A quarter of the circle at a time, since the walls end there.
    turns, shares = leggauss(degree + 16)
    phi = (np.arange(4)[:, None] + (turns + 1) / 2).ravel() * np.pi / 2
    shares = np.tile(shares, 4) * np.pi / 4
    r = np.sqrt(1 - z * z)[:, None]
    around = np.stack([r * np.cos(phi), r * np.sin(phi), z[:, None] + 0 * phi], -1).reshape(-1, 3)
    measure = (weights * z)[:, None] * shares
    transfer = (_seen(around) * measure.ravel()) @ _basis(around, degree).T

    nodes = product_nodes(degree)
    values = transfer @ nodes.basis.T
    axis = np.stack([-np.sqrt(1 - cosine * cosine), 0 * cosine, cosine], axis=1)
    bands = legvander(axis @ nodes.directions.T, degree) * (2 * np.arange(degree + 1) + 1)
    return np.einsum("sn,vnl,kn->svlk", values, bands / (4 * np.pi), nodes.project, optimize=True)


def _reflected(
    roughness: float, cosine: Float[np.ndarray, " v"], degree: int
) -> Float[np.ndarray, "v 2 4 k"]:
    """Integrates the BRDF times cosine and basis, for F_0 = 1 and for F_0 = 0.

    Over halfway vectors that the microfacets' distribution itself draws, so that a smooth surface
    is no other than a rough one. Walter et al. 2007, "Microfacet models for refraction through
    rough surfaces"; masking and shadowing by Smith, correlated (Heitz 2014, equation 99).
    """
    square = roughness**4
    u, weights = leggauss(_HALFWAYS[0])
    u, weights = (u + 1) / 2, weights / 2
    phi = (np.arange(_HALFWAYS[1]) + 0.5) * 2 * np.pi / _HALFWAYS[1]
    weights = np.repeat(weights, len(phi)) / len(phi)
    z = 1 / np.sqrt(1 + square * u / (1 - u))[:, None]
    r = np.sqrt(1 - z * z)
    halfway = np.stack([r * np.cos(phi), r * np.sin(phi), z + 0 * phi], -1).reshape(-1, 3)
    eyes = np.stack([np.sqrt(1 - cosine * cosine), 0 * cosine, cosine], axis=1)
    along = eyes @ halfway.T
    incoming = 2 * along[..., None] * halfway - eyes[:, None]
    lit = (along > 0) & (incoming[..., 2] > 0)

    def hidden(z):
        return (np.sqrt(1 + square * (1 / z**2 - 1)) - 1) / 2

    masked = hidden(cosine)[:, None] + hidden(np.where(lit, incoming[..., 2], 1))
    share = weights * along / (1 + masked) / (cosine[:, None] * halfway[:, 2])
    share = np.where(lit, share, 0)
    flat = incoming.reshape(-1, 3)
    seen = _seen(flat).reshape(4, *lit.shape).swapaxes(0, 1) * share[:, None]
    fresnel = np.stack([np.ones_like(along), np.where(lit, 1 - along, 0) ** 5], axis=1)
    basis = np.moveaxis(_basis(flat, degree).reshape(-1, *lit.shape), 0, 2)
    return fresnel[:, :, None] * seen[:, None] @ basis[:, None]
