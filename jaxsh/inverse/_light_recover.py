"""Compiled part of `fit_light`: from checked rows to the light and how surely it is known."""

import functools
import math
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float

from .._core.linalg import einsum, matmul
from .._core.xla import in_blocks
from ..harmonics import (
    clamped_cosine,
    convolve,
    degrees,
    dering,
    evaluate,
    num_coefficients,
    softening,
    window,
)
from ..sphere import fibonacci
from ._light_materials import solve_colored
from ._light_result import RecoveredLight
from ._light_solve import Solution, compress_rows, solve_plain, solve_with_prior, width_of
from ._nonnegative import nonnegative
from ._result import Confidence, Statistics
from ._solve import fixed_point

Loss = Literal["squares", "huber", "cauchy"]
Positive = Literal["irradiance", "light"]
Window = Literal["none", "hann", "lanczos", "zonal-sinc", "positive", "irradiance", "light"]

# Directions, at least, in which a light or its irradiance is kept from being negative.
_DIRECTIONS = 500
# Thresholds of 95 % efficiency on Gaussian errors, in these' deviations, and the median of the
# length of three such errors over √3.
_HUBER, _CAUCHY, _MEDIAN = 1.345, 2.385, 0.888
_SHARES = {
    "huber": lambda error: _HUBER / jnp.maximum(error, _HUBER),
    "cauchy": lambda error: 1 / (1 + (error / _CAUCHY) ** 2),
}


class Options(NamedTuple):
    """Options of `fit_light` that XLA must know."""

    degree: int
    given: bool  # rows are transfer coefficients, not normals
    loss: Loss
    positive: Positive | None
    window: Window
    materials: int
    tolerance: float
    max_steps: int


def recover(
    observed, rows, albedo, weights, materials, noise, variances, *, options: Options
) -> RecoveredLight:
    dtype, degree, given = observed.dtype, options.degree, options.given
    bands = degree if variances is None else len(variances)
    columns = _columns(bands, given)
    relative = None
    if variances is not None:
        every = jnp.concatenate([jnp.ones(1, dtype), variances.astype(dtype)])
        relative = every[degrees(bands)]

    def make(rows):
        if given:
            return rows[:, columns]
        up = jnp.asarray([[0.0, 0.0, 1.0]], dtype)
        fine = jnp.all(jnp.isfinite(rows), axis=1) & jnp.any(rows != 0, axis=1)
        return _irradiance_rows(jnp.where(fine[:, None], rows, up), bands)[:, columns]

    def solve(operator, target, count, scale, level=None) -> Solution:
        level = level if noise is None else noise / scale
        if relative is None:
            return solve_plain(operator, target, count, level)
        return solve_with_prior(operator, target, relative[columns], count, level)

    def solve_rows(observed, rows, albedo, trust, level=None) -> tuple[Solution, Array]:
        small = compress_rows(observed, rows, albedo, trust, make)
        operator = jnp.broadcast_to(small.operator, (3, *small.operator.shape[1:])) / small.scale
        count = jnp.sum(trust > 0).astype(dtype)
        return solve(operator, small.target, count, small.scale, level), small.scale

    data = jax.lax.stop_gradient((observed, rows, albedo))
    trust = jax.lax.stop_gradient(weights)
    iteration = {"tolerance": options.tolerance, "max_steps": options.max_steps}
    result, steps, colors = optx.RESULTS.successful, jnp.ones((), jnp.int32), None
    if options.materials:
        ended = solve_colored(
            *data, trust, materials, make, solve, count=options.materials, **iteration
        )
        found, scale, colors, result, steps = ended
    elif options.loss == "squares":
        found, scale = solve_rows(*data, trust)
    else:

        def judged(found, scale):
            """Shares with which pixels count, and σ where the data have length 1, from a fit."""
            error = _length(found.light, *data, trust, make) / scale
            level = _level(error, trust) if noise is None else noise / scale
            return _SHARES[options.loss](error / level), level

        def again(state):
            share, level = state
            found, scale = solve_rows(*data, trust * jnp.sqrt(share), level)
            return judged(found, scale), (found, scale)

        ended = fixed_point(again, judged(*solve_rows(*data, trust)), **iteration)
        found, scale = ended.aux
        result, steps = ended.result, ended.stats["num_steps"]
    light, met = found.light, jnp.zeros((), bool)
    if options.positive is not None:
        limits = _limits(options.positive, degree, bands, columns, dtype)
        light, met, done = nonnegative(light, found.inverse, limits, **iteration)
        most: Any = optx.RESULTS.nonlinear_max_steps_reached
        result = optx.RESULTS.where(done, result, most)
    if options.materials or options.loss != "squares" or options.positive is not None:
        light = _final(light, observed, rows, albedo, weights)
    else:
        still = light, found.inverse, found.pull
        light = _attached(make)(*still, scale, observed, rows, albedo, weights)
    statistics = Statistics(
        steps=steps,
        residual=found.residual,
        agreeing=jnp.ones((), jnp.int32),
        starts=1,
        at_bound=met,
    )
    return _whole(light, found, scale, relative, columns, options, colors, result, statistics)


def _irradiance_rows(directions: Float[Array, "n 3"], bands: int) -> Float[Array, "n k"]:
    return convolve(evaluate(directions, bands), clamped_cosine(bands).astype(directions.dtype))


def _limits(
    positive: Positive, degree: int, bands: int, columns: np.ndarray, dtype
) -> Float[Array, "n k"]:
    """Rows whose products with a light are its values, or its irradiance, in directions."""
    if positive == "irradiance":
        return _irradiance_rows(fibonacci(_DIRECTIONS).directions.astype(dtype), bands)[:, columns]
    count = num_coefficients(degree)
    directions = fibonacci(max(_DIRECTIONS, 8 * count)).directions.astype(dtype)
    own = evaluate(directions, degree)[:, columns[columns < count]]
    return jnp.pad(own, ((0, 0), (0, len(columns) - own.shape[1])))


def _columns(bands: int, given: bool) -> np.ndarray:
    """Coefficients that irradiance depends on: of normals none of odd degree but 1."""
    l = degrees(bands)
    return np.flatnonzero((l % 2 == 0) | (l == 1) | given)


def _length(light, observed, rows, albedo, weights, make) -> Float[Array, " v"]:
    """Root mean square over the channels of each pixel's error, weighted."""
    albedo = albedo.reshape((1,) * (2 - albedo.ndim) + albedo.shape)
    irradiance = in_blocks(lambda rows: matmul(make(rows), light.T), rows, size=2**12)
    error = jnp.where(weights[:, None] > 0, observed - albedo / math.pi * irradiance, 0)
    return weights * jnp.linalg.norm(error, axis=1) / math.sqrt(3)


def _level(error: Float[Array, " v"], weights: Float[Array, " v"]) -> Float[Array, ""]:
    """Standard deviation of errors most of which are Gaussian."""
    seen = weights > 0
    most = jnp.max(jnp.where(seen, error, 0))
    # By halving, not by sorting: a mesh of devices would have to gather what is sorted.
    span = -math.log(jnp.finfo(error.dtype).eps)

    def halve(_, bounds):
        low, high = bounds
        middle = (low + high) / 2
        few = 2 * jnp.sum(seen & (error <= most * jnp.exp(middle))) < jnp.sum(seen)
        return jnp.where(few, middle, low), jnp.where(few, high, middle)

    start = jnp.full((), -span, error.dtype), jnp.zeros((), error.dtype)
    _, median = jax.lax.fori_loop(0, 32, halve, start)
    # Where the data have length 1, less is rounding.
    return jnp.maximum(most * jnp.exp(median) / _MEDIAN, jnp.finfo(error.dtype).eps)


def _attached(make):
    """The light as it is, with the derivatives that the implicit function theorem gives it."""

    def slope(light, pull, scale, observed, rows, albedo, weights):
        """Minus half the slope of what is minimized, but for the prior, which takes no data."""
        albedo = albedo.reshape((1,) * (2 - albedo.ndim) + albedo.shape) / math.pi
        matrix = make(rows)
        error = jnp.where(weights[:, None] > 0, observed - albedo * matmul(matrix, light.T), 0)
        return matmul((albedo * weights[:, None] ** 2 * error).T, matrix) / scale**2

    @jax.custom_jvp
    def attached(light, inverse, pull, scale, *data):
        return light

    @attached.defjvp
    def _(primals, tangents):
        light, inverse, pull, scale, *data = primals
        follow = functools.partial(slope, light, pull, scale)
        _, moved = jax.jvp(follow, tuple(data), tuple(tangents[4:]))
        inverse = jnp.where(jnp.isfinite(inverse), inverse, 0)
        step = einsum("ckj,cj->ck", inverse, moved)
        # The prior is relative to the mean light, which moves too (Sherman and Morrison).
        mean = jnp.where(light[:, :1] == 0, 1, light[:, :1])
        follows = einsum("ckj,cj->ck", inverse, -2 * pull**2 * light / mean)
        step = step - follows * step[:, :1] / (1 + follows[:, :1])
        return light, step

    return attached


@jax.custom_jvp
def _final(light, *data):
    """The light as it is, whose derivatives nobody has written."""
    return light


@_final.defjvp
def _(primals, tangents):
    raise NotImplementedError(
        "fit_light has derivatives for loss='squares' alone, without nonnegative or materials"
    )


def _window(value, kind: Window, degree: int) -> Float[Array, " k"]:
    """Factors of a window by its name; of `dering`'s by what it is to help, for all channels."""
    if kind == "irradiance" or kind == "light":
        _, strength = dering(value, of=kind, shared=True)
        return softening(strength, degree)
    return window(kind, degree).astype(value.dtype)


def _whole(light, found, scale, relative, columns, options, colors, result, statistics):
    """The answer up to the degree that was asked for, with what was not seen at all."""
    dtype, count = light.dtype, num_coefficients(options.degree)
    columns = columns[columns < count]
    kept = len(columns)
    spread = jnp.full((3, count), jnp.inf, dtype)
    if relative is not None:
        mean = width_of(found.light[:, 0])[:, None]
        # Of a channel of which nothing is seen the mean is not known either.
        spread = jnp.where(found.determined[:, :1] > 0, relative[None, :count] * mean**2, jnp.inf)
    variance = found.noise**2
    inner = found.inverse[:, :kept, :kept]
    inner = jnp.where(jnp.isfinite(inner) & jnp.isfinite(variance), variance * inner, jnp.inf)
    value = jnp.zeros((3, count), dtype).at[:, columns].set(light[:, :kept])
    factor = _window(value, options.window, options.degree)
    value = value * factor[None]
    known = jnp.zeros((3, count), dtype).at[:, columns].set(found.determined[:, :kept])
    covariance = jnp.zeros((3, count, 3, count), dtype)
    for c in range(3):
        block = jnp.diag(spread[c]).at[columns[:, None], columns[None]].set(inner[c])
        covariance = covariance.at[c, :, c].set(factor[:, None] * block * factor[None])
    covariance = covariance.reshape(3 * count, 3 * count)
    deviation = jnp.sqrt(jnp.maximum(jnp.diagonal(covariance), 0)).reshape(3, count)
    # As found, and not followed where the light is differentiated.
    still = jax.lax.stop_gradient(
        (statistics, Confidence(covariance, deviation), known, scale * found.noise, colors)
    )
    return RecoveredLight(value, result, *still)
