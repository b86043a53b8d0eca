"""Where to take samples and how many: placements compared, and samples that come and go."""

import dataclasses
import functools
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import harmonics, imaging, midrange

from ..runner import Column, Context, Table, experiment
from ..shared.lights import exact_light, rectangle
from ..shared.plots import Panel, View, draw_panels
from ..shared.subjects import Subject, load
from ..shared.tables import named
from .dots import glass
from .methods import EXPONENTS, Trial, exact_samples, inner_grid
from .plots import draw_frames, draw_placement
from .scenes import RED, three_lights

_GRID = "inner grid, half gradient"
_PATH = (-3.0, 3.0)  # of the moving light along x, in the object's radius


@dataclasses.dataclass(frozen=True)
class Placement:
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    distances: tuple[float, ...] = (1.2, 2.0)
    """of three lights from the origin; the meshes have radius 1"""
    counts: tuple[int, ...] = (1, 2, 4, 8, 16)
    """numbers of samples"""
    grids: tuple[int, ...] = (2, 3)
    """samples along each side of a grid over the bounding box"""
    frames: int = 16
    """of the animation"""
    gap: float = 1.6
    """between the origin and the path of the light that moves"""
    target: float = 0.05
    """error of the irradiance that samples are added to stay below"""
    limit: int = 24
    """the most samples of the animation"""
    degree: int = 4
    """of light and transfer"""
    directions: int = 1024
    """directions of the bake"""
    size: int = 400
    """height of a panel, in pixels"""

    def __post_init__(self):
        if not self.distances or min(*self.distances, self.gap) <= 1:
            raise ValueError("distances (one or more) and gap must be above 1, the object's radius")
        if not self.counts or min(self.counts) < 1 or min(self.grids, default=2) < 2:
            raise ValueError("counts must be one or more numbers >= 1, grids >= 2")
        if self.frames < 2 or not 0 < self.target < 1 or self.size < 16:
            raise ValueError("frames at least 2, target between 0 and 1, size at least 16 pixels")


class Moment(NamedTuple):
    """A frame: the samples then, and what they make of the light."""

    frame: int
    points: Float[np.ndarray, "s 3"]
    trial: Trial
    radiance: Float[Array, "v 3"]


@experiment("annen2004.placement", x64=True)
def placement(config: Placement, context: Context) -> list[Table]:
    subject = load(context, config.mesh, config.degree, directions=config.directions)
    for distance in context.progress(config.distances, "distances"):
        for row in _placed(config, context, subject, distance):
            context.record(row)
    moments = list(_animation(config, context, subject))
    placed = [row for row in context.rows if "method" in row]
    frames = [row for row in context.rows if "frame" in row]
    caption = "PSNR by the number of samples, for each placement, with the lights at two distances"
    draw_placement(context.path("placement.png", caption), placed)
    caption = "error of the irradiance as a light moves past, and the samples that it takes"
    draw_frames(context.path("frames.png", caption), frames, config.target)
    caption = "above, the object as the samples below light it; dots: the samples, as in glass"
    _draw(config, context.path("animation.png", caption), moments)
    return list(_tables(config, subject, placed, frames))


def _placed(
    config: Placement, context: Context, subject: Subject, distance: float
) -> Iterator[dict[str, Any]]:
    """A row for each placement and number of samples."""
    lights = three_lights(distance, 1.0)
    positions = subject.mesh.vertices.astype(float)
    exact = exact_light(lights, positions, config.degree)
    trial = Trial.of(subject, exact)
    evaluate = _evaluate(lights, config.degree)
    for count in config.counts:
        for method in ("kmeans", "farthest", "greedy"):
            points = midrange.place_samples(
                positions,
                count,
                method=method,
                evaluate=evaluate if method == "greedy" else None,
                seed=context.seed,
            )
            best = trial.blend(evaluate(points), "full")
            error = _error(evaluate, positions, exact, points)
            yield {
                "scene": f"lights at {distance:g}",
                "method": {"kmeans": "k-means", "farthest": "farthest point"}.get(method, method),
                "samples": len(points),
                "psnr": best.psnr,
                "exponent": best.exponent if len(points) > 1 else None,
                "error": error,
            }
    for n in config.grids:
        grid = inner_grid(subject, n)
        weights = grid.weights(subject.baked.positions)
        radiance = trial.shade(evaluate(np.asarray(grid.points, np.float64)), weights, "half")
        yield {
            "scene": f"lights at {distance:g}",
            "method": _GRID,
            "samples": n**3,
            "psnr": trial.psnr(radiance),
        }


def _evaluate(
    lights: Sequence[midrange.Polygon], degree: int
) -> Callable[[Float[np.ndarray, "n 3"]], midrange.Expansion]:
    return lambda points: exact_samples(lights, points, degree)


def _moving_light(config: Placement, frame: int) -> tuple[midrange.Polygon, ...]:
    """A light that passes in front of the object and above, and two that stay."""
    x = float(np.linspace(*_PATH, config.frames)[frame])
    center = np.array([x, -0.8 * config.gap, 0.6 * config.gap])
    moving = rectangle(center, (x, 0.0, 0.0), (0.8, 0.8), 2.0 * np.array(RED))
    return moving, *three_lights(3.0, 1.0)[1:]


def _animation(config: Placement, context: Context, subject: Subject) -> Iterator[Moment]:
    """Samples added and removed frame by frame, beside one and eight that stay."""
    positions = np.asarray(subject.mesh.vertices, np.float64)
    place = functools.partial(midrange.place_samples, positions, seed=context.seed)
    fixed = {"one": place(1), "eight": place(min(8, config.limit))}
    candidates, points = place(min(64, len(positions))), place(1)
    for frame in context.progress(range(config.frames), "frames"):
        lights = _moving_light(config, frame)
        evaluate = _evaluate(lights, config.degree)
        update = midrange.update_samples(
            points,
            candidates,
            positions,
            evaluate,
            target=config.target,
            limit=config.limit,
            seed=context.seed,
        )
        points = update.points
        exact = exact_light(lights, jnp.asarray(positions), config.degree)
        trial = Trial.of(subject, exact)
        error = functools.partial(_error, evaluate, jnp.asarray(positions), exact)
        weights = midrange.inverse_distance_weights(positions, points, exponent=6.0)
        radiance = trial.shade(evaluate(points), weights)
        context.record(
            {
                "frame": frame,
                "samples": len(points),
                "added": len(update.added),
                "removed": int(update.removed.sum()),
                "predicted": 100 * update.error,
                "error": error(points),
                "psnr": trial.psnr(radiance),
            }
            | {name: error(places) for name, places in fixed.items()}
        )
        yield Moment(frame, points, trial, radiance)


def _error(
    evaluate: Callable[[Float[np.ndarray, "n 3"]], midrange.Expansion],
    positions: Float[Array, "v 3"],
    exact: Float[Array, "v 3 k"],
    points: Float[np.ndarray, "s 3"],
) -> float:
    """Relative RMS error of the irradiance over all vertices and normals, %."""
    weights = midrange.inverse_distance_weights(positions, points, exponent=6.0)
    light = midrange.interpolate(evaluate(points), weights, positions)
    cosine = harmonics.clamped_cosine(harmonics.degree_of(exact.shape[-1]))
    wrong, right = (harmonics.convolve(a, cosine) for a in (light - exact, exact))
    return 100 * float(jnp.linalg.norm(wrong) / jnp.linalg.norm(right))


def _draw(config: Placement, path, moments: list[Moment], shown: int = 6) -> None:
    """Some frames, all at the exposure of the brightest."""
    chosen = [moments[i] for i in np.linspace(0, len(moments) - 1, shown).round().astype(int)]
    mesh = chosen[0].trial.subject.mesh
    camera = imaging.Camera.facing(mesh, width=round(0.8 * config.size), height=config.size)
    views = [View.of(mesh, camera, moment.trial.reference, samples=2) for moment in chosen]
    exposure = min(view.exposure for view in views)
    view = views[0]._replace(exposure=exposure)
    above = [Panel(view.shown(moment.radiance), f"frame {moment.frame}") for moment in chosen]
    below = [
        Panel(glass(view, camera, moment.points, samples=2), f"{len(moment.points)} samples")
        for moment in chosen
    ]
    draw_panels(path, [above, below])


def _tables(
    config: Placement,
    subject: Subject,
    placed: list[dict[str, Any]],
    frames: list[dict[str, Any]],
) -> Iterator[Table]:
    lines: dict[tuple[str, int], dict[str, Any]] = {}
    for row in placed:
        key = row["scene"], row["samples"]
        line = lines.setdefault(key, {"scene": key[0], "samples": key[1]})
        line[row["method"]] = row["psnr"]
        if "error" in row:
            line[f"error {row['method']}"] = row["error"]
    methods = dict.fromkeys(row["method"] for row in placed)
    columns = [
        *named("scene", "samples"),
        *(Column(method, f"{method}, dB", digits=1) for method in methods),
        *(
            Column(f"error {method}", f"{method}: error, %", digits=2)
            for method in methods
            if method != _GRID
        ),
    ]
    ordered = [lines[key] for key in sorted(lines)]
    yield Table(
        "PSNR by placement and samples",
        columns,
        ordered,
        values={
            "subject": subject,
            "exponents": ", ".join(f"{b:g}" for b in EXPONENTS),
        },
    )

    yield Table("Samples that come and go", rows=frames, note=_verdict(config, frames))


def _verdict(config: Placement, frames: list[dict[str, Any]]) -> str:
    target = 100 * config.target
    kept = sum(row["error"] <= target for row in frames)
    worst = max(row["error"] for row in frames)
    mean = sum(row["samples"] for row in frames) / len(frames)
    eight = sum(row["eight"] <= target for row in frames)
    return (
        f"A light passes {config.gap:g} from the object's center; error is the relative RMS error "
        "of the irradiance over vertices and normals, predicted by update_samples from 128 of the "
        f"vertices. Target {target:g} %, release {target / 2:g} %: at all vertices it is kept in "
        f"{kept} of {len(frames)} frames, {worst:.1f} % at worst, with {mean:.1f} samples on "
        f"average; eight k-means samples that stay keep it in {eight}."
    )
