"""Linear least-squares problems with one design, by the solvers that nonlinear ones take.

Optimistix and lineax are imported where a problem is solved: the stored fits need neither.
"""

from typing import Any, Literal, get_args

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from .._core.checks import as_finite, check_size, described, nearest
from .._core.linalg import matmul, triangle
from .._core.xla import in_turn, keep_rows, on_mesh

_Named = Literal["gauss-newton", "levenberg-marquardt", "qr"]
Solver = _Named | Any  # or an `optimistix.AbstractLeastSquaresSolver`


class Solution(eqx.Module):
    """Report of a solver: how small the residual is, in how many steps, and whether it is done.

    `residual` is the weighted residual's norm relative to that of the data, over all problems;
    `steps` and `result` (an `optimistix.RESULTS`) are those of the problem that took the most steps
    or failed.

    **Example**

    >>> from jaxsh import sky
    >>> def glow(view, sun):
    ...     return (1 + view @ sun)[:, None]
    >>> solution = sky.fit(glow, {}, degree=1, terms=[4], solver="qr").solution
    >>> solution.converged, solution.message
    (True, 'successful')
    """

    residual: Float[Array, ""]
    steps: Int[Array, ""]
    result: Any  # an optimistix.RESULTS

    @property
    def converged(self) -> bool:
        """True where the solver says so for every problem. Outside of `jit`."""
        import optimistix as optx

        return bool(self.result == optx.RESULTS.successful)

    @property
    def message(self) -> str:
        """The result code in words."""
        import optimistix as optx

        return optx.RESULTS[self.result] or "successful"


def least_squares(
    design: Float[Array, "samples terms"],
    targets: Float[Array, "problems samples"],
    scales: Float[Array, "problems samples"],
    *,
    solver: Solver = "gauss-newton",
    max_steps: int = 256,
) -> tuple[Float[Array, "problems terms"], Solution]:
    """Minimises ‖scales·(A c) − targets‖² over c, for each problem.

    `solver` is an Optimistix least-squares solver, or a name: `"gauss-newton"` and
    `"levenberg-marquardt"` with a lineax QR and a tolerance of √ε, or `"qr"`, the linear solution
    in one step, to check the others by. Does not raise where a solver fails: see `Solution`.
    Raises `ValueError` for a solver that there is not. Runs on the host's values, not inside `jit`.

    Samples may be shared out over a mesh of devices. Each then makes a triangle of its own of its
    samples, by QR, and these small ones are solved together on each device.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import sky
    >>> design = jnp.asarray([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]])
    >>> targets = jnp.asarray([[1.0, 3.0, 5.0]])
    >>> values, solution = sky.least_squares(design, targets, jnp.ones((1, 3)), solver="qr")
    >>> values.round(3).tolist(), solution.converged
    ([[1.0, 2.0]], True)
    """
    import optimistix as optx

    max_steps = check_size("max_steps", max_steps)
    design, targets = as_finite(design, "design"), as_finite(targets, "targets")
    scales = as_finite(scales, "scales")
    if design.ndim != 2:
        raise ValueError(f"expected design (samples, terms), got shape {design.shape}")
    if targets.ndim != 2 or targets.shape[1] != len(design) or scales.shape != targets.shape:
        raise ValueError(
            f"expected targets and scales (problems, {len(design)}), got shapes {targets.shape} "
            f"and {scales.shape}"
        )
    values, steps, results = _solve(
        design, targets, scales, _named(solver, design.dtype), max_steps
    )
    fitted = matmul(values, design.T)
    residual = jnp.linalg.norm(scales * fitted - targets) / jnp.linalg.norm(targets)
    failed = results != optx.RESULTS.successful
    worst = jnp.argmax(failed) if failed.any() else jnp.argmax(steps)
    result = jax.tree.map(lambda a: a[worst], results)
    return values, Solution(residual, steps[worst], result)


def _named(solver: Solver, dtype):
    import lineax as lx
    import optimistix as optx

    tolerance = float(jnp.finfo(dtype).eps) ** 0.5
    match solver:
        case "gauss-newton":
            return optx.GaussNewton(tolerance, tolerance, linear_solver=lx.QR())
        case "levenberg-marquardt":
            return optx.LevenbergMarquardt(tolerance, tolerance, linear_solver=lx.QR())
        case "qr" | optx.AbstractLeastSquaresSolver():
            return solver
    names = ", ".join(get_args(_Named))
    raise ValueError(
        f"solver must be one of {names} or of Optimistix, got {described(solver)}"
        f"{nearest(solver, get_args(_Named))}"
    )


@eqx.filter_jit
def _solve(design, targets, scales, solver, max_steps):
    if not on_mesh(design, targets, scales):
        return _of_each(design, targets, scales, solver, max_steps)

    def shared(design, targets, scales):
        # With the targets as one more column, the norm of what is left is that of all samples.
        tall = jnp.concatenate([scales[..., None] * design[None], targets[..., None]], axis=-1)
        small = in_turn(triangle, tall, lapack=True)
        reduced = small[..., :-1], small[..., -1], jnp.ones_like(small[..., -1])
        return _of_each(*reduced, solver, max_steps)

    # Along the samples, the last axis but for the design.
    return keep_rows(shared, design, targets, scales, like=targets, axis=1, out=None)


def _of_each(design, targets, scales, solver, max_steps):
    """Solves each problem, of one design for all or of one for each."""
    import lineax as lx
    import optimistix as optx

    def linear(design, target, scale):
        operator = lx.MatrixLinearOperator(scale[:, None] * design)
        solution = lx.linear_solve(operator, target, lx.QR(), throw=False)
        return solution.value, jnp.ones((), jnp.int32), optx.RESULTS.promote(solution.result)

    def iterative(design, target, scale):
        def residual(c, _):
            return scale * matmul(design, c) - target

        start = jnp.zeros(design.shape[-1], design.dtype)
        solution = optx.least_squares(residual, solver, start, max_steps=max_steps, throw=False)
        return solution.value, solution.stats["num_steps"], solution.result

    one = linear if solver == "qr" else iterative
    if design.ndim == 2:
        return jax.vmap(one, (None, 0, 0))(design, targets, scales)
    return in_turn(lambda problem: one(*problem), (design, targets, scales), lapack=True)
