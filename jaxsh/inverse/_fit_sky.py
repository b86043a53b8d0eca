"""Sun and turbidity from the shaded vertices of a mesh."""

import functools
import math
from collections.abc import Callable
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .. import sky as sky_room
from .._core.checks import check_function, check_number, check_size
from .._core.linalg import matmul
from ..transfer import Transfer
from ._charts import even_hemisphere, from_hemisphere, tangents, to_hemisphere, to_interval
from ._checks import check_bounds, check_data, check_end, check_solver
from ._result import Confidence, Recovered, Statistics
from ._shading import Shading, compress
from ._solve import confidence, everywhere, levenberg_marquardt

Sky = Callable[..., Array]

# How close to a bound is on it: a share of the turbidity's range, the sine of the sun's height.
_AT_BOUND = 1e-5


class SkyLight(eqx.Module):
    """Parameters of a sky: sun (3,), a unit vector; turbidity; exposure.

    In a `Confidence` the deviations of each: √(x² + y² + z²) of the sun's is the RMS angle, in
    radians, by which it may be off. Found by `fit_sky`.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import inverse, sky
    >>> light = inverse.SkyLight(jnp.asarray([0.6, 0.0, 0.8]), jnp.asarray(3.0), jnp.asarray(1.0))
    >>> (light.exposure * sky.preetham_harmonics(light.sun, light.turbidity, 1)).shape
    (3, 4)
    """

    sun: Float[Array, " 3"]
    turbidity: Float[Array, ""]
    exposure: Float[Array, ""]


def fit_sky(
    observed: Float[ArrayLike, "v 3"],
    transfer: Transfer,
    albedo: Float[ArrayLike, "..."],
    *,
    sky: Sky | None = None,
    turbidity: tuple[float, float] = (2.5, 6.0),
    exposure: float | None = 1.0,
    weights: Float[ArrayLike, " v"] | None = None,
    starts: int = 24,
    tolerance: float | None = None,
    max_steps: int = 512,
    throw: bool = True,
) -> Recovered[SkyLight]:
    """Finds the sun's direction and the turbidity that shaded a diffuse mesh, by least squares.

    Minimises Σ_v w_v² ‖observed_v − exposure · shade_diffuse(sky(sun, turbidity))_v‖² with
    Levenberg and Marquardt's method. The sky's own light alone: take away what the sun's disc
    adds, or give a `sky` that has it.

    **Arguments**

    - `observed`: radiance (V, 3) that leaves the vertices, linear, in kcd/m² if `exposure` is
      to be 1. `transfer`, `albedo`: as for `transfer.shade_diffuse`.
    - `sky`: `sky(sun, turbidity) -> (3, K)` of the transfer's degree or below, differentiable
      by JAX in forward mode; pass the same function object to have it compiled once. By default
      `sky.preetham_harmonics` at the transfer's degree, or at 6 where that is higher.
    - `turbidity`: its bounds. The default sky takes them from [2, 10].
    - `exposure`: a known factor, or None to recover it too.
    - `weights`: of each vertex (V,), one over the expected error, at least 0. Vertices that are
      not observed have weight 0, and may then hold any number.
    - `starts`: the sun's first directions, spread over the hemisphere, with turbidities in turn
      at the quarters of the range. The best end of all is taken.
    - `tolerance`: of the last step, absolute and relative; 1e-5, and √ε in float32, by default.
    - `throw`: raise `RuntimeError` where the solver did not converge. Inside `jit` nothing can
      be raised, and with False nothing is: then look at the `result`.

    **Returns** a `Recovered` with a `SkyLight`, in the transfer's dtype. `jit` and `vmap` as you
    like; not differentiable.

    Parameters are free of bounds and of the zenith's singularity. A sun on the horizon
    and a turbidity at its bound are reached, in more steps. Within a degree of the zenith most
    starts end on the kink that the model has there; the others find the sun. An exposure is
    positive, and with it free all that brightness tells is lost; see what `confidence` says.

    Raises `ValueError` for shapes that do not fit, and, where values are known, for data that
    are not finite, all zero, or weighted by less than 0.

    Vertices may be shared out over a mesh of devices: each makes a small triangle of its own.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import inverse, sphere, transfer
    >>> normals = sphere.fibonacci(20).directions
    >>> ball = transfer.unshadowed(0.5 * normals, normals, 1)
    >>> def glow(sun, turbidity):
    ...     x, y, z = sun
    ...     row = jnp.stack([jnp.ones_like(x), turbidity * y, turbidity * z, turbidity * x])
    ...     return jnp.stack([row] * 3)
    >>> light = glow(jnp.asarray([0.6, 0.0, 0.8]), jnp.asarray(3.0))
    >>> observed = transfer.shade_diffuse(light, ball, 0.5)
    >>> found = inverse.fit_sky(observed, ball, 0.5, sky=glow, starts=2)
    >>> [round(float(x), 2) + 0.0 for x in found.value.sun], round(float(found.value.turbidity), 2)
    ([0.6, 0.0, 0.8], 3.0)
    """
    observed, albedo, weights = check_data(observed, transfer, albedo, weights)
    check_solver(tolerance, max_steps, throw)
    bounds = check_bounds("turbidity", turbidity)
    if exposure is not None:
        exposure = check_number("exposure", exposure, above=0.0)
    starts = check_size("starts", starts)
    if sky is not None:
        check_function("sky", sky)
    if sky is None:
        sky = preetham(min(transfer.degree, 6), bounds)
    recovered = _fit(
        observed,
        transfer.coefficients,
        albedo,
        weights,
        sky=sky,
        bounds=bounds,
        exposure=exposure,
        starts=starts,
        tolerance=default_tolerance(observed.dtype) if tolerance is None else tolerance,
        max_steps=max_steps,
    )
    check_end(recovered, "the sky was", throw=throw)
    return recovered


def default_tolerance(dtype) -> float:
    """Tolerance of the last step: where steps converge as Newton's do, the next is its square."""
    return max(1e-5, float(jnp.finfo(dtype).eps) ** 0.5)


def preetham(degree: int, bounds: tuple[float, float]) -> Sky:
    """Preetham's sky of a degree, by the table that holds all turbidities within the bounds."""
    return _preetham(degree, "wide" if bounds[0] < 2.5 or bounds[1] > 6 else None)


@functools.cache
def _preetham(degree: int, table: Literal["wide"] | None) -> Sky:
    return functools.partial(sky_room.preetham_harmonics, degree=degree, table=table)


@eqx.filter_jit
def _fit(observed, coefficients, albedo, weights, **options) -> Recovered[SkyLight]:
    fit = functools.partial(_recover, **options)
    return everywhere(fit, observed, coefficients, albedo, weights)


def _recover(
    observed, coefficients, albedo, weights, *, sky, bounds, exposure, starts, tolerance, max_steps
) -> Recovered[SkyLight]:
    shading = compress(observed, coefficients, albedo, weights)

    def decode(p) -> SkyLight:
        factor = jnp.asarray(exposure, p.dtype) if exposure is not None else jnp.exp(p[3])
        return SkyLight(to_hemisphere(p[:2]), to_interval(p[2], *bounds), factor)

    first = _starts(starts, observed.dtype)
    if exposure is None:
        brightness = jax.vmap(lambda p: _brightness(shading, sky, to_sky(p, bounds)))(first)
        first = jnp.concatenate([first, jnp.log(brightness)[:, None]], axis=1)
    solved = levenberg_marquardt(
        lambda p, _: _residual(shading, sky, decode(p)),
        first,
        tolerance=tolerance,
        max_steps=max_steps,
    )
    value = decode(solved.parameters)
    squared = jnp.sum(solved.residual**2)
    low, high = bounds
    edge = _AT_BOUND * (high - low)
    statistics = Statistics(
        steps=solved.steps,
        residual=jnp.sqrt(squared),
        agreeing=solved.agreeing,
        starts=starts,
        at_bound=(value.turbidity < low + edge)
        | (value.turbidity > high - edge)
        | (value.sun[2] < _AT_BOUND),
    )
    free = 3 * jnp.sum(weights > 0) - first.shape[1]
    variance = squared / jnp.maximum(free, 1).astype(squared.dtype)
    spread = _confidence(shading, sky, value, variance, exposure is None)
    return Recovered(value, solved.result, statistics, spread)


def to_sky(p: Float[Array, " p"], bounds: tuple[float, float]) -> SkyLight:
    """Maps free numbers to a sky of exposure 1."""
    return SkyLight(to_hemisphere(p[:2]), to_interval(p[2], *bounds), jnp.ones((), p.dtype))


def _residual(shading: Shading, sky: Sky, light: SkyLight) -> Float[Array, " r"]:
    return shading.residual(light.exposure * sky(light.sun, light.turbidity)).ravel()


def _brightness(shading: Shading, sky: Sky, light: SkyLight) -> Float[Array, ""]:
    """Finds the exposure that fits this sky best, or 1 where that is not positive."""
    target = shading.target
    shaded = shading.shaded(light.exposure * sky(light.sun, light.turbidity))
    along, own = jnp.sum(shaded * target), jnp.sum(shaded * shaded)
    return jnp.where((along > 0) & (own > 0), along / jnp.where(own > 0, own, 1), 1)


def _starts(count: int, dtype) -> Float[Array, "s 3"]:
    suns = from_hemisphere(even_hemisphere(count))
    # sin p = ±1/2 at the quarters of the range.
    quarter = math.pi / 6 * (-1.0) ** np.arange(count)
    return jnp.asarray(np.column_stack([suns, quarter]), dtype)


def _confidence(shading, sky, value: SkyLight, variance, free: bool) -> Confidence[SkyLight]:
    """Confidence by steps on the sphere itself, which unlike the charts have no edge or fold."""
    along = tangents(value.sun)

    def moved(step) -> SkyLight:
        sun = value.sun + matmul(step[:2], along)
        factor = value.exposure * jnp.exp(step[3]) if free else value.exposure
        return SkyLight(sun, value.turbidity + step[2], factor)

    still = jnp.zeros(3 + free, value.sun.dtype)
    return confidence(lambda light: _residual(shading, sky, light), moved, still, variance)
