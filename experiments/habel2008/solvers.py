"""The fit of the paper's eq. 1, in its own monomials and in better ones, by several solvers.

The paper calls its fit a non-linear least-squares one. It is linear in what is sought, but its
monomials θ^i τ^j are nearly dependent, and that decides what a solver makes of it.
"""

import dataclasses
import importlib
import math
import warnings
from collections.abc import Callable, Iterator
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float

from jaxsh import harmonics, sky

from ..runner import Context, Table, experiment
from .suns import PLAIN, TURBIDITY, ZENITH, Columns, Suns, polynomials, project, scaled

_TOLERANCE = float(np.finfo(np.float64).eps) ** 0.5  # what the package's own solvers take

Basis = Literal["Chebyshev", "scaled monomials", "monomials"]


@dataclasses.dataclass(frozen=True)
class Solvers:
    bands: int = 1
    """fit the weights of so many bands, in all channels"""
    heights: int = 31
    """zenith angles at which errors are measured"""
    turbidities: int = 12
    """turbidities at which errors are measured"""
    bases: tuple[Basis, ...] = ("Chebyshev", "scaled monomials", "monomials")
    """bases of the same polynomials; scaled is to [-1, 1], before the powers are taken"""
    max_steps: int = 256
    """steps after which a solver is stopped"""

    def __post_init__(self):
        if not 1 <= self.bands <= 10:
            raise ValueError(f"bands must be 1 to 10, got {self.bands}")
        if min(self.heights, self.turbidities) < 2 or self.max_steps < 1:
            raise ValueError("heights and turbidities must be at least 2, and max_steps 1")
        if not self.bases:
            raise ValueError("bases must be one or more")


class Outcome(NamedTuple):
    values: Float[np.ndarray, "problems terms"]
    steps: int  # of the problem that took the most
    result: str


class Problem(NamedTuple):
    """Samples of all weights with m ≥ 0 in all channels, and what they are to be elsewhere."""

    nodes: Suns
    targets: Float[np.ndarray, "problems samples"]
    suns: Suns
    exact: Float[np.ndarray, "suns problems"]
    low: Float[np.ndarray, "suns 1"]

    def error(self, fitted: Float[np.ndarray, "suns problems"]) -> float:
        """The worst E_mean, in per cent."""
        difference = (fitted - self.exact).reshape(len(fitted), 3, -1)
        return 100 * float(np.max(np.linalg.norm(difference, axis=-1) / self.low))


@experiment("habel2008.solvers", x64=True)
def solvers(config: Solvers, context: Context) -> list[Table]:
    problem = _problem(config)
    fine = tensor("Chebyshev", problem.nodes)
    linear = np.linalg.lstsq(fine, problem.targets.T)[0]
    best = np.linalg.norm(fine @ linear - problem.targets.T)
    for basis in context.progress(config.bases, "bases"):
        design, there = (tensor(basis, suns) for suns in (problem.nodes, problem.suns))
        for name, solve in _SOLVERS.items():
            with context.time(f"{basis}: {name}"):
                found = solve(jnp.asarray(design), jnp.asarray(problem.targets), config.max_steps)
            residual = np.linalg.norm(design @ found.values.T - problem.targets.T) / best
            single = [array.astype(np.float32) for array in (there, found.values.T)]
            context.record(
                {
                    "basis": basis,
                    "condition": condition(basis, problem.nodes),
                    "solver": name,
                    "steps": found.steps,
                    "result": found.result,
                    "seconds": context.times[f"{basis}: {name}"]["seconds"],
                    "residual": float(residual),
                    "largest": float(np.max(np.abs(found.values))),
                    "error": problem.error(there @ found.values.T),
                    "error_float32": problem.error(single[0] @ single[1]),
                }
            )
    return list(_tables(config, problem, context.rows))


def _problem(config: Solvers) -> Problem:
    nodes = Suns.nodes(*(3 * count // 2 for count in PLAIN))
    suns = Suns.even(config.heights, config.turbidities)
    rows = harmonics.orders(config.bands - 1) >= 0
    samples, exact = (
        array[..., rows].reshape(array.shape[0] * array.shape[1], -1)
        for array in project((nodes, suns), config.bands)
    )
    low = np.asarray(sky.smallest_luminance(suns.directions, suns.turbidity[None]))
    return Problem(nodes, samples.T, suns, exact, low.reshape(-1, 3))


def _monomials(axis: sky.Axis, values: Float[np.ndarray, " n"], count: int):
    return np.power.outer(values, np.arange(count))


def _scaled_monomials(axis: sky.Axis, values: Float[np.ndarray, " n"], count: int):
    return np.power.outer(scaled(axis, values), np.arange(count))


_BASES: dict[Basis, Columns] = {
    "Chebyshev": polynomials,
    "scaled monomials": _scaled_monomials,
    "monomials": _monomials,
}


def _factors(basis: Basis, suns: Suns) -> list[Float[np.ndarray, "n c"]]:
    return [
        _BASES[basis](axis, values, count)
        for axis, values, count in zip((ZENITH, TURBIDITY), suns, PLAIN, strict=True)
    ]


def tensor(basis: Basis, suns: Suns) -> Float[np.ndarray, "samples terms"]:
    """All products of a basis function of θ and one of τ, on all the suns."""
    return np.kron(*_factors(basis, suns))


def condition(basis: Basis, suns: Suns) -> float:
    """Of `tensor`: the product of its factors', each small enough for float64 to tell."""
    return math.prod(float(np.linalg.cond(factor)) for factor in _factors(basis, suns))


Solve = Callable[[Array, Array, int], Outcome]


def _ours(solver: Literal["qr", "gauss-newton", "levenberg-marquardt"]) -> Solve:
    def solve(design: Array, targets: Array, max_steps: int) -> Outcome:
        values, solution = sky.least_squares(
            design, targets, jnp.ones_like(targets), solver=solver, max_steps=max_steps
        )
        return Outcome(np.asarray(values), int(solution.steps), _first(solution.message))

    return solve


def _first(sentence: str) -> str:
    """Optimistix explains itself at length: its first sentence."""
    return sentence.partition(".")[0]


def _bfgs(design: Array, targets: Array, max_steps: int) -> Outcome:
    solver = optx.BFGS(_TOLERANCE, _TOLERANCE)

    @jax.jit
    @jax.vmap
    def each(target):
        def half(c, _):
            return jnp.sum((design @ c - target) ** 2) / 2

        start = jnp.zeros(design.shape[1])
        found = optx.minimise(half, solver, start, max_steps=max_steps, throw=False)
        return found.value, found.stats["num_steps"], found.result

    values, steps, results = each(targets)
    failed = np.asarray(results != optx.RESULTS.successful)
    worst = jax.tree.map(lambda leaf: leaf[int(np.argmax(failed))], results)
    return Outcome(
        np.asarray(values), int(steps.max()), _first(optx.RESULTS[worst] or "successful")
    )


def _jaxopt(name: str, **options: Any) -> Solve:
    def solve(design: Array, targets: Array, max_steps: int) -> Outcome:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # that it is not maintained
            jaxopt = importlib.import_module("jaxopt")
        solver = getattr(jaxopt, name)(
            lambda c, target: design @ c - target, maxiter=max_steps, tol=_TOLERANCE, **options
        )
        run = jax.jit(jax.vmap(lambda target: solver.run(jnp.zeros(design.shape[1]), target)))
        with jax.numpy_dtype_promotion("standard"):  # it multiplies numbers by booleans
            found = run(targets)
        within = bool((found.state.error <= _TOLERANCE).all())
        result = "nothing; within tolerance" if within else "nothing; not within tolerance"
        return Outcome(np.asarray(found.params), int(found.state.iter_num.max()), result)

    return solve


_SOLVERS: dict[str, Solve] = {
    "lineax QR, linear": _ours("qr"),
    "optimistix GaussNewton, lineax QR": _ours("gauss-newton"),
    "optimistix LevenbergMarquardt, lineax QR": _ours("levenberg-marquardt"),
    "optimistix BFGS": _bfgs,
    "jaxopt GaussNewton": _jaxopt("GaussNewton"),
    "jaxopt LevenbergMarquardt, QR": _jaxopt(
        "LevenbergMarquardt", materialize_jac=True, solver="qr"
    ),
}


def _tables(config: Solvers, problem: Problem, rows: list[dict[str, Any]]) -> Iterator[Table]:
    problems, samples = problem.targets.shape
    yield Table(
        "Solvers by basis",
        rows=rows,
        values={"problems": problems, "samples": samples, "tolerance": _TOLERANCE},
    )
    lines = [row for row in rows if row["solver"] == next(iter(_SOLVERS))]
    yield Table("Bases", rows=lines)
