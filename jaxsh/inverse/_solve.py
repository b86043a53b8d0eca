"""Nonlinear least squares from many starts at once, and what the data tell of the answer."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Float, Int

# Ends whose residuals differ by less than this, in units of the data, are in the same valley.
_SAME = 1e-3


class Solved(NamedTuple):
    parameters: Float[Array, " p"]
    residual: Float[Array, " r"]
    result: Any
    steps: Int[Array, ""]
    agreeing: Int[Array, ""]


def levenberg_marquardt(
    residual: Callable[[Float[Array, " p"]], Float[Array, " r"]],
    starts: Float[Array, "s p"],
    *,
    tolerance: float,
    max_steps: int,
) -> Solved:
    """The least ‖residual‖² that any of the starts leads to; residuals in units of the data.

    Among ends as good as the best, one that has converged goes before one that has not.
    """
    solver = optx.LevenbergMarquardt(tolerance, tolerance)

    def with_itself(p, _):
        value = residual(p)
        return value, value

    def one(start):
        solution = optx.least_squares(
            with_itself, solver, start, has_aux=True, max_steps=max_steps, throw=False
        )
        return solution.value, solution.aux, solution.result, solution.stats["num_steps"]

    # One after the other: each stops when it is done, and XLA compiles this three times as fast
    # as all side by side.
    values, residuals, results, steps = jax.lax.map(one, starts)
    costs = jnp.sum(residuals**2, axis=-1)
    costs = jnp.where(jnp.isfinite(costs), costs, jnp.inf)
    same = jnp.linalg.norm(residuals - residuals[jnp.argmin(costs)][None], axis=-1) < _SAME
    done = same & (results == optx.RESULTS.successful)
    best = jnp.argmin(jnp.where(jnp.where(done.any(), done, same), costs, jnp.inf))
    result = jax.tree.map(lambda r: r[best], results)
    return Solved(values[best], residuals[best], result, steps[best], jnp.sum(same))


def covariance(jacobian: Float[Array, "r p"], variance: Float[Array, ""]) -> Float[Array, "p p"]:
    """variance · (JᵀJ)⁻¹ by singular values; all infinite where J has less than full rank."""
    # Columns of length 1, so that units of parameters do not decide about the rank.
    lengths = jnp.linalg.norm(jacobian, axis=0)
    scaled = jacobian / jnp.where(lengths > 0, lengths, 1)[None]
    _, singular, vt = jnp.linalg.svd(scaled, full_matrices=False)
    full = singular[-1] > jnp.finfo(jacobian.dtype).eps * len(jacobian)
    inverse = vt / jnp.where(full, singular, 1)[:, None] / jnp.where(lengths > 0, lengths, 1)[None]
    spread = variance * jnp.matmul(inverse.T, inverse, precision="highest")
    return jnp.where(full & jnp.all(lengths > 0), spread, jnp.inf)
