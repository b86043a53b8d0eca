"""Nonlinear least squares from many starts at once, and what the data tell of the answer."""

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import lineax as lx
import optimistix as optx
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float, Int

from .._core.linalg import einsum, matmul, triangle
from .._core.xla import cpu_alone, in_turn, keep_rows
from ._result import Confidence

# Ends whose residuals differ by less than this, in units of the data, are in the same valley.
_SAME = 1e-3


class _Damping(optx.AbstractSearch):
    """Optimistix's search, with its state in the unknowns' dtype, not in JAX's default float.

    Otherwise fits in float32 fail under `jax_enable_x64`.
    """

    search: optx.ClassicalTrustRegion

    def init(self, y, f_info_struct):
        state = self.search.init(y, f_info_struct)
        return jax.tree.map(lambda leaf: leaf.astype(y.dtype), state)

    def step(self, first_step, y, y_eval, f_info, f_eval_info, state):
        return self.search.step(first_step, y, y_eval, f_info, f_eval_info, state)


class Solved(NamedTuple):
    parameters: Float[Array, " p"]
    residual: Float[Array, " r"]
    result: Any
    steps: Int[Array, ""]
    start: Int[Array, ""]
    agreeing: Int[Array, ""]


def levenberg_marquardt(
    residual: Callable[[Float[Array, " p"], Any], Float[Array, " r"]],
    starts: Float[Array, "s p"],
    constants: Any = None,
    *,
    tolerance: float,
    max_steps: int,
    normal: bool = False,
    most: int | None = None,
) -> Solved:
    """Finds the least ‖residual‖² that any of the starts leads to; residuals in units of the data.

    `residual` takes the unknowns and, of the `constants`, a tree of arrays, those of its start.
    Among ends as good as the best, one that has converged goes before one that has not.

    `normal`: each step by its normal equations instead of QR. It loses digits of a step, not of the
    end, and sums over residuals that several devices share where QR would gather them.

    On a CPU one start comes after the other: each stops when it is done, and XLA compiles this
    three times as fast as all side by side, which is what keeps an accelerator busy: `most` at
    once, as far as its memory goes.
    """
    linear = lx.Normal(lx.Cholesky()) if normal else lx.QR()
    solver = optx.LevenbergMarquardt(tolerance, tolerance, linear_solver=linear)
    solver = eqx.tree_at(lambda s: s.search, solver, _Damping(solver.search))

    def with_itself(p, constants):
        value = residual(p, constants)
        return value, value

    @jax.jit  # traced once for both ways of `in_turn`
    def one(p, args):
        solution = optx.least_squares(
            with_itself, solver, p, args, has_aux=True, max_steps=max_steps, throw=False
        )
        return solution.value, solution.aux, solution.result, solution.stats["num_steps"]

    def each(pair):
        return one(*pair)

    pairs = starts, constants
    batched = functools.partial(in_turn, most=most, lapack=True)
    ends = (jax.lax.map if cpu_alone() else batched)(each, pairs)
    values, residuals, results, steps = ends
    costs = jnp.sum(residuals**2, axis=-1)
    costs = jnp.where(jnp.isfinite(costs), costs, jnp.inf)
    same = jnp.linalg.norm(residuals - residuals[jnp.argmin(costs)][None], axis=-1) < _SAME
    done = same & (results == optx.RESULTS.successful)
    best = jnp.argmin(jnp.where(jnp.where(done.any(), done, same), costs, jnp.inf))
    result = jax.tree.map(lambda r: r[best], results)
    return Solved(values[best], residuals[best], result, steps[best], best, jnp.sum(same))


def everywhere(function: Callable[..., Any], *arguments: Any) -> Any:
    """Calls `function(*arguments)` on arrays that a mesh shares out; each device holds the results.

    With explicit axes JAX would ask of each operation how its result is to be shared out.
    """
    arrays = [leaf for leaf in jax.tree.leaves(arguments) if isinstance(leaf, jax.Array)]
    shared = [a for a in arrays if tuple(jax.typeof(a).sharding.spec)[:1] not in ((), (None,))]
    return keep_rows(function, *arguments, like=(shared or arrays)[0], axis=0, out=None)


def fixed_point(
    again: Callable[[Any], tuple[Any, Any]], start: Any, *, tolerance: float, max_steps: int
) -> optx.Solution:
    """Repeats `again`, which gives what comes next and more beside it, until all of that rests."""

    def apart(difference):
        # Optimistix starts from an error in JAX's default float, whatever the dtype of the data.
        return optx.max_norm(difference).astype(jnp.result_type(float))

    return optx.fixed_point(
        lambda state, _: again(state),
        optx.FixedPointIteration(0.0, tolerance, norm=apart),
        start,
        has_aux=True,
        max_steps=max_steps,
        throw=False,
    )


def covariance(jacobian: Float[Array, "r p"], variance: Float[Array, ""]) -> Float[Array, "p p"]:
    """Covariance variance · (JᵀJ)⁻¹ by singular values; infinite for what J does not determine."""
    jacobian = triangle(jacobian)
    missing = max(jacobian.shape[1] - len(jacobian), 0)  # of rows, for the SVD to be complete
    jacobian = jnp.pad(jacobian, ((0, missing), (0, 0)))
    # Columns of length 1, so that units of parameters do not decide about the rank.
    lengths = jnp.linalg.norm(jacobian, axis=0)
    lengths = jnp.where(lengths > 0, lengths, 1)
    _, singular, vt = jnp.linalg.svd(jacobian / lengths[None], full_matrices=False)
    # A column of rounding errors of the size of its elements is about eps long, however tall.
    eps = jnp.finfo(jacobian.dtype).eps
    known = singular > 10 * eps * jacobian.shape[1]
    inverse = jnp.where(known, 1 / jnp.where(known, singular, 1), 0)[:, None] * vt / lengths[None]
    free = jnp.any(~known[:, None] & (jnp.abs(vt) > math.sqrt(eps)), axis=0)
    return jnp.where(free[:, None] | free[None], jnp.inf, variance * matmul(inverse.T, inverse))


def confidence(
    residual: Callable[[Any], Float[Array, " r"]],
    moved: Callable[[Float[Array, " p"]], Any],
    still: Float[Array, " p"],
    variance: Float[Array, ""],
) -> Confidence[Any]:
    """Confidence in the value `moved(still)`, from the slopes of its residual and of itself."""
    jacobian = jax.jacfwd(lambda step: residual(moved(step)))(still)
    carried = jax.jacfwd(lambda step: ravel_pytree(moved(step))[0])(still)
    spread = covariance(jacobian, variance)
    free = jnp.any((carried != 0) & ~jnp.isfinite(jnp.diagonal(spread))[None], axis=1)
    spread = jnp.where(jnp.isfinite(spread), spread, 0)
    spread = einsum("ip,pq,jq->ij", carried, spread, carried)
    spread = jnp.where(free[:, None] | free[None], jnp.inf, spread)
    _, unravel = ravel_pytree(moved(still))
    return Confidence(spread, unravel(jnp.sqrt(jnp.maximum(jnp.diagonal(spread), 0))))
