"""Search for the least window that leaves a light, or what is shaded by it, without negatives."""

import functools
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from .._core.checks import align, as_float, check_choice, check_coefficients, check_flag
from .._core.linalg import dot, einsum, matmul
from .._core.xla import keep_rows, on_mesh
from ._basis import evaluate
from ._indexing import degree_of, degrees, orders
from ._tables import legendre
from ._windows import softening
from ._zonal import clamped_cosine, convolve, phong

# Rounds of the search for the least strength, and valleys looked into in each.
_CUTS, _VALLEYS = 16, 8


def dering(
    coefficients: Float[ArrayLike, "*batch k"],
    *,
    of: Literal["irradiance", "light", "glossy"] = "irradiance",
    exponent: Float[ArrayLike, "*lobes"] | None = None,
    shared: bool = False,
) -> tuple[Float[Array, "*out k"], Float[Array, "*strengths"]]:
    """Window a light by the least `softening` that leaves what it is for without negative values.

    A truncated light rings: behind a bright source it goes below zero (Sloan 2008). What a surface
    makes of it rings less, since it sees the light convolved with its lobe: the wider the lobe, the
    less of a window is needed, often none. Where shadows cut into a lobe that no longer holds: a
    diffuse surface is then safe under `of="light"`, and a sun is better taken out of the picture
    before (`sphere.split_sun`). See `docs/ringing.md`.

    **Arguments**

    - `coefficients`: (..., K).
    - `of`: what must have no negative value: `"irradiance"`, that of unshadowed diffuse surfaces;
      `"glossy"`, the light over Phong's lobe cosᵏ of this `exponent`, in any direction; or
      `"light"`, the function itself, as for a picture of it or a mirror.
    - `exponent`: (...), k of `"glossy"`, and None otherwise. Batches broadcast. Where a mesh has
      several, the largest needs most. The cosine of a surface seen along its normal makes k + 1
      of k.
    - `shared`: one window for all functions on the last batch axis, the color channels of a light
      (3, K), which keeps their hue where all are damped: the largest of their strengths.

    **Returns** the windowed coefficients (..., K) and the strengths (...), without the channels'
    axis where it is `shared`. What is left below zero is under 1e-3 of the mean, and mostly far
    under. A strength, for `softening`, is 0 where no window is needed: the function is returned as
    it is. It is at most 1 for a light that had no negative value before it was projected, and 2,
    which leaves the mean, where the mean is not positive: such a function cannot be helped. NaN
    gives NaN. Differentiable once, in the exponent too, by the implicit function theorem, with
    kinks where the strength reaches 0, 1 or 2 or the darkest direction jumps; a second derivative
    raises `NotImplementedError`. Raises `ValueError` where K is not a square, for another `of`, for
    an exponent that is missing, not asked for or not above -1, and for one function with `shared`.

    **Cost** on five light probes (grace, galileo, eucalyptus, stpeters, uffizi): mean error in % of
    the mean, averaged over the probes, one window for the three channels; in brackets the largest
    negative share. `python -m experiments run ringing --preset paper` prints it, and more.

    | made of the light | degree | no window | `"lanczos"` | `"hann"` | `dering` of it |
    |---|---|---|---|---|---|
    | irradiance | 2 | 2.9 | 12.8 | 17.2 | 3.0 |
    | irradiance | 6 | 0.6 | 3.0 | 4.3 | 0.6 |
    | lobe, k = 8 | 2 | 37.6 (8.0) | 39.4 (0.2) | 44.5 (0.1) | 38.5 |
    | lobe, k = 8 | 6 | 2.0 | 12.3 | 16.7 | 2.9 |
    | lobe, k = 32 | 6 | 31.0 (6.4) | 34.7 (0.1) | 41.3 (0.1) | 36.0 |
    | lobe, k = 32 | 10 | 8.7 (0.6) | 18.4 | 24.2 | 12.9 |

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import harmonics
    >>> sun = harmonics.evaluate(jnp.array([0.0, 0.6, 0.8]), degree=4)  # small and bright
    >>> light = jnp.stack([sun, 0.9 * sun, 0.7 * sun])
    >>> diffuse, strength = harmonics.dering(light, shared=True)
    >>> _, by_exponent = harmonics.dering(light[0], of="glossy", exponent=jnp.array([8.0, 128.0]))
    >>> diffuse.shape, strength.shape, by_exponent.shape
    ((3, 25), (), (2,))
    >>> [round(float(s), 2) for s in (strength, *by_exponent)]
    [0.5, 0.86, 0.99]
    """
    coefficients = as_float(coefficients, "coefficients")
    degree = check_coefficients("coefficients", coefficients)
    check_choice("of", of, ("irradiance", "light", "glossy"))
    if (exponent is None) == (of == "glossy"):
        got = "none" if exponent is None else "one"
        raise ValueError(f'an exponent belongs to of="glossy", got {got} with of="{of}"')
    shared = check_flag("shared", shared)
    judged = coefficients
    if of == "irradiance":
        judged = convolve(coefficients, clamped_cosine(degree))
    elif exponent is not None:
        judged = convolve(coefficients, phong(exponent, degree, normalized=True))
    if shared and judged.ndim < 2:
        raise ValueError(
            f"a shared window is for several functions (..., C, K), got shape {judged.shape}"
        )

    spec = (*jax.typeof(judged).sharding.spec, *[None] * judged.ndim)[: judged.ndim]
    rows = next((axis for axis, name in enumerate(spec) if name is not None), 0)
    least = functools.partial(_least_strengths, degree=degree)
    return _windowed(
        coefficients, keep_rows(least, judged, like=judged, axis=rows, out=rows), shared
    )


@functools.partial(jax.jit, static_argnames="degree")
def _least_strengths(judged, degree: int):
    if judged.ndim > 1:
        return jax.vmap(functools.partial(_least_strengths, degree=degree))(judged)
    return _least_strength(judged, degree)


@functools.partial(jax.jit, static_argnums=2)
def _windowed(coefficients, strength, shared: bool):
    if shared:
        # No strength is below zero, which is what stands where there are no functions.
        strength = jnp.max(strength, axis=-1, initial=0)
    window = softening(
        strength[..., None] if shared else strength, degree_of(coefficients.shape[-1])
    )
    return jnp.multiply(*align(coefficients, window)), strength


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
    regular = (strength > 0) & (strength < 2) & (slope > 0)
    gradient = -softening(strength, degree) * basis / jnp.where(regular, slope, 1)
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
        direction = _darkest(coefficients * softening(strength, degree), degree)
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
    return dot(softening(strength, len(bands) - 1)[first], bands)


def _root(bands: Float[Array, " bands"], low: Float[Array, ""]) -> Float[Array, ""]:
    """Strength above `low`, which is not enough, from which on one direction is not dark.

    The value goes along straight lines: from that without a window, at 0, over that under the
    positive window, at 1, to the mean, at 2.
    """
    mean = bands[0]
    zero, one = (_value(jnp.asarray(at, bands.dtype), bands) for at in (0, 1))
    first = one > 0  # the first line ends above zero; it began below
    above, below = jnp.where(first, one, mean), jnp.where(first, zero, one)
    root = jnp.where(first, 0.0, 1.0) - below / jnp.where(above > below, above - below, 1)
    return jnp.maximum(low, jnp.where(mean > 0, jnp.clip(root, 0, 2), 2))


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
        nearby = directions[:, None] + scale * einsum("pt,vtx->vpx", patch, tangents)
        nearby = nearby / jnp.linalg.norm(nearby, axis=-1, keepdims=True)
        basis = evaluate(nearby, degree, axis=0)
        samples = einsum("k,kvp->vp", coefficients, basis)
        best = jnp.argmin(samples, axis=-1)
        return nearby[chosen, best], samples[chosen, best]

    scales = jnp.asarray([reach, reach / 4, reach / 16, reach / 64], dtype)
    directions, values = jax.lax.scan(closer, directions, scales)
    return directions, values[-1]


def _band_sums(terms: Float[Array, " k"], degree: int) -> Float[Array, " bands"]:
    return jax.ops.segment_sum(terms, degrees(degree), degree + 1, indices_are_sorted=True)
