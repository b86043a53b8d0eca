"""Search for the least window that leaves a light, or its irradiance, without negative values."""

import functools
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from .._core.checks import as_float, check_choice, check_coefficients
from .._core.linalg import dot, einsum, matmul
from .._core.xla import keep_rows, on_mesh
from ._basis import evaluate
from ._indexing import degrees, orders
from ._tables import legendre
from ._windows import damping
from ._zonal import clamped_cosine, convolve

# Rounds of the search for the least strength; in each, valleys looked into and halvings.
_CUTS, _VALLEYS, _HALVINGS = 16, 8, 60


def dering(
    coefficients: Float[ArrayLike, "*batch k"],
    *,
    of: Literal["irradiance", "light"] = "irradiance",
) -> tuple[Float[Array, "*batch k"], Float[Array, "*batch"]]:
    """Window a light by the least `damping` that leaves it without negative values.

    A truncated light rings: behind a bright source it goes below zero (Sloan 2008). A diffuse
    surface sees the light convolved with the clamped cosine, which takes far less of a window, or
    none.

    **Arguments**

    - `coefficients`: (..., K). Each function of the batch, each color channel too, gets a window of
      its own: for one window over the channels, use `damping` with the largest of their strengths.
    - `of`: what must have no negative value: `"irradiance"`, that of unshadowed diffuse surfaces,
      or `"light"`, the function itself, as for a picture of the light or a glossy surface.

    **Returns** the windowed coefficients (..., K) and the strengths (...). What is left below zero
    is under 1e-3 of the mean, and mostly far under. A function that needs no window is returned as
    it is, with strength 0; one whose mean is not positive cannot be helped and keeps nothing but
    its mean, with strength infinity; NaN gives NaN. Differentiable once, by the implicit function
    theorem, with a kink where the strength reaches zero or the darkest direction jumps; a second
    derivative raises `NotImplementedError`. Raises `ValueError` where K is not a square and for
    another `of`.

    **Cost** on five light probes (grace, galileo, eucalyptus, stpeters, uffizi): mean error of
    irradiance over a mesh's normals in % of its mean, least to greatest of the probes, one window
    for the three channels. `python -m experiments run environment --preset paper` prints it.

    | window | degree 2 | degree 6 | degree 10 |
    |---|---|---|---|
    | none | 1.5–4.0 | 0.3–1.0 | 0.1–0.5 |
    | `dering` | 1.5–14.2 | 0.3–1.0 | 0.1–0.5 |
    | `window("lanczos")` | 6.8–18.4 | 1.9–4.0 | 0.9–1.7 |
    | `window("hann")` | 9.2–24.5 | 2.5–5.8 | 1.2–2.5 |
    | `dering(of="light")` | 2.3–27.6 | 1.5–32.2 | 0.8–32.3 |

    By default four of the probes need a window at degree 1, one (grace) at degree 2 and none at 4,
    6 and 10. The negative parts of their light are then 2–30 % of its integral, which a diffuse
    surface does not see. Light with small bright sources loses most by `of="light"`, at any degree.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import harmonics
    >>> light = jnp.array([3.545, 0.0, 9.21, 0.0])  # 1 + 4.5 z
    >>> _, for_surfaces = harmonics.dering(light)
    >>> _, for_itself = harmonics.dering(light, of="light")
    >>> round(float(for_surfaces), 1), round(float(for_itself), 1)
    (0.5, 0.9)
    """
    coefficients = as_float(coefficients, "coefficients")
    degree = check_coefficients("coefficients", coefficients)
    check_choice("of", of, ("irradiance", "light"))
    judged = coefficients
    if of == "irradiance":
        judged = convolve(coefficients, clamped_cosine(degree))

    def least(judged):
        if judged.ndim > 1:
            return jax.vmap(least)(judged)
        return _least_strength(judged, degree)

    spec = (*jax.typeof(judged).sharding.spec, *[None] * judged.ndim)[: judged.ndim]
    rows = next((axis for axis, name in enumerate(spec) if name is not None), 0)
    strength = keep_rows(least, judged, like=judged, axis=rows, out=rows)
    return coefficients * damping(strength, degree), strength


@functools.partial(jax.custom_jvp, nondiff_argnums=(1,))
def _least_strength(coefficients: Float[Array, " k"], degree: int) -> Float[Array, ""]:
    return _search(coefficients, degree)[0]


@_least_strength.defjvp
def _least_strength_jvp(degree, primals, tangents):
    (coefficients,), (tangent,) = primals, tangents
    strength, direction = _search(jax.lax.stop_gradient(coefficients), degree)
    # The value at the darkest direction stays zero: dλ = -(∂f/∂c · dc) / (∂f/∂λ). Where that
    # direction goes does not matter, since f is least there.
    basis = evaluate(direction, degree)
    bands = _band_sums(jax.lax.stop_gradient(coefficients) * basis, degree)
    slope = jax.grad(_value)(strength, bands)
    regular = (strength > 0) & jnp.isfinite(strength) & (slope > 0)
    gradient = -damping(strength, degree) * basis / jnp.where(regular, slope, 1)
    gradient = _once(jnp.where(regular, gradient, 0), coefficients)
    return strength, dot(gradient, tangent)


@jax.custom_jvp
def _once(value: Array, origin: Array) -> Array:
    """`value`, which must not be differentiated with respect to `origin`."""
    return value


@_once.defjvp
def _once_jvp(primals, tangents):
    raise NotImplementedError("dering has first derivatives only")


@functools.partial(jax.jit, static_argnums=1)
def _search(
    coefficients: Float[Array, " k"], degree: int
) -> tuple[Float[Array, ""], Float[Array, " 3"]]:
    """Cutting planes: the least strength for the darkest direction, until none is dark.

    Returns it with the direction that decided last.
    """

    def cut(_, state):
        strength, decisive = state
        direction = _darkest(coefficients * damping(strength, degree), degree)
        bands = _band_sums(coefficients * evaluate(direction, degree), degree)
        negative = _value(strength, bands) < 0
        raised = jnp.where(negative, _root(bands, strength), strength)
        return raised, jnp.where(negative, direction, decisive)

    # Both made of the coefficients, so that inside `shard_map` they vary over the devices as the
    # loop's results do.
    zero = jnp.where(jnp.isnan(coefficients[0]), 0, 0).astype(coefficients.dtype)
    start = (zero, zero + jnp.eye(3, dtype=coefficients.dtype)[2])
    strength, direction = jax.lax.fori_loop(0, _CUTS, cut, start)
    # No comparison with NaN is true, which must not pass for "nothing is dark".
    return jnp.where(jnp.isfinite(coefficients).all(), strength, jnp.nan), direction


def _value(strength: Float[Array, ""], bands: Float[Array, " bands"]) -> Float[Array, ""]:
    """A function's value under the window, from the sums of its bands in one direction."""
    first = np.arange(len(bands), dtype=np.int32) ** 2  # the window is constant over a band
    return dot(damping(strength, len(bands) - 1)[first], bands)


def _root(bands: Float[Array, " bands"], low: Float[Array, ""]) -> Float[Array, ""]:
    """Strength above `low`, which is not enough, from which on one direction is not dark."""
    mean, swing = bands[0], jnp.sum(jnp.abs(bands[1:]))
    # On every band above the mean the window is at most 1/(4·strength): this much is enough.
    enough = jnp.where(mean > 0, swing / (4 * jnp.where(mean > 0, mean, 1)), jnp.inf)

    def halve(_, bounds):
        low, high = bounds
        middle = (low + high) / 2
        negative = _value(middle, bands) < 0
        return jnp.where(negative, middle, low), jnp.where(negative, high, middle)

    return jax.lax.fori_loop(0, _HALVINGS, halve, (low, jnp.maximum(enough, low)))[1]


def _darkest(coefficients: Float[Array, " k"], degree: int) -> Float[Array, " 3"]:
    """Direction of the least value: the lowest valleys of a grid, each searched more finely."""
    rings = 6 * degree + 8
    theta = (np.arange(rings) + 0.5) * np.pi / rings
    phi = np.arange(2 * rings) * np.pi / rings
    m = np.arange(-degree, degree + 1)[:, None]
    dtype = coefficients.dtype
    azimuth = np.where(m < 0, np.sin(-m * phi), np.cos(m * phi)).astype(dtype)
    meridians = legendre(np.cos(theta), degree).astype(dtype)
    by_order = jax.ops.segment_sum(
        coefficients[:, None] * meridians, orders(degree) + degree, len(azimuth)
    )
    samples = matmul(by_order.T, azimuth)
    # Neighbours: around in φ, and in θ up to the first and last ring.
    ring = jnp.minimum(jnp.roll(samples, 1, axis=1), jnp.roll(samples, -1, axis=1))
    row = jnp.minimum(ring, samples)
    above, below = jnp.concatenate([row[:1], row[:-1]]), jnp.concatenate([row[1:], row[-1:]])
    valley = samples <= jnp.minimum(ring, jnp.minimum(above, below))
    lowest = _least(jnp.where(valley, samples, jnp.inf).ravel(), _VALLEYS)
    polar = jnp.asarray(theta, dtype)[lowest // len(phi)]
    around = jnp.asarray(phi, dtype)[lowest % len(phi)]
    starts = jnp.stack(
        [jnp.sin(polar) * jnp.cos(around), jnp.sin(polar) * jnp.sin(around), jnp.cos(polar)], -1
    )
    directions, values = _refine(coefficients, starts, degree, reach=float(theta[0]))
    return directions[jnp.argmin(values)]


def _least(values: Float[Array, " n"], count: int) -> Int[Array, " count"]:
    """Indices of the least values; in turn on a mesh, where `top_k` would gather a batch."""
    if not on_mesh(values):
        return jax.lax.top_k(-values, count)[1]
    places = np.arange(len(values), dtype=np.int32)

    def take(values, _):
        least = jnp.argmin(values).astype(jnp.int32)
        return jnp.where(places == least, jnp.inf, values), least

    return jax.lax.scan(take, values, length=count)[1]


def _refine(
    coefficients: Float[Array, " k"], directions: Float[Array, "v 3"], degree: int, reach: float
) -> tuple[Float[Array, "v 3"], Float[Array, " v"]]:
    """The least value near each direction: on a patch as wide as `reach`, and on finer ones."""
    dtype = coefficients.dtype
    u, v = np.meshgrid(*2 * [np.linspace(-1, 1, 9)])
    patch = jnp.asarray(np.stack([u.ravel(), v.ravel()], axis=-1), dtype)
    chosen = np.arange(len(directions), dtype=np.int32)

    def closer(directions, scale):
        # Any two directions that span the tangent plane will do.
        axis = jnp.eye(3, dtype=dtype)[jnp.argmin(jnp.abs(directions), axis=-1)]
        side = jnp.cross(directions, axis)
        side = side / jnp.linalg.norm(side, axis=-1, keepdims=True)
        tangents = jnp.stack([side, jnp.cross(directions, side)], axis=1)
        nearby = directions[:, None] + scale * jnp.einsum("pt,vtx->vpx", patch, tangents)
        nearby = nearby / jnp.linalg.norm(nearby, axis=-1, keepdims=True)
        basis = evaluate(nearby, degree, axis=0)
        samples = einsum("k,kvp->vp", coefficients, basis)
        best = jnp.argmin(samples, axis=-1)
        return nearby[chosen, best], samples[chosen, best]

    scales = jnp.asarray([reach, reach / 4, reach / 16], dtype)
    directions, values = jax.lax.scan(closer, directions, scales)
    return directions, values[-1]


def _band_sums(terms: Float[Array, " k"], degree: int) -> Float[Array, " bands"]:
    return jax.ops.segment_sum(terms, degrees(degree), degree + 1, indices_are_sorted=True)
