"""Fits of any sky: sampled on Chebyshev nodes, projected exactly, solved by least squares."""

import functools
import math
from collections.abc import Callable, Mapping, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import (
    as_finite,
    check_degree,
    check_flag,
    check_function,
    check_number,
    check_size,
    check_type,
    described,
)
from .._core.devices import Devices, automatic, last_of, mesh_of, share
from .._core.known import is_concrete
from .._core.linalg import einsum, in_full, matmul
from ..harmonics import orders
from ._angles import half_rows
from ._project import Model, project
from ._sky_fit import Axis, Prefactor, SkyFit, design, monomials
from ._solve import Solution, Solver, least_squares

# Those that the named fits pass on.
OPTIONS = (
    "zenith",
    "weight",
    "lawson",
    "samples",
    "project",
    "solver",
    "max_steps",
    "throw",
    "devices",
)


# The model's own products too.
@in_full
def fit(
    model: Model,
    parameters: Mapping[str, tuple[float, float]],
    *,
    degree: int = 6,
    terms: Sequence[int] | None = None,
    log: Sequence[str] = (),
    zenith: float = math.pi / 2,
    parity: bool = True,
    prefactor: Prefactor | None = None,
    mix: Float[ArrayLike, "out channels"] | None = None,
    weight: Callable[..., Array] | None = None,
    lawson: int = 0,
    samples: Sequence[int] | None = None,
    project: Callable[..., Array] = project,
    solver: Solver = "gauss-newton",
    max_steps: int = 256,
    throw: bool = True,
    devices: Devices = None,
) -> SkyFit:
    """Fits a sky's coefficients as functions of the sun and the sky's parameters.

    **Arguments**

    - `model`: `model(view, sun, *parameters) -> (n, C)` as for `sky.project`. It must turn with
      the sun and be its own mirror image in the plane of sun and zenith.
    - `parameters`: the name of each further argument, in order, and its range: any number of
      them, turbidity, albedo, a color of the ground.
    - `terms`: how many Chebyshev polynomials in the sun's height and in each parameter; 12 and 6.
    - `log`: parameters that are fitted in their logarithm.
    - `zenith`: the largest angle between sun and zenith, in radians.
    - `parity`: use that a sky which is smooth where the sun passes the zenith has
      c_lm = sin^m θ · (a function of θ²). False is the paper's plain series in θ.
    - `prefactor`, `mix`: fit a_q = (mix⁻¹ c)_q / p_q(sun, *parameters) instead of c, with the
      factors p (n, C) for suns (n, 3) and a square matrix.
    - `weight`: `weight(sun, *parameters) -> (n,)`, what an error of c counts, 1/L_min for one.
    - `lawson`: rounds of Lawson's reweighting towards the least worst case: weights grow where
      the error, eq. 3 of Habel et al. 2008 with `weight` for 1/L_min, is large. The best round
      is kept.
    - `samples`: Chebyshev nodes in each variable; twice the terms and four more.
    - `project`: in the place of `sky.project`, with its signature, for a sky with a ground.
    - `solver`, `max_steps`: see `least_squares`. Levenberg–Marquardt takes many steps where
      `parity` is on, since there the condition number is 1e4 rather than 10.
    - `throw`: raise `RuntimeError` where a solver did not converge; otherwise its result code is
      in the fit's `solution`.
    - `devices`: share the samples out over them: a list of `jax.Device`, also those of other
      processes, which then all call this, or a `jax.sharding.Mesh`. By default JAX's default
      device takes all. The model and the solver run where the samples are.

    In JAX's default float type: fit with x64 on, and evaluate in any. Runs on the host's values
    and not inside `jit`. Raises `ValueError` for wrong ranges, counts and names, for coefficients
    that are not finite, and for a sky that does not turn with the sun or has no mirror symmetry.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> def glow(view, sun, haze):
    ...     return haze * (1 + view @ sun)[:, None]
    >>> fitted = sky.fit(glow, {"haze": (1.0, 2.0)}, degree=1, terms=(4, 2), solver="qr")
    >>> fitted(np.array([0.6, 0.0, 0.8]), 1.5).shape
    (1, 4)
    """
    check_function("model", model)
    check_function("project", project)
    for name, function in (("prefactor", prefactor), ("weight", weight)):
        if function is not None:
            check_function(name, function)
    parity, throw = check_flag("parity", parity), check_flag("throw", throw)
    lawson, max_steps = check_size("lawson", lawson, 0), check_size("max_steps", max_steps)
    axes = _axes(parameters, log, zenith, parity)
    terms = _counts("terms", terms, [12, *[6] * len(parameters)])
    samples = _counts("samples", samples, [2 * count + 4 for count in terms])
    if any(nodes < count for nodes, count in zip(samples, terms, strict=True)):
        raise ValueError(f"expected at least as many samples as terms {terms}, got {samples}")
    degree = check_degree(degree)
    nodes = [axis.nodes(count) for axis, count in zip(axes, samples, strict=True)]
    height, *numbers = (jnp.asarray(g.ravel()) for g in np.meshgrid(*nodes, indexing="ij"))
    theta = jnp.sqrt(height) if parity else height
    suns = jnp.stack([jnp.sin(theta), jnp.zeros_like(theta), jnp.cos(theta)], axis=-1)

    _check_symmetry(model, suns, numbers)
    counted = jnp.ones_like(theta)
    if devices is not None:
        # The last sample again, which counts nothing, where their number is not a multiple.
        mesh = automatic(mesh_of(devices))
        counted = share(counted, mesh)
        theta, height, suns, *numbers = (
            share(a, mesh, filling=last_of(a)) for a in (theta, height, suns, *numbers)
        )
    exact = project(model, suns, *numbers, degree=degree, symmetric=True)
    _check_finite(exact, theta, numbers)
    channels = exact.shape[-2]
    mix = jnp.eye(channels) if mix is None else as_finite(mix, "mix", dtype=exact.dtype)
    if mix.shape != (channels, channels):
        raise ValueError(f"expected mix ({channels}, {channels}), got shape {mix.shape}")
    rows = half_rows(degree)
    targets = einsum("qc,scr->qrs", jnp.linalg.inv(mix), exact[..., rows])

    powers = orders(degree)[rows] if parity else np.zeros_like(rows)
    scales = monomials(jnp.sin(theta), degree + 1)[powers]
    factors = jnp.ones_like(targets[:, 0]) if prefactor is None else prefactor(suns, *numbers).T
    scales = factors[:, None] * scales[None]
    weights = counted if weight is None else counted * weight(suns, *numbers)
    columns = design(axes, [height, *numbers], terms).T
    solve = functools.partial(_solve, columns, targets, scales, solver=solver, max_steps=max_steps)
    values, solution = _reweighted(solve, mix, weights, lawson)
    if devices is not None:  # each process has all of what was found
        values, solution = jax.tree.map(lambda a: jnp.asarray(np.asarray(a)), (values, solution))
    if throw and not solution.converged:
        raise RuntimeError(
            f"the solver did not converge in {int(solution.steps)} steps, residual "
            f"{float(solution.residual):.1e}: {solution.message}"
        )
    coefficients = values.reshape(channels, len(rows), *terms)
    return SkyFit(coefficients, mix, axes, parity, prefactor, solution)


def _reweighted(solve, mix, weights, rounds: int) -> tuple[Float[Array, "..."], Solution]:
    """Lawson's algorithm: the round whose worst error on the samples is least."""
    emphasis, best, least = jnp.ones_like(weights), None, np.inf
    for _ in range(rounds + 1):
        values, solution, errors = solve(weights * jnp.sqrt(emphasis))
        mixed = einsum("oq,qrs->ors", mix, errors)
        mean = weights * jnp.sqrt(jnp.sum(mixed**2, axis=1)).max(axis=0)
        if best is None or float(mean.max()) < least:
            best, least = (values, solution), float(mean.max())
        emphasis = emphasis * mean / jnp.mean(emphasis * mean)
    assert best is not None
    return best


def _solve(columns, targets, scales, weights, *, solver, max_steps):
    """Least squares in weighted coefficients, and the errors left, not weighted."""
    flat = (targets.shape[0] * targets.shape[1], targets.shape[-1])
    weighted = [(weights[None, None] * a).reshape(flat) for a in (targets, scales)]
    values, solution = least_squares(columns, *weighted, solver=solver, max_steps=max_steps)
    fitted = matmul(values, columns.T).reshape(targets.shape)
    return values, solution, scales * fitted - targets


def _axes(parameters, log, zenith: float, parity: bool) -> tuple[Axis, ...]:
    check_type("parameters", parameters, Mapping)
    check_type("log", log, list, tuple, set)
    unknown = set(log) - set(parameters)
    if unknown:
        raise ValueError(f"log names no parameter: {', '.join(sorted(map(str, unknown)))}")
    zenith = check_number("zenith", zenith, above=0.0)
    if not zenith < math.pi:
        raise ValueError(f"zenith must be an angle in (0, π), got {zenith:g}")
    for name, bounds in parameters.items():
        if not isinstance(bounds, tuple | list) or len(bounds) != 2:
            raise ValueError(
                f"expected the range of {name} as (low, high), got {described(bounds)}"
            )
        low, high = (check_number(f"the range of {name}", one, infinite=True) for one in bounds)
        if not (math.isfinite(low) and low < high < math.inf) or (name in log and low <= 0):
            wanted = "0 < low < high" if name in log else "low < high"
            raise ValueError(f"the range of {name} must be {wanted}, got ({low}, {high})")
    height = Axis("θ²", 0.0, zenith**2) if parity else Axis("θ", 0.0, zenith)
    others = (Axis(n, float(a), float(b), n in log) for n, (a, b) in parameters.items())
    return (height, *others)


def _counts(name: str, counts, default: list[int]) -> tuple[int, ...]:
    counts = default if counts is None else counts
    if not isinstance(counts, list | tuple) or len(counts) != len(default):
        raise ValueError(
            f"expected {len(default)} positive {name}, for the sun and each parameter, got "
            f"{counts if isinstance(counts, list | tuple) else described(counts)}"
        )
    return tuple(check_size(name, count) for count in counts)


def _check_symmetry(model: Model, suns, numbers) -> None:
    """Compares radiance around a sun in the middle of the range with itself turned and mirrored."""
    middle = len(suns) // 2
    sun, parameters = suns[middle], [n[middle] for n in numbers]
    rng = np.random.default_rng(0)
    views = rng.normal(size=(64, 3))
    views[:, 2] = np.abs(views[:, 2])
    views = jnp.asarray(views / np.linalg.norm(views, axis=-1, keepdims=True), sun.dtype)
    turn = np.array([[math.cos(1), -math.sin(1), 0], [math.sin(1), math.cos(1), 0], [0, 0, 1]])
    flip = np.diag([1.0, -1, 1])
    expected = model(views, sun, *parameters)
    for way, matrix in (
        ("turn with the sun", turn),
        ("be its own mirror image in the plane of sun and zenith", flip),
    ):
        moved = jnp.asarray(matrix, sun.dtype)
        found = model(_times(views, moved), _times(sun[None], moved)[0], *parameters)
        error = float(jnp.max(jnp.abs(found - expected)) / jnp.max(jnp.abs(expected)))
        if error > 1e-3:
            raise ValueError(
                f"the sky must {way}, but its radiance differs by {error:.1e} of the maximum"
            )


def _times(vectors, matrix):
    return matmul(vectors, matrix.T)


def _check_finite(exact, theta, numbers) -> None:
    finite = jnp.isfinite(exact).all(axis=(-2, -1))
    if not finite.all():
        if not is_concrete(finite):
            raise ValueError("the sky is not finite everywhere in its range")
        bad = np.flatnonzero(~np.asarray(finite))
        where = [f"{float(v[bad[0]]):g}" for v in (jnp.degrees(theta), *numbers)]
        raise ValueError(
            f"the sky is not finite at {where[0]} degrees from the zenith and parameters "
            f"{where[1:]}"
        )
