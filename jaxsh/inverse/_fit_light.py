"""Light from all around, in spherical harmonics, from the shading of a diffuse surface."""

import functools
from typing import Any, Literal, get_args

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Bool, Float, Int

from .._core.checks import as_host_float, as_host_integer, check_choice, check_degree, check_number
from ..transfer import Transfer
from ._checks import check_end, check_solver
from ._light_prior import power_law
from ._light_recover import Loss, Options, Positive, Window, recover
from ._light_result import RecoveredLight
from ._pixels import as_rows
from ._solve import everywhere

# Bands of the light that a picture with normals is fitted with, under a prior. What lies above is
# 0.2 % of the radiance: the noise that `inverse.light` finds where there is none.
_BANDS = 12


def fit_light(
    observed: Float[ArrayLike, "*pixels 3"],
    surface: Transfer | Float[ArrayLike, "*pixels 3"],
    albedo: Float[ArrayLike, "..."],
    degree: int,
    *,
    mask: Bool[ArrayLike, "*pixels"] | None = None,
    weights: Float[ArrayLike, "*pixels"] | None = None,
    materials: Int[ArrayLike, "*pixels"] | None = None,
    prior: Literal["probes"] | Float[ArrayLike, " bands"] | None = "probes",
    noise: float | None = None,
    loss: Loss = "squares",
    nonnegative: Positive | None = None,
    window: Window = "none",
    tolerance: float | None = None,
    max_steps: int = 100,
    throw: bool = True,
) -> RecoveredLight:
    """Finds the light, in spherical harmonics, that shaded a diffuse surface of known albedo.

    Least squares, for shading is linear in the light: min Σ_v w_v² ‖observed_v − albedo_v/π ·
    T_v L‖² + σ² Σ_i L_i²/(s² p_i), by QR of the matrix itself, never of its square. The second
    sum is the prior. From one view half of the normals are missing, and what they would tell is
    then not zero or noise times a thousand, but what is usual: coefficients of degree l >= 1 are
    taken for Gaussian with variances p_l relative to the square of the mean light s, the constant
    coefficient of the same channel, which itself is free.

    Under a prior the bands above `degree` are unknowns too, and then cut off: a transfer's all, of
    normals those up to 12. The light that is there anyway would else be taken for that of lower
    bands, which is most of the error of plain least squares.

    **Arguments**

    - `observed`: radiance that leaves the surface, linear: (V, 3), or a picture (H, W, 3).
    - `surface`: the vertices' `Transfer`, or normals of the shape of `observed`, of any length, in
      the axes that the light shall have; these see all of the sphere above their own horizon. From
      a picture that codes them as colors n/2 + 1/2 decode them before: 2 color - 1.
    - `albedo`: a number, (3,), or of each vertex or pixel with one or three channels.
    - `degree`: of the light; 2 is what a diffuse surface without shadows can tell.
    - `mask`: False where nothing was observed. `weights`: one over the expected error, at least 0.
      Where either is zero, or a normal is not finite or zero, observed and albedo may hold any
      number.
    - `materials`: a number 0, 1, … for each place, where colors are not known: one unknown albedo
      for each material, in turn with the light, from gray on. Shading tells color times light
      alone, so the mean of the colors over the pixels, by their squared weights, is `albedo`, a
      number or (3,): scale light and colors to what else you know.
    - `prior`: `"probes"`, `light_variances`; or variances of your own of the bands 1, 2, …, as many
      as there are unknown bands, at least `degree`; or None for least squares alone.
    - `noise`: the standard deviation σ of what was observed at weight 1. By default it is
      estimated: by the largest marginal likelihood, or without a prior from the residuals. Of fewer
      than about ten pixels it may come out far too small, and the light as too sure: give it then.
    - `loss`: `"squares"`; or, against highlights and shadows that the surface does not account
      for, `"huber"` or `"cauchy"` of a pixel's length of error, with the thresholds 1.345 σ and
      2.385 σ. Iterated reweighting, from squares on; σ by the median unless given.
    - `nonnegative`: keeps `"irradiance"` in 500 directions, or the `"light"` itself in at least as
      many, from being negative, in the nearest way as the fit sees it. Real irradiance never is;
      light cut to a low degree often is, beside the true one.
    - `window`: to multiply the light by in the end: one of `harmonics.window`, or `"irradiance"` or
      `"light"`, the least of `harmonics.dering` that is needed there, the same for all channels.
    - `tolerance`, `max_steps`, `throw`: of what is iterated: weights of `loss`, logarithms of
      colors, coordinates of `nonnegative`; 1e-6, and √ε in float32, by default.

    **Returns** a `RecoveredLight` with the light (3, K) in the surface's dtype. Its `confidence` is
    the posterior's, σ and the mean light taken as known: it tells honestly what is unseen as far as
    the light is one like the probes. `determined` tells coefficient by coefficient what the data
    decided. Without a prior what they do not is as little as it can be, with an infinite deviation;
    so is σ, unless given, where pixels are no more than unknowns. Normals alone tell nothing of odd
    bands from 3 on. `statistics.at_bound` tells that `nonnegative` had to act; the confidence does
    not know of it. That of unknown materials is the light's, colors included.

    Differentiable in observed, albedo, weights and the surface, for `loss="squares"` without
    `nonnegative` or `materials`: the value, with an estimated σ taken as a constant; all else in
    the result is one. Otherwise a derivative raises `NotImplementedError`. `jit` and `vmap` as you
    like.

    Raises `ValueError` for shapes that do not fit, and, where values are known, for data that are
    not finite, all zero, or weighted by less than 0.

    Vertices, or rows of a picture, may be shared out over a mesh of devices.

    **Error** of a light of degree 2, in % of its length, at 1 % of noise: means over five probes,
    each left out of its prior, seen on 1000 vertices of a head (`python -m experiments run
    inverse.light --preset paper --turns 2`).

    | | one view | two | four |
    |---|---|---|---|
    | normals, least squares | 18.6 | 4.2 | 3.0 |
    | normals, prior | 5.7 | 0.3 | 0.3 |
    | with shadows, least squares | 18.0 | 6.0 | 4.6 |
    | with shadows, prior | 7.6 | 0.7 | 0.7 |

    The worst from one view are 45 and 10 % by normals, 32 and 14 % with shadows. Where noise is
    next to nothing, what no band holds is all that is left: it errs all in one way, and by up to
    2.5 deviations. The prior takes channels for independent: what is unseen may be tinted.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import inverse, sphere
    >>> light = jnp.asarray([[3.0, 1.0, 0.5, 0.2], [3.0, 0.8, 0.5, 0.1], [3.0, 0.5, 0.5, 0.0]])
    >>> normals = sphere.fibonacci(100).directions
    >>> observed = 0.5 / jnp.pi * sphere.irradiance(light, normals)
    >>> found = inverse.fit_light(observed, normals, 0.5, 1)
    >>> [round(float(c), 2) for c in found.value[0]]
    [3.0, 1.0, 0.5, 0.2]
    """
    degree = check_degree(degree)
    check_solver(tolerance, max_steps, throw)
    check_choice("loss", loss, get_args(Loss))
    check_choice("window", window, get_args(Window))
    if nonnegative is not None:
        check_choice("nonnegative", nonnegative, get_args(Positive))
    if noise is not None:
        noise = check_number("noise", noise, above=0.0)
    given = isinstance(surface, Transfer)
    if given and surface.degree < degree:
        raise ValueError(
            f"a light of degree {degree} needs a transfer of that degree, got degree "
            f"{surface.degree}"
        )
    variances = _variances(prior, degree, surface.degree if given else max(degree, _BANDS))
    rows = as_rows(observed, surface, albedo, weights, mask, 0)
    dtype = rows.observed.dtype
    labels, count = None, 0
    if materials is not None:
        labels, count = _labels(materials, np.shape(observed)[:-1])
        if rows.albedo.shape not in ((), (3,)) or loss != "squares":
            raise ValueError(
                "expected albedo as a number or (3,) and loss as 'squares' with materials, got "
                f"shape {rows.albedo.shape} and {loss!r}"
            )
    default = max(1e-6, float(jnp.finfo(dtype).eps) ** 0.5)
    options = Options(
        degree=degree,
        given=given,
        loss=loss,
        positive=nonnegative,
        window=window,
        materials=count,
        tolerance=default if tolerance is None else tolerance,
        max_steps=max_steps,
    )
    recovered = _fit(
        rows.observed,
        rows.transfer.coefficients if given else rows.transfer.normals,
        rows.albedo,
        rows.weights,
        labels,
        None if noise is None else jnp.asarray(noise, dtype),
        variances,
        options,
    )
    check_end(recovered, "the light was", throw=throw)
    return recovered


def _labels(materials: Any, places: tuple[int, ...]) -> tuple[Int[np.ndarray, " v"], int]:
    """Numbers of the materials, and how many there are."""
    given = as_host_integer(materials, "materials")
    if given.shape != places:
        raise ValueError(f"expected materials {places}, got shape {given.shape}")
    if given.size and not 0 <= given.min() <= given.max() < given.size:
        raise ValueError(f"materials must be numbered 0, 1, …, got {given.min()} to {given.max()}")
    return given.reshape(-1).astype(np.int32), int(given.max(initial=0)) + 1


def _variances(prior: Any, degree: int, most: int) -> Float[np.ndarray, " bands"] | None:
    """Variances of the bands 1 to the last unknown one; None without a prior, or with no band."""
    if prior is None or most == 0:
        return None
    if isinstance(prior, str):
        check_choice("prior", prior, ("probes",))
        return power_law(most)
    given = as_host_float(prior, "prior")
    if given.ndim != 1 or not max(degree, 1) <= len(given) <= most:
        raise ValueError(
            f"expected prior as variances of {max(degree, 1)} to {most} bands, got shape "
            f"{given.shape}"
        )
    if not (np.isfinite(given).all() and given.min() > 0):
        raise ValueError(f"variances of a prior must be finite and > 0, got {given.min():g}")
    return given


@eqx.filter_jit
def _fit(*arguments) -> RecoveredLight:
    *data, options = arguments
    return everywhere(functools.partial(recover, options=options), *data)
