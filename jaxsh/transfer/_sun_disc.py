"""Integrals over a uniform disc of light: of a cosine, and of a Phong lobe with it."""

import math

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

# Nodes from the inner to the outer rim of the disc about the lobe's axis, and along each arc.
_RINGS, _ALONG = 8, 4
_TINY = 1e-30


@jax.custom_jvp
def disc_irradiance(
    cosine: Float[Array, "..."], solid_angle: Float[Array, "..."]
) -> Float[Array, "..."]:
    """Integrates max(0, n·ω) over a disc whose middle stands at this cosine from n.

    Of what the horizon leaves, by Lambert's sum over its rim: the arc of the disc and that of the
    horizon. Written so that small discs keep their digits.
    """
    squared, cos_sigma, _, sin_theta, azimuth, _, sin_azimuth = _cut(cosine, solid_angle)
    width = sin_theta * sin_azimuth
    tangent = width * jnp.sqrt(squared) / cos_sigma
    arcs = squared * (azimuth * cosine + width * jnp.sqrt(squared) / cos_sigma)
    return jnp.maximum(arcs + _arctan_less(tangent), 0)


@disc_irradiance.defjvp
def _disc_irradiance_jvp(primals, tangents):
    cosine, solid_angle = primals
    turned, widened = tangents
    squared, cos_sigma, sin_sigma, sin_theta, azimuth, cos_azimuth, sin_azimuth = _cut(*primals)
    # The horizon's own motion adds nothing, for the cosine is zero there.
    by_cosine = squared * (azimuth - sin_azimuth * cos_azimuth)
    rim = azimuth * cos_sigma * cosine + sin_sigma * sin_theta * sin_azimuth
    change = by_cosine * turned + rim / math.pi * widened
    return disc_irradiance(cosine, solid_angle), change


def _cut(cosine, solid_angle):
    """Returns sin²σ, cos σ, sin σ, sin θ, and where the horizon cuts the disc of radius σ.

    That is the azimuth about its middle, counted from the highest point, up to which the rim is
    above the horizon, with its cosine and sine.
    """
    height = solid_angle / (2 * math.pi)
    squared = height * (2 - height)
    cos_sigma, sin_sigma = 1 - height, _root(squared)
    is_cut = cosine * cosine < squared
    sin_theta = _root(1 - cosine * cosine)
    safe = jnp.where(is_cut, sin_sigma * sin_theta, 1)
    cos_azimuth = jnp.where(is_cut, -cosine * cos_sigma / safe, jnp.sign(-cosine))
    sin_azimuth = _root(1 - cos_azimuth * cos_azimuth)
    inside = sin_azimuth > 0
    whole = jnp.where(cos_azimuth < 0, math.pi, 0)
    azimuth = jnp.where(inside, jnp.arccos(jnp.where(inside, cos_azimuth, 0)), whole)
    return squared, cos_sigma, sin_sigma, sin_theta, azimuth, cos_azimuth, sin_azimuth


def _root(x):
    """Computes √max(0, x), with slope 0 at 0."""
    return jnp.where(x > 0, jnp.sqrt(jnp.where(x > 0, x, 1)), 0)


def _arctan_less(t):
    """Computes atan(t) - t, which for small t is the difference of nearly equal numbers."""
    square, total = t * t, jnp.zeros_like(t)
    for n in range(12, 0, -1):
        total = square * ((-1) ** n / (2 * n + 1) + total)
    small = jnp.abs(t) < 0.25
    return jnp.where(small, t * total, jnp.arctan(t) - t)


def lobe_over_disc(
    axis: Float[Array, "v 3"],
    normals: Float[Array, "v 3"],
    direction: Float[Array, "s 3"],
    solid_angle: Float[Array, " s"],
    exponent: Float[Array, " v"],
) -> Float[Array, "v s"]:
    """Integrates max(0, B·ω)^k max(0, n·ω) over discs, for any k > -1 however narrow the lobe is.

    In circles about the lobe's axis B, on each of which the lobe is constant: the arc within the
    disc is known, the cosine over it a sum of four terms, and the circles are chosen by the
    lobe's own distribution, denser towards the rims, where the arc grows as a square root.
    """
    b, n, d = (a.T for a in (axis, normals, direction))
    along = b[0][:, None] * d[0][None] + b[1][:, None] * d[1][None] + b[2][:, None] * d[2][None]
    across = [
        b[i - 2][:, None] * d[i - 1][None] - b[i - 1][:, None] * d[i - 2][None] for i in range(3)
    ]
    upright = jnp.sum(axis * normals, axis=1)[:, None]  # n·B
    cosine = n[0][:, None] * d[0][None] + n[1][:, None] * d[1][None] + n[2][:, None] * d[2][None]
    aside = sum(n[i][:, None] * across[i] for i in range(3))  # n·(B × d)
    sine = _root(across[0] ** 2 + across[1] ** 2 + across[2] ** 2)

    height = solid_angle / (2 * math.pi)
    sigma = (2 * jnp.arcsin(_root(height / 2)))[None]
    # Where B points at the middle nothing depends on the azimuth that is undefined there.
    gamma = jnp.maximum(jnp.arctan2(sine, along), 1e-3 * sigma)
    sine = jnp.maximum(sine, 1e-3 * sigma)
    towards, beside = (cosine - along * upright) / sine, aside / sine  # of n, about B

    k = exponent[:, None]
    end = math.pi / 2 - 1e-6
    inner, outer = (jnp.minimum(a, end) for a in (jnp.abs(gamma - sigma), gamma + sigma))
    first, last = _fall(inner), _fall(outer)
    drop = jnp.expm1(-(k + 1) * (last - first))
    mass = jnp.exp(-(k + 1) * first) * -drop / (k + 1)
    shares, weights = (jnp.asarray(a, axis.dtype)[:, None, None] for a in _rings())
    fall = first[None] - jnp.log1p(shares * drop[None]) / (k + 1)[None]
    cos_beta, sin_beta = jnp.exp(-fall), _root(-jnp.expm1(-2 * fall))
    beta = jnp.arctan2(sin_beta, cos_beta)
    # Half of the arc's azimuth, by the half-angle formula of the triangle of B, d and the rim.
    gamma, sigma = gamma[None], sigma[None]
    half = [
        _root(jnp.maximum(jnp.sin(one / 2) * jnp.sin(two / 2), _TINY))
        for one, two in (
            (sigma + beta - gamma, sigma + gamma - beta),
            (sigma + gamma + beta, gamma + beta - sigma),
        )
    ]
    arc = 2 * jnp.arctan2(*half)
    total = jnp.zeros_like(arc)
    places = np.stack(np.polynomial.legendre.leggauss(_ALONG), axis=-1)
    for place, weight in places.tolist():
        if place > 0:  # and its mirror image
            level = cos_beta * upright[None] + sin_beta * jnp.cos(place * arc) * towards[None]
            tilt = sin_beta * jnp.sin(place * arc) * beside[None]
            total += weight * (jnp.maximum(level + tilt, 0) + jnp.maximum(level - tilt, 0))
    rings = mass * jnp.sum(weights * arc * total, axis=0)
    # Circles that lie in the disc as a whole. The horizon cuts them as it would a disc on which
    # sin² has the mean that it has over them.
    share = jnp.expm1(-(k + 1) * first) / (k + 1)
    cos_squared = jnp.expm1(-(k + 3) * first) / (k + 3) / share
    squared = jnp.clip(2 * (1 - cos_squared), 1e-10, 0.99)
    cap = 2 * math.pi * squared / (1 + jnp.sqrt(1 - squared))
    level = disc_irradiance(upright, cap) / (math.pi * squared)
    whole = -jnp.expm1(-(k + 2) * first) / (k + 2) * (2 * math.pi) * level
    return rings + jnp.where(gamma[0] < sigma[0], whole, 0)


def _fall(angle):
    """Computes -log cos, also where it is small."""
    near = jnp.sin(jnp.minimum(angle, 1))
    return jnp.where(
        angle < 1, -jnp.log1p(-near * near) / 2, -jnp.log(jnp.cos(jnp.maximum(angle, 1)))
    )


def _rings() -> tuple[np.ndarray, np.ndarray]:
    """Returns nodes and weights on [0, 1] for what grows as a square root from both ends."""
    nodes, weights = np.polynomial.legendre.leggauss(_RINGS)
    angle = np.pi * (nodes + 1) / 2
    return (1 - np.cos(angle)) / 2, np.pi / 4 * weights * np.sin(angle)
