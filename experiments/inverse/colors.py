"""Colors of lights whose shapes are known, one of which is off."""

import dataclasses
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import lsq_linear, nnls

from jaxsh import inverse, midrange, transfer

from ..runner import Context, Table, experiment
from ..shared.subjects import double, load
from ..shared.timing import timed
from .lights import lamp, shade, some, with_noise

_TOWARDS = (
    (-0.8, -0.5, 0.35),
    (0.8, -0.5, 0.3),
    (0.1, 0.4, 0.9),
    (0.7, -0.3, 0.65),  # beside the second: the two are hard to tell apart
)
# The last light is off.
_RADIANCE = ((4.0, 0.6, 0.4), (0.3, 1.0, 3.5), (1.5, 1.4, 1.2), (0.0, 0.0, 0.0))


@dataclasses.dataclass(frozen=True)
class Colors:
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    noise: tuple[float, ...] = (0.0, 0.01, 0.1)
    """standard deviations of the noise, in the mean observed radiance"""
    repeats: int = 8
    """draws of the noise"""
    vertices: int = 2000
    """of those that the mesh has, drawn at random"""
    degree: int = 3
    directions: int = 256
    """directions of the bake"""
    distance: float = 1.8
    """of the lights from the mesh's center, in its radii"""
    size: float = 0.7
    """of their sides"""
    albedo: float = 0.7

    def __post_init__(self):
        if not self.noise or min(self.noise) < 0:
            raise ValueError("noise must be one or more numbers >= 0")
        if min(self.repeats, self.vertices, self.degree) < 1 or self.distance <= 1 + self.size:
            raise ValueError("repeats, vertices and degree at least 1, distance beyond 1 + size")


class Problem(NamedTuple):
    """Radiance at the vertices is `matrix` @ colors."""

    seen: transfer.Transfer
    lights: list[midrange.Polygon]
    matrix: Float[np.ndarray, "v n"]
    truth: Float[np.ndarray, "n 3"]


@experiment("inverse.colors", x64=True)
def colors(config: Colors, context: Context) -> Table:
    """Bounded least squares through JAXopt, beside SciPy's and least squares without bounds."""
    loaded = load(context, config.mesh, config.degree, directions=config.directions)
    name, mesh, baked = double(loaded)
    problem = _problem(config, some(baked, config.vertices, context.seed))
    clean = jnp.asarray(problem.matrix @ problem.truth)
    for level in config.noise:
        for repeat in context.progress(range(config.repeats), f"noise {level:g}"):
            key = jax.random.fold_in(jax.random.fold_in(context.key, repeat), int(1e6 * level))
            observed = with_noise(clean, level, key)
            answers = _answers(problem, observed, config.albedo)
            reference = answers["SciPy nnls"][0]
            for method, (value, seconds) in answers.items():
                context.record(
                    _row(method, level, repeat, value, problem.truth, reference, seconds)
                )
    return _table(config, context, name, len(mesh.vertices), problem)


def _problem(config: Colors, seen: transfer.Transfer) -> Problem:
    lights, columns = [], []
    for towards in _TOWARDS:
        away = config.distance * np.array(towards) / np.linalg.norm(towards)
        light = lamp(away, np.zeros(3), (config.size, config.size), 0.0, np.ones(3)).polygon
        lights.append(light)
        columns.append(np.asarray(shade([light], seen, config.albedo))[:, 0])
    return Problem(seen, lights, np.stack(columns, axis=-1), np.array(_RADIANCE))


def _answers(
    problem: Problem, observed: Float[Array, "v 3"], albedo: float
) -> dict[str, tuple[Float[np.ndarray, "n 3"], float]]:
    """Colors by each method, and its seconds; the first call of ours compiles."""
    matrix, numbers = problem.matrix, np.asarray(observed)

    def bounded():
        found = inverse.fit_colors(observed, problem.seen, albedo, problem.lights)
        return np.asarray(found.value)

    def scipy_bounded():
        return np.stack([lsq_linear(matrix, b, (0, np.inf), tol=1e-14).x for b in numbers.T], -1)

    methods = {
        "ours (JAXopt)": bounded,
        "SciPy lsq_linear": scipy_bounded,
        "SciPy nnls": lambda: np.stack([nnls(matrix, b)[0] for b in numbers.T], -1),
        "no bounds": lambda: np.linalg.lstsq(matrix, numbers)[0],
    }
    return {name: timed(method) for name, method in methods.items()}


def _row(method, level, repeat, value, truth, reference, seconds: float) -> dict[str, Any]:
    on = truth.any(axis=1)
    return {
        "method": method,
        "noise": level,
        "repeat": repeat,
        "value": value,
        "error": float(np.sqrt(np.mean((value - truth)[on] ** 2))),
        "off": float(np.sqrt(np.mean(value[~on] ** 2))),
        "least": float(value.min()),
        "gap": float(np.abs(value - reference).max()),
        "seconds": seconds,
    }


def _table(config: Colors, context: Context, name: str, total: int, problem: Problem) -> Table:
    rows = []
    for level in config.noise:
        for method in dict.fromkeys(row["method"] for row in context.rows):
            of = [r for r in context.rows if r["noise"] == level and r["method"] == method]
            rows.append(
                {
                    "noise": 100 * level,
                    "method": method,
                    "error": float(np.sqrt(np.mean([r["error"] ** 2 for r in of]))),
                    "off": float(np.sqrt(np.mean([r["off"] ** 2 for r in of]))),
                    "least": min(r["least"] for r in of),
                    "negative": sum(r["least"] < 0 for r in of),
                    "gap": max(r["gap"] for r in of),
                    "ms": 1e3 * float(np.median([r["seconds"] for r in of])),
                }
            )

    return Table(
        "Colors of known lights",
        rows=rows,
        values={
            "name": name,
            "seen": len(problem.matrix),
            "total": total,
            "condition": np.linalg.cond(problem.matrix),
        },
    )
