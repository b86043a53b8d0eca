"""Sun, sky and ground from one picture of a diffuse object."""

import functools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from .._core.checks import check_function, check_number, check_size
from .._core.known import is_concrete
from .._core.linalg import matmul
from .._core.xla import on_mesh
from ..harmonics import degree_of, evaluate
from ..sky import with_ground
from ..transfer import Transfer
from ._charts import even_hemisphere, from_hemisphere, tangents, to_hemisphere, to_interval
from ._checks import check_bounds, check_end, check_solver
from ._daylight import DISC, Daylight
from ._fit_sky import Sky, default_tolerance, preetham
from ._pixels import Rows, as_rows, of_places
from ._result import Recovered, Statistics
from ._shading import Shading, compress
from ._solve import confidence, everywhere, levenberg_marquardt

# Suns that are looked at for where to start, 10 degrees apart, and the cosine of 25 degrees: of
# those as close as this only the best is followed.
_LOOKS, _CLOSE = 192, math.cos(math.radians(25))
# Albedo of the ground at the start; the least light of the sun, as a share of all.
_GROUND, _LEAST = 0.25, 0.01
# How close to a bound is on it: a share of what lies between bounds, the sine of the sun's height,
# the sun's light as a share of all.
_AT_BOUND = 1e-5
# With normals alone, the least degree of the sun's light in the search for where to start.
_DEGREE = 4


def fit_daylight(
    observed: Float[ArrayLike, "*pixels 3"],
    surface: Transfer | Float[ArrayLike, "*pixels 3"],
    albedo: Float[ArrayLike, "..."],
    *,
    sunlit: Float[ArrayLike, "*pixels"] | None = None,
    sky: Sky | None = None,
    turbidity: tuple[float, float] = (2.5, 6.0),
    exposure: float | None = None,
    mask: Bool[ArrayLike, "*pixels"] | None = None,
    weights: Float[ArrayLike, "*pixels"] | None = None,
    starts: int = 4,
    tolerance: float | None = None,
    max_steps: int = 256,
    throw: bool = True,
) -> Recovered[Daylight]:
    """Finds sun, sky and ground from one picture of a diffuse object outdoors, by least squares.

    The sky is `exposure · sky(sun, turbidity)`; the sun's disc has a radiance of its own in each
    channel, at least 0; the ground is diffuse, of an albedo in [0, 1] in each channel, and lit by
    both (`sky.with_ground`). Levenberg and Marquardt's method finds the unknowns together.

    Where the surface is given by normals, the sun lights it by the exact clamped cosine, without
    shadows. Through a transfer its light is cut to the transfer's degree, shadows too. Better than
    both is `sunlit`, how much of the sun each place sees: the clamped cosine is then taken times
    that. To have it the sun must be known already: fit, trace the shadows from there, fit again.

    **Arguments**

    - `observed`: radiance that leaves the surface, linear: (V, 3), or a picture (H, W, 3).
    - `surface`: the vertices' `Transfer`, or normals, of the shape of `observed`, as for
      `fit_light`.
    - `albedo`: a number, (3,), or of each vertex or pixel with one or three channels.
    - `sunlit`: from 0 to 1, of each vertex or pixel.
    - `sky`, `turbidity`: as for `fit_sky`; of a transfer of degree 1 or more.
    - `exposure`: a known factor, 1 where observed is in kcd/m²; None, the default, recovers it.
    - `mask`: False where nothing was observed. `weights`: one over the expected error, at least 0.
      Where either is zero, or a normal is not finite or zero, observed and albedo may hold any
      number.
    - `starts`: how many suns are followed to the end, the best of 192 that are looked at.
    - `tolerance`, `max_steps`, `throw`: as for `fit_sky`.

    **Returns** a `Recovered` with a `Daylight`, in the surface's dtype. `jit` and `vmap` as you
    like; not differentiable.

    What a picture does not tell, `confidence` and `statistics.at_bound` say. Where no normal faces
    the sun, or none is out of its light, or the sky is overcast, its direction is that of the sky's
    glow, and less sure. Under clouds its radiance ends at 0, a bound; so may the ground's albedo,
    which normals that look up hardly tell. What nothing tells has an infinite deviation. An error
    of the model is not in the deviations: another sky than Preetham's, a white balance that is off,
    or shadows that are not accounted for shift the turbidity most
    (`python -m experiments run inverse.daylight`). Very low suns are redder than sRGB holds, by up
    to some percent of red; here no channel is below 0.

    Raises `ValueError` for shapes that do not fit, and, where values are known, for data that are
    not finite, all zero, or weighted by less than 0, and for `sunlit` out of [0, 1].

    Vertices may be shared out over a mesh of devices.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import inverse, sphere
    >>> def glow(sun, turbidity):
    ...     x, y, z = sun
    ...     row = jnp.stack([jnp.ones_like(x), turbidity * y, turbidity * z, turbidity * x])
    ...     return jnp.stack([row] * 3)
    >>> normals = sphere.fibonacci(100).directions
    >>> sun, ground = jnp.asarray([0.6, 0.0, 0.8]), jnp.asarray([0.3, 0.2, 0.1])
    >>> truth = inverse.Daylight(sun, jnp.asarray(3.0), jnp.asarray(1.0), jnp.full(3, 1e5), ground)
    >>> light = truth.harmonics(12, sky=glow)
    >>> observed = 0.5 / jnp.pi * sphere.irradiance(light, normals)
    >>> found = inverse.fit_daylight(observed, normals, 0.5, sky=glow, starts=1)
    >>> [round(float(x), 2) + 0.0 for x in found.value.sun], round(float(found.value.turbidity), 1)
    ([0.6, 0.0, 0.8], 3.0)
    """
    check_solver(tolerance, max_steps, throw)
    bounds = check_bounds("turbidity", turbidity)
    if exposure is not None:
        exposure = check_number("exposure", exposure, above=0.0)
    starts = check_size("starts", starts)
    if sky is None:
        sky = preetham(min(surface.degree, 6) if isinstance(surface, Transfer) else 6, bounds)
    check_function("sky", sky)
    rows = as_rows(observed, surface, albedo, weights, mask, max(_degree(sky), _DEGREE))
    if rows.transfer.degree < 1:
        raise ValueError("daylight needs a transfer of degree >= 1, got degree 0")
    dtype = rows.observed.dtype
    if sunlit is not None:
        sunlit = of_places("sunlit", sunlit, np.shape(observed)[:-1])
        if is_concrete(sunlit) and not bool(jnp.all((sunlit >= 0) & (sunlit <= 1))):
            raise ValueError(
                f"sunlit must be from 0 to 1, got {float(sunlit.min()):g} to "
                f"{float(sunlit.max()):g}"
            )
        sunlit = sunlit.astype(dtype)
    elif rows.transfer is not surface:
        sunlit = jnp.ones_like(rows.weights)
    recovered = _fit(
        rows,
        sunlit,
        sky=sky,
        bounds=bounds,
        exposure=exposure,
        starts=starts,
        tolerance=default_tolerance(dtype) if tolerance is None else tolerance,
        max_steps=max_steps,
    )
    check_end(recovered, "the daylight was", throw=throw)
    return recovered


def _degree(sky: Sky) -> int:
    """Degree of what a sky gives."""
    number = jax.ShapeDtypeStruct((), jnp.result_type(float))
    shape = jax.eval_shape(sky, jax.ShapeDtypeStruct((3,), number.dtype), number).shape
    if len(shape) != 2 or shape[0] != 3:
        raise ValueError(f"expected sky(sun, turbidity) to give (3, K), got shape {shape}")
    return degree_of(shape[1])


@eqx.filter_jit
def _fit(rows, sunlit, **options) -> Recovered[Daylight]:
    return everywhere(functools.partial(_recover, **options), rows, sunlit)


class _Picture(eqx.Module):
    """Compares any daylight with what was observed, in units of ‖w observed‖."""

    shading: Shading  # of all light by harmonics
    rows: Rows
    sunlit: Float[Array, " v"] | None
    sky: Sky = eqx.field(static=True)

    def residual(self, value: Daylight) -> Float[Array, " r"]:
        count = self.rows.transfer.coefficients.shape[-1]
        diffuse, sun = value.parts(count, self.sky)
        if self.sunlit is None:
            return self.shading.residual(diffuse + sun).ravel()
        observed, transfer, albedo, weights = self.rows
        normals = transfer.normals
        length = jnp.linalg.norm(normals, axis=1)
        cosine = jnp.maximum(matmul(normals, value.sun), 0)
        cosine = self.sunlit * cosine / jnp.where(length > 0, length, 1)
        irradiance = matmul(transfer.coefficients, diffuse.T)
        irradiance = irradiance + cosine[:, None] * value.facing[None]
        albedo = albedo.reshape((1,) * (2 - albedo.ndim) + albedo.shape)
        error = albedo / math.pi * irradiance - observed
        return jnp.where(weights[:, None] > 0, weights[:, None] * error, 0).ravel() / (
            self.shading.scale
        )


def _recover(rows, sunlit, *, sky, bounds, exposure, starts, tolerance, max_steps):
    observed, transfer, albedo, weights = rows
    shading = compress(observed, transfer.coefficients, albedo, weights)
    picture = _Picture(shading, rows, sunlit, sky)
    unit = _unit(shading)

    def decode(p) -> Daylight:
        factor = jnp.asarray(exposure, p.dtype) if exposure is not None else jnp.exp(p[9])
        radiance = unit / (DISC * factor) * p[3:6] ** 2
        haze, ground = to_interval(p[2], *bounds), to_interval(p[6:9], 0.0, 1.0)
        return Daylight(to_hemisphere(p[:2]), haze, factor, radiance, ground)

    first = _starts(shading, sky, bounds, exposure, unit, starts)
    solved = levenberg_marquardt(
        lambda p, _: picture.residual(decode(p)),
        first,
        tolerance=tolerance,
        max_steps=max_steps,
        normal=sunlit is not None or on_mesh(rows),
    )
    value = decode(solved.parameters)
    squared = jnp.sum(solved.residual**2)
    low, high = bounds
    edge = _AT_BOUND * (high - low)
    at_bound = (value.turbidity < low + edge) | (value.turbidity > high - edge)
    at_bound = at_bound | (value.sun[2] < _AT_BOUND)
    at_bound = at_bound | jnp.any(value.facing < _AT_BOUND * unit)
    at_bound = at_bound | jnp.any(jnp.abs(value.ground - 0.5) > 0.5 - _AT_BOUND)
    statistics = Statistics(
        steps=solved.steps,
        residual=jnp.sqrt(squared),
        agreeing=solved.agreeing,
        starts=starts,
        at_bound=at_bound,
    )
    free = jnp.maximum(3 * jnp.sum(weights > 0) - first.shape[1], 1)
    along = tangents(value.sun)

    def moved(step) -> Daylight:
        """Steps on the sphere itself, which unlike the charts have no edge or fold."""
        factor = value.exposure * (jnp.exp(step[9]) if exposure is None else 1)
        return Daylight(
            value.sun + matmul(step[:2], along),
            value.turbidity + step[2],
            factor,
            value.sun_radiance + unit / (DISC * value.exposure) * step[3:6],
            value.ground + step[6:9],
        )

    variance = squared / free.astype(squared.dtype)
    spread = confidence(picture.residual, moved, jnp.zeros_like(first[0]), variance)
    return Recovered(value, solved.result, statistics, spread)


def _unit(shading: Shading) -> Float[Array, ""]:
    """Irradiance that, the same from all sides, makes about as much light as was observed."""
    white = jnp.zeros((3, 1), shading.target.dtype).at[:].set(2 * math.sqrt(math.pi))
    shaded = jnp.linalg.norm(shading.shaded(white))
    return math.pi / jnp.where(shaded > 0, shaded, 1)


def _starts(shading, sky, bounds, exposure, unit, count) -> Float[Array, "s p"]:
    """Free numbers of the `count` best suns that are looked at, the best of their own region each.

    For a sun and a turbidity all that is left is linear, but for bounds: the brightness of the sky
    and of the sun, both with what they make of the ground.
    """
    dtype, size = shading.target.dtype, shading.operator.shape[-1]
    suns = even_hemisphere(_LOOKS)
    charts = jnp.asarray(from_hemisphere(suns), dtype)
    ground = jnp.full(3, _GROUND, dtype)
    target = shading.target

    def shaded(light):
        return shading.shaded(with_ground(light, ground))

    def look(sun, haze):
        above = sky(sun, to_interval(haze, *bounds))[:, :size]
        a = shaded(jnp.pad(above, ((0, 0), (0, size - above.shape[1]))))
        basis = evaluate(sun, math.isqrt(size) - 1)
        b = unit * shaded(jnp.broadcast_to(basis[None], (3, size)))
        ab, bb, bt = (jnp.sum(b * x, axis=1) for x in (a, b, target))
        bb = jnp.where(bb > 0, bb, 1)
        if exposure is None:
            rest = a - (ab / bb)[:, None] * b
            factor = _ratio(jnp.sum(rest * target), jnp.sum(rest * rest))
            alone = _ratio(jnp.sum(a * target), jnp.sum(a * a))
            factor = jnp.where(factor > 0, factor, jnp.where(alone > 0, alone / 2, 1))
        else:
            factor = jnp.asarray(exposure, dtype)
        power = jnp.maximum((bt - factor * ab) / bb, 0)
        cost = jnp.sum((factor * a + power[:, None] * b - target) ** 2)
        p = jnp.concatenate([jnp.sqrt(jnp.maximum(power, _LEAST)), jnp.arcsin(2 * ground - 1)])
        return cost, (p if exposure is not None else jnp.append(p, jnp.log(factor)))

    # sin p = ±1/2 at the quarters of the range.
    quarters = jnp.asarray([-math.pi / 6, math.pi / 6], dtype)
    over = jax.vmap(jax.vmap(look, (None, 0)), (0, None))
    costs, rest = over(jnp.asarray(suns, dtype), quarters)
    better = jnp.argmin(costs, axis=1)
    rows = jnp.arange(_LOOKS)
    costs, rest = costs[rows, better], rest[rows, better]
    near = suns @ suns.T > _CLOSE
    least = jnp.min(jnp.where(jnp.asarray(near), costs[None], jnp.inf), axis=1)
    _, best = jax.lax.top_k(-jnp.where(costs <= least, costs, jnp.inf), min(count, _LOOKS))
    first = jnp.concatenate([charts, quarters[better][:, None], rest], axis=1)
    return first[best]


def _ratio(over, under):
    return over / jnp.where(under > 0, under, 1)
