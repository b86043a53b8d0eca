"""Position, size and color of rectangular lights from the shaded vertices of a mesh."""

import functools
import math
import warnings
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import check_all, check_flag, check_type
from .._core.known import is_concrete
from .._core.linalg import einsum
from .._core.xla import in_turn, on_mesh, rows_at_once
from ..midrange import Polygon
from ..transfer import Transfer
from ._checks import check_data, check_end, check_solver
from ._rectangle import Rectangle, moved, rectangle_of
from ._result import Recovered, Statistics
from ._shading import irradiance
from ._solve import confidence, everywhere, levenberg_marquardt


def fit_polygons(
    observed: Float[ArrayLike, "v 3"],
    transfer: Transfer,
    albedo: Float[ArrayLike, "..."],
    start: Sequence[Polygon] | Sequence[Sequence[Polygon]],
    *,
    turn: bool = True,
    weights: Float[ArrayLike, " v"] | None = None,
    tolerance: float | None = None,
    max_steps: int = 256,
    throw: bool = True,
) -> Recovered[tuple[Rectangle, ...]]:
    """Finds the rectangular lights that shaded a diffuse mesh: place, pose, size and color.

    Minimises Σ_v w_v² ‖observed_v − albedo/π Σ_lights L T_v · c(light, x_v)‖² with Levenberg and
    Marquardt's method, where c are the exact coefficients at the vertex itself
    (`midrange.polygon_harmonics`, of the transfer's degree). Sizes and radiances are positive:
    their logarithms are the unknowns.

    **Arguments**

    - `observed`: radiance (V, 3) that leaves the vertices. `transfer`, `albedo`: as for
      `transfer.shade_diffuse`; vertices at the transfer's positions.
    - `start`: first guesses of the lights, rectangles as polygons of four vertices with positive
      radiance; or several such guesses, all with the same number of lights, from each of which
      the fit starts. The best end of all is taken.
    - `turn`: recover the pose too; with False each light keeps that of its guess. Nearly the same
      light leaves a small rectangle far away however it is turned: then leave this out, or take
      the size for known by its deviation.
    - `weights`: of each vertex (V,), at least 0; vertices that are not observed have weight 0.
    - `tolerance`, `max_steps`, `throw`: as for `fit_sky`.

    **Returns** a `Recovered` with a `Rectangle` for each light, in the transfer's dtype and in
    the order of the guess. Its `confidence` has n = 14 numbers for each light: center, axes, size,
    radiance. Not differentiable.

    A light that shines on no vertex has no slope and stays as it is. Where values are known, a
    warning names the guesses whose plane or whose vertices' own horizons leave no light.
    From a guess too far off the solver may come to rest in another valley and call that converged:
    look at the residual, which is to be that of the noise, and at the confidence.

    Raises `ValueError` for shapes that do not fit, and, where values are known, for data that are
    not finite or all zero, and guesses without positive radiance.

    Vertices may be shared out over a mesh of devices: each step then comes from its normal
    equations, which sum over vertices.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import inverse, midrange, sphere, transfer
    >>> normals = sphere.fibonacci(20).directions
    >>> ball = transfer.unshadowed(0.5 * normals, normals, 1)
    >>> corners = [[-1.0, -1.0, 2.0], [-1.0, 1.0, 2.0], [1.0, 1.0, 2.0], [1.0, -1.0, 2.0]]
    >>> lamp = midrange.Polygon(jnp.asarray(corners), jnp.asarray([3.0, 2.0, 1.0]))
    >>> light = midrange.polygon_harmonics(lamp, ball.positions, 1)
    >>> observed = transfer.shade_diffuse(light, ball, 0.5)
    >>> guess = midrange.Polygon(lamp.vertices + 0.1, jnp.ones(3))
    >>> found = inverse.fit_polygons(observed, ball, 0.5, [guess], turn=False)
    >>> [round(float(channel), 2) for channel in found.value[0].radiance]
    [3.0, 2.0, 1.0]
    """
    observed, albedo, weights = check_data(observed, transfer, albedo, weights)
    check_solver(tolerance, max_steps, throw)
    turn = check_flag("turn", turn)
    guesses = _guesses(start, observed.dtype)
    _check_side(guesses, transfer, weights)
    default = max(1e-6, float(jnp.finfo(observed.dtype).eps) ** 0.5)
    recovered = _fit(
        observed,
        transfer,
        albedo,
        weights,
        guesses,
        turn=turn,
        tolerance=default if tolerance is None else tolerance,
        max_steps=max_steps,
    )
    check_end(recovered, "the lights were", throw=throw)
    return recovered


def _guesses(start, dtype) -> Rectangle:
    """Stacks the lights of all guesses in one `Rectangle`; leading axes are guess and light."""
    check_type("start", start, list, tuple)
    single = all(isinstance(p, Polygon) for p in start)
    guesses = [tuple(start)] if single else list(start)
    for guess in guesses:
        check_all("every guess in start", guess, Polygon)
    counts = {len(guess) for guess in guesses}
    if len(counts) != 1 or counts == {0}:
        raise ValueError(f"every guess needs the same number >= 1 of lights, got {sorted(counts)}")
    for polygon in (polygon for guess in guesses for polygon in guess):
        if is_concrete(polygon.radiance) and not (np.asarray(polygon.radiance) > 0).all():
            raise ValueError(
                f"a guess needs positive radiance, got {np.asarray(polygon.radiance).tolist()}"
            )
    stacked = _stack([_stack([rectangle_of(p) for p in guess]) for guess in guesses])
    return jax.tree.map(lambda leaf: leaf.astype(dtype), stacked)


def _check_side(guesses: Rectangle, transfer: Transfer, weights: Float[Array, " v"]) -> None:
    """Warn, where values are known, of lights that are below the horizon of all that they face."""
    if not all(is_concrete(a) for a in jax.tree.leaves((guesses, transfer, weights))):
        return
    weigh = np.asarray(weights) > 0
    positions, normals = (
        np.asarray(a, np.float64)[weigh] for a in (transfer.positions, transfer.normals)
    )
    dark = []
    for guess, light in np.ndindex(guesses.size.shape[:2]):
        rectangle = jax.tree.map(lambda leaf, at=(guess, light): np.asarray(leaf)[at], guesses)
        out = np.cross(*rectangle.axes.astype(np.float64))
        before = (positions - rectangle.center) @ out > 0
        corners = np.asarray(rectangle.vertices, np.float64)
        height = normals @ corners.T - np.sum(normals * positions, axis=1)[:, None]
        if not (before & (height > 0).any(axis=1)).any():
            dark.append(f"light {light} of guess {guess}")
    if dark:
        warnings.warn(
            f"no vertex of {weigh.sum()} is lit by {', '.join(dark)}, which stays as it is: "
            "reverse the order of its corners, or put it before the vertices",
            stacklevel=3,
        )


def _stack(lights: Sequence[Rectangle]) -> Rectangle:
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *lights)


def _unstack(lights: Rectangle) -> tuple[Rectangle, ...]:
    return tuple(jax.tree.map(lambda leaf, i=i: leaf[i], lights) for i in range(len(lights.size)))


@eqx.filter_jit
def _fit(observed, transfer, albedo, weights, guesses, **options):
    fit = functools.partial(_recover, **options)
    return everywhere(fit, observed, transfer, albedo, weights, guesses)


def _recover(observed, transfer, albedo, weights, guesses, *, turn, tolerance, max_steps):
    """Fits from `guesses`, rectangles whose leading axes are the guess and the light."""
    seen = jnp.where(weights[:, None] > 0, weights[:, None] * observed, 0)
    norm = jnp.linalg.norm(seen)
    norm = jnp.where(norm > 0, norm, 1)
    albedo = albedo.reshape((1,) * (2 - albedo.ndim) + albedo.shape)
    factor = weights[:, None] * albedo / (math.pi * norm)

    def decode(p: Float[Array, " p"], lights: Rectangle) -> Rectangle:
        return jax.vmap(moved)(lights, p.reshape(len(lights.size), -1))

    def residual(lights: Rectangle) -> Float[Array, " r"]:
        return (factor * _irradiance(lights, transfer) - seen / norm).ravel()

    starts, count, _ = guesses.size.shape
    still = jnp.zeros((starts, count * (11 if turn else 8)), observed.dtype)
    solved = levenberg_marquardt(
        lambda p, guess: residual(decode(p, guess)),
        still,
        guesses,
        tolerance=tolerance,
        max_steps=max_steps,
        normal=on_mesh(observed, transfer),
        most=rows_at_once(transfer.coefficients.nbytes * still.shape[1]),
    )
    value = decode(solved.parameters, jax.tree.map(lambda leaf: leaf[solved.start], guesses))
    squared = jnp.sum(solved.residual**2)
    statistics = Statistics(
        steps=solved.steps,
        residual=jnp.sqrt(squared),
        agreeing=solved.agreeing,
        starts=starts,
        at_bound=jnp.zeros((), bool),
    )
    free = jnp.maximum(3 * jnp.sum(weights > 0) - still.shape[1], 1)
    spread = confidence(
        lambda lights: residual(_stack(lights)),
        lambda p: _unstack(decode(p, value)),
        still[0],
        squared / free.astype(squared.dtype),
    )
    return Recovered(_unstack(value), solved.result, statistics, spread)


def _irradiance(lights: Rectangle, transfer: Transfer) -> Float[Array, "v 3"]:
    """Irradiance of all lights together. XLA compiles one light, not each."""

    def one(light):
        # One channel is enough: the color is a factor.
        return irradiance(Polygon(light.vertices, jnp.ones(3, transfer.dtype)), transfer)

    most = rows_at_once(transfer.coefficients.nbytes)
    return einsum("lv,lc->vc", in_turn(one, lights, most=most), lights.radiance)
