"""Colors of lights whose shapes are known, between bounds.

The one module that uses JAXopt, which warns on import that it is no longer maintained; so it is
imported when it is used.
"""

import functools
import math
import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from .._core.checks import check_all, check_number
from .._core.linalg import einsum, in_full, matmul
from .._core.xla import in_turn
from ..midrange import Polygon
from ..transfer import Transfer
from ._checks import check_data, check_end, check_solver
from ._result import Confidence, Recovered, Statistics
from ._shading import irradiance
from ._solve import covariance, everywhere


def _box_solver(max_steps: int, tolerance: float):
    """Cyclic coordinate descent for a quadratic form in a box."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "JAXopt is no longer maintained", DeprecationWarning)
        import jaxopt
    return jaxopt.BoxCDQP(maxiter=max_steps, tol=tolerance, implicit_diff=False)


# For the products inside JAXopt's solver.
@in_full
def fit_colors(
    observed: Float[ArrayLike, "v 3"],
    transfer: Transfer,
    albedo: Float[ArrayLike, "..."],
    lights: Sequence[Polygon],
    *,
    upper: float = math.inf,
    weights: Float[ArrayLike, " v"] | None = None,
    tolerance: float | None = None,
    max_steps: int = 1000,
    throw: bool = True,
) -> Recovered[Float[Array, "n 3"]]:
    """Finds the radiance of each light, in [0, `upper`], from the shading of a diffuse mesh.

    Least squares with bounds, min ‖A x − b‖² for 0 <= x <= upper in each channel: shading is
    linear in the radiances. It is made small first (the Gram matrix of n lights), so that what
    JAXopt's coordinate descent does in each sweep does not depend on the number of vertices.

    **Arguments**

    - `observed`, `transfer`, `albedo`, `weights`, `throw`: as for `fit_sky`.
    - `lights`: the shapes; their own radiance does not count.
    - `tolerance`: of the optimality of the answer, in units of the data; 1e-10, and ε in float32.

    Vertices may be shared out over a mesh of devices.

    **Returns** a `Recovered` with the radiances (n, 3) in the transfer's dtype. `at_bound` tells
    whether any is at a bound; the confidence is that of least squares without bounds, and counts
    one start. Not differentiable.

    Raises `ValueError` for shapes that do not fit, no lights, bounds that are none, and, where
    values are known, for data that are not finite or all zero.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import inverse, midrange, sphere, transfer
    >>> normals = sphere.fibonacci(20).directions
    >>> ball = transfer.unshadowed(0.5 * normals, normals, 1)
    >>> corners = [[-1.0, -1.0, 2.0], [-1.0, 1.0, 2.0], [1.0, 1.0, 2.0], [1.0, -1.0, 2.0]]
    >>> lamp = midrange.Polygon(jnp.asarray(corners), jnp.asarray([3.0, 2.0, 1.0]))
    >>> light = midrange.polygon_harmonics(lamp, ball.positions, 1)
    >>> observed = transfer.shade_diffuse(light, ball, 0.5)
    >>> found = inverse.fit_colors(observed, ball, 0.5, [lamp])
    >>> [round(float(channel), 2) for channel in found.value[0]]
    [3.0, 2.0, 1.0]
    """
    observed, albedo, weights = check_data(observed, transfer, albedo, weights)
    check_solver(tolerance, max_steps, throw)
    check_all("lights", lights, Polygon)
    upper = check_number("upper", upper, above=0.0, infinite=True)
    default = max(1e-10, float(jnp.finfo(observed.dtype).eps))
    recovered = _fit(
        observed,
        transfer,
        albedo,
        weights,
        tuple(lights),
        jnp.asarray(upper, observed.dtype),
        tolerance=default if tolerance is None else tolerance,
        max_steps=max_steps,
    )
    check_end(recovered, "the colors were", throw=throw)
    return recovered


class _Channel(NamedTuple):
    """Radiances of one channel, and what tells how good they are."""

    radiance: Float[Array, " n"]
    residual: Float[Array, " v"]
    at_bound: Bool[Array, ""]
    sweeps: Int[Array, ""]
    error: Float[Array, ""]
    jacobian: Float[Array, "v n"]


@eqx.filter_jit
def _fit(observed, transfer, albedo, weights, lights, upper, **options):
    fit = functools.partial(_recover, **options)
    return everywhere(fit, observed, transfer, albedo, weights, lights, upper)


def _recover(observed, transfer, albedo, weights, lights, upper, *, tolerance, max_steps):
    dtype = observed.dtype
    seen = jnp.where(weights[:, None] > 0, weights[:, None] * observed, 0)
    norm = jnp.linalg.norm(seen)
    norm = jnp.where(norm > 0, norm, 1)
    white = [eqx.tree_at(lambda p: p.radiance, light, jnp.ones(3, dtype)) for light in lights]
    shading = jnp.stack([irradiance(light, transfer) for light in white], axis=-1)
    albedo = albedo.reshape((1,) * (2 - albedo.ndim) + albedo.shape)
    factor = jnp.broadcast_to(weights[:, None] * albedo / (math.pi * norm), seen.shape)
    solver = _box_solver(max_steps, tolerance)
    channels = in_turn(
        lambda rows: _channel(solver, rows[0][:, None] * shading, rows[1], upper),
        (factor.T, seen.T / norm),
    )
    squared = jnp.sum(channels.residual**2)
    statistics = Statistics(
        steps=jnp.max(channels.sweeps),
        residual=jnp.sqrt(squared),
        agreeing=jnp.ones((), jnp.int32),
        starts=1,
        at_bound=jnp.any(channels.at_bound),
    )
    free = jnp.maximum(3 * jnp.sum(weights > 0) - channels.radiance.size, 1)
    spread = _confidence(channels.jacobian, squared / free.astype(dtype))
    most: Any = optx.RESULTS.nonlinear_max_steps_reached
    done = jnp.all(channels.error <= tolerance)
    result = optx.RESULTS.where(done, optx.RESULTS.successful, most)
    return Recovered(channels.radiance.T, result, statistics, spread)


def _channel(
    solver, matrix: Float[Array, "v n"], target: Float[Array, " v"], upper: Float[Array, ""]
) -> _Channel:
    """Minimises ‖matrix · x − target‖² for 0 <= x <= upper."""
    lengths = jnp.linalg.norm(matrix, axis=0)
    lengths = jnp.where(lengths > 0, lengths, 1)
    unit = matrix / lengths[None]
    # A light that reaches nothing keeps a unit column's curvature, and the radiance zero.
    gram = matmul(unit.T, unit)
    gram = gram + jnp.diag((jnp.diagonal(gram) == 0).astype(gram.dtype))
    pull = matmul(unit.T, target)
    bounds = jnp.zeros_like(lengths), upper * lengths
    solution = solver.run(jnp.zeros_like(lengths), params_obj=(gram, -pull), params_ineq=bounds)
    x = solution.params
    residual = target - matmul(unit, x)
    at_bound = jnp.any((x <= bounds[0]) | (x >= bounds[1]))
    state = solution.state
    radiance = jnp.where(x < bounds[1], x / lengths, upper)  # the bound itself, not its rounding
    return _Channel(radiance, residual, at_bound, state.iter_num, state.error, matrix)


def _confidence(
    jacobians: Float[Array, "3 v n"], variance: Float[Array, ""]
) -> Confidence[Float[Array, "n 3"]]:
    """Confidence by channels, which do not depend on each other: blocks, in the order of (n, 3)."""
    count = jacobians.shape[-1]
    blocks = jax.vmap(lambda jacobian: covariance(jacobian, variance))(jacobians)
    whole = jnp.isfinite(blocks).all()
    spread = einsum("cij,cd->icjd", jnp.where(whole, blocks, 0), jnp.eye(3, dtype=blocks.dtype))
    spread = jnp.where(whole, spread, jnp.inf).reshape(3 * count, 3 * count)
    return Confidence(spread, jnp.sqrt(jnp.diagonal(spread)).reshape(count, 3))
