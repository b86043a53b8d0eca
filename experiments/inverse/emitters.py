"""Place, size and color of area lights, from the shaded vertices of a mesh and rough guesses."""

import dataclasses
import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import inverse, midrange, transfer

from ..runner import Context, Table, experiment
from ..shared.subjects import double, load
from ..shared.timing import timed
from .emitters_picture import Scene, draw
from .lights import lamp, shade, some, with_noise

Lights = tuple[inverse.Rectangle, ...]

_APART = np.cos(np.radians(60))  # between directions to two lights


@dataclasses.dataclass(frozen=True)
class Emitters:
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    lights: tuple[int, ...] = (1, 2)
    """how many lights at once"""
    settings: int = 3
    """scenes for each number of lights, drawn at random"""
    noise: tuple[float, ...] = (0.0, 0.01)
    """standard deviations of the noise, in the mean observed radiance"""
    vertices: int = 500
    """of those that the mesh has, drawn at random: what the fit sees"""
    degree: int = 3
    directions: int = 256
    """directions of the bake"""
    candidates: int = 32
    """rough guesses, of which the best serve as starts"""
    starts: int = 2
    max_steps: int = 100
    albedo: float = 0.7
    height: int = 480
    """of the pictures, in pixels"""

    def __post_init__(self):
        if not self.noise or min(self.noise) < 0 or not self.lights or min(self.lights) < 1:
            raise ValueError("noise must be numbers >= 0, lights numbers >= 1, at least one each")
        if min(self.settings, self.starts, self.degree) < 1 or self.candidates < self.starts:
            raise ValueError("settings, starts and degree at least 1, candidates at least starts")
        if not 0 < self.albedo <= 1:
            raise ValueError(f"albedo must be above 0 and at most 1, got {self.albedo}")


class Errors(NamedTuple):
    """Of one light: of its center, in radii of the mesh; of sizes and radiances, relative."""

    center: float
    size: float
    radiance: float


@experiment("inverse.emitters", x64=True)
def emitters(config: Emitters, context: Context) -> Table:
    """Recovered from shading alone, beside the truth."""
    loaded = load(context, config.mesh, config.degree, directions=config.directions)
    name, mesh, baked = double(loaded)
    seen = some(baked, config.vertices, context.seed)
    rng = np.random.default_rng(context.seed)
    shown: Scene | None = None
    for count in config.lights:
        guesses = [_guess(rng, count) for _ in range(config.candidates)]
        for number in context.progress(range(config.settings), f"{count} lights"):
            truth = _truth(rng, count)
            clean = shade([light.polygon for light in truth], seen, config.albedo)
            for level in config.noise:
                key = jax.random.fold_in(jax.random.fold_in(context.key, 97 * count + number), 1)
                observed = with_noise(clean, level, key)
                (starts, found), seconds = timed(_fit, observed, seen, config, guesses)
                order = _match(found.value, truth)
                context.record(_row(count, number, level, truth, found, order, seconds))
                if number == 0:
                    recovered = tuple(found.value[i] for i in order)
                    shown = Scene(level, truth, recovered, starts)
    assert shown is not None
    caption = (
        f"{name} under the last number of lights, with noise: as observed, drawn again with the "
        "lights recovered, what is wrong with that; and from aside, the outlines of the true "
        "lights, of those recovered, and of the best start"
    )
    draw(context.path("recovered.png", caption), mesh, baked, shown, config, context.key)
    return _table(config, context, name, len(mesh.vertices), len(seen.positions))


def _directions(rng: np.random.Generator, count: int) -> list[Float[np.ndarray, " 3"]]:
    """Unit vectors, at random, no two closer than 60 degrees."""
    chosen: list[np.ndarray] = []
    while len(chosen) < count:
        draw = rng.normal(size=3)
        draw /= np.linalg.norm(draw)
        if all(draw @ other < _APART for other in chosen):
            chosen.append(draw)
    return chosen


def _truth(rng: np.random.Generator, count: int) -> Lights:
    lights = []
    for towards in _directions(rng, count):
        away, target = rng.uniform(1.4, 2.2) * towards, 0.3 * rng.uniform(-1, 1, 3)
        width, height = rng.uniform(0.4, 0.9, 2)
        roll, color = rng.uniform(0, np.pi), rng.uniform(0.5, 4, 3)
        lights.append(lamp(away, target, (width, height), roll, color))
    return tuple(lights)


def _guess(rng: np.random.Generator, count: int) -> Lights:
    """Somewhere around the mesh, at a middling distance and size, level, white."""
    return tuple(
        lamp(1.8 * towards, np.zeros(3), (0.65, 0.65), 0.0, np.ones(3))
        for towards in _directions(rng, count)
    )


def _starts(
    observed: Float[Array, "v 3"],
    seen: transfer.Transfer,
    config: Emitters,
    guesses: Sequence[Lights],
) -> list[list[midrange.Polygon]]:
    """The guesses that explain most with the colors that suit each best, in these colors."""
    rated = []
    for guess in guesses:
        shapes = [light.polygon for light in guess]
        found = inverse.fit_colors(observed, seen, config.albedo, shapes, throw=False)
        # A light that is off would have no slope.
        colors = jnp.maximum(found.value, 0.05 * found.value.max())
        polygons = [
            midrange.Polygon(shape.vertices, color)
            for shape, color in zip(shapes, colors, strict=True)
        ]
        rated.append((float(found.statistics.residual), polygons))
    rated.sort(key=lambda pair: pair[0])
    return [polygons for _, polygons in rated[: config.starts]]


def _fit(observed, seen: transfer.Transfer, config: Emitters, guesses: Sequence[Lights]):
    """The starts, and what is recovered from them."""
    starts = _starts(observed, seen, config, guesses)
    options = {"max_steps": config.max_steps, "throw": False}
    return starts, inverse.fit_polygons(observed, seen, config.albedo, starts, **options)


def _match(found: Lights, truth: Lights) -> tuple[int, ...]:
    """Which of the recovered lights is which of the true ones: they come in no order."""
    apart = np.array([[np.linalg.norm(a.center - b.center) for b in found] for a in truth])
    return min(
        itertools.permutations(range(len(truth))),
        key=lambda order: sum(apart[i, j] for i, j in enumerate(order)),
    )


def _swapped(found: inverse.Rectangle, truth: inverse.Rectangle) -> bool:
    """Whether what is its width is the other's height: a rectangle is the same, turned by 90°."""
    corners, others = np.asarray(found.vertices), np.asarray(truth.vertices)
    gaps = [np.linalg.norm(np.roll(corners, turn, axis=0) - others) for turn in range(4)]
    return int(np.argmin(gaps)) % 2 == 1


def _errors(found: inverse.Rectangle, truth: inverse.Rectangle) -> Errors:
    size = found.size[::-1] if _swapped(found, truth) else found.size
    relative = [
        float(jnp.sqrt(jnp.mean((a / b - 1) ** 2)))
        for a, b in ((size, truth.size), (found.radiance, truth.radiance))
    ]
    return Errors(float(jnp.linalg.norm(found.center - truth.center)), *relative)


def _expected(deviation: inverse.Rectangle, found: inverse.Rectangle) -> Errors:
    """What the fit itself says of its errors, in the same units."""
    relative = [
        float(jnp.sqrt(jnp.mean((a / b) ** 2)))
        for a, b in ((deviation.size, found.size), (deviation.radiance, found.radiance))
    ]
    return Errors(float(jnp.linalg.norm(deviation.center)), *relative)


def _row(count, number, level, truth: Lights, found, order, seconds: float) -> dict[str, Any]:
    lights = [found.value[i] for i in order]
    deviations = [found.confidence.deviation[i] for i in order]
    errors = [_errors(a, b) for a, b in zip(lights, truth, strict=True)]
    said = [_expected(a, b) for a, b in zip(deviations, lights, strict=True)]
    row = {
        "lights": count,
        "setting": number,
        "noise": level,
        "residual": float(found.statistics.residual),
        "steps": int(found.statistics.steps),
        "agreeing": int(found.statistics.agreeing) / found.statistics.starts,
        "converged": found.converged,
        "seconds": seconds,
    }
    for key in Errors._fields:
        row[f"{key}_error"] = np.array([getattr(error, key) for error in errors])
        row[f"{key}_deviation"] = np.array([getattr(error, key) for error in said])
    return row


def _table(config: Emitters, context: Context, name: str, total: int, seen: int) -> Table:
    rows = []
    for count, level in itertools.product(config.lights, config.noise):
        of = [r for r in context.rows if r["lights"] == count and r["noise"] == level]
        row = {
            "lights": count,
            "noise": 100 * level,
            "failed": sum(not r["converged"] for r in of),
            "agreeing": 100 * float(np.mean([r["agreeing"] for r in of])),
            "steps": float(np.median([r["steps"] for r in of])),
            "seconds": float(np.median([r["seconds"] for r in of])),
        }
        for key in Errors._fields:
            unit = 1 if key == "center" else 100
            for what in ("error", "deviation"):
                values = np.concatenate([np.atleast_1d(r[f"{key}_{what}"]) for r in of])
                row[f"{key}_{what}"] = unit * float(np.sqrt(np.mean(values**2)))
        rows.append(row)

    return Table(
        "Area lights from a shaded mesh",
        rows=rows,
        values={"name": name, "seen": seen, "total": total},
    )
