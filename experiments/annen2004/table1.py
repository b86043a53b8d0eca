"""Table 1: frames per second without and with gradient, stage by stage, beside exact light."""

import concurrent.futures
import dataclasses
import functools
import itertools
import statistics
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from jaxsh import geometry, imaging, midrange, transfer

from ..runner import Context, Table, experiment
from ..shared.lights import exact_light
from ..shared.process import cores
from ..shared.subjects import Subject, load
from ..shared.timing import timed
from .scenes import three_lights

_SIZE = 512  # of the picture, as in §7
_TURN = 0.05  # of the lights about the vertical from frame to frame, in radians
_STAGES = "trace", "project", "shade", "raster", "draw"
_WAYS = "without", "with"
_EXACT = "exact per vertex", "exact with gradient"

T = TypeVar("T")

# Model, frames per second without and with gradient.
_PAPER = {
    "maxplanck_25k": ("Planck", 25_000, 23.8, 19.7),
    "bird_falcon": ("Bird", 32_000, 8.4, 7.9),
    "tooth": ("Tooth", 2_500, 40.3, 34.5),
}


@dataclasses.dataclass(frozen=True)
class Table1:
    meshes: tuple[str, ...] = ()
    """meshes by name; none means the first that the data has"""
    frames: int = 20
    """frames of each kind, in turns"""
    distance: float = 3.0
    """of the lights from the origin; the meshes have radius 1"""
    side: float = 1.0
    """of the square lights"""
    degree: int = 4
    """of light and transfer"""
    resolution: int = 64
    """texels along a side of the radiance cube's face"""
    directions: int = 512
    """directions of the bake"""
    albedo: float = 0.8

    def __post_init__(self):
        if self.frames < 1 or min(self.resolution, self.directions) < 1 or self.degree < 1:
            raise ValueError("frames, degree, resolution and directions must be at least 1")
        if self.distance - self.side <= 1 or self.side <= 0:
            raise ValueError(
                f"side must be above 0 and distance above 1 + side, or lights touch the mesh; got "
                f"{self.distance} and {self.side}"
            )
        if not 0 < self.albedo <= 1:
            raise ValueError(f"albedo must be above 0 and at most 1, got {self.albedo}")


class Frame(NamedTuple):
    """What does not change from frame to frame."""

    config: Table1
    subject: Subject
    camera: imaging.Camera
    rays: geometry.RayScene
    exposure: float

    def draw(self, lights: tuple[midrange.Polygon, ...], way: str) -> dict[str, float]:
        """One picture under the lights; seconds by stage."""
        config, subject = self.config, self.subject
        seconds: dict[str, float] = {}

        def staged(stage: str, function: Callable[..., T], *arguments: Any) -> T:
            result, seconds[stage] = timed(function, *arguments)
            return result

        if way in _EXACT:
            at = subject.baked.positions
            arguments = lights, at, config.degree, way == _EXACT[1]
            light, *_ = staged("project", _exact_on_all_cores, *arguments)
            shaded = staged("shade", transfer.shade_diffuse, light, subject.baked, config.albedo)
        else:
            cube = staged("trace", self._capture, lights)
            order = _WAYS.index(way)
            expansion = staged("project", midrange.taylor, cube, config.degree, order)
            shaded = staged("shade", midrange.shade, expansion, subject.baked, config.albedo)
        raster = staged("raster", self._raster)
        staged("draw", _develop, raster, shaded, self.exposure)
        return seconds

    def _raster(self) -> imaging.Raster:
        return imaging.rasterize(self.subject.mesh, self.camera, scene=self.rays)

    def _capture(self, lights: tuple[midrange.Polygon, ...]) -> midrange.RadianceCube:
        scene = midrange.Scene(lights)
        return midrange.capture(scene, self.subject.centroid, self.config.resolution)


def _exact_on_all_cores(
    lights: tuple[midrange.Polygon, ...], positions: Array, degree: int, gradient: bool
) -> tuple[Array, ...]:
    """Light at each vertex, and gradients of as many vertices for each core, in threads.

    A block of vertices is one thread's work, and XLA gives its other threads none of the blocks.
    """
    threads = cores()
    shares = [int(share) for share in np.linspace(0, len(positions), threads + 1)]
    with concurrent.futures.ThreadPoolExecutor(threads) as pool:
        parts = pool.map(
            lambda first, last: _exact(lights, positions[first:last], degree, gradient),
            *(shares[:-1], shares[1:]),
        )
        light, *gradients = zip(*parts, strict=True)
        return _joined(light), *itertools.chain(*gradients)


@functools.partial(jax.jit, static_argnums=(2, 3))
def _exact(lights, positions, degree, gradient):
    if not gradient:
        return (exact_light(lights, positions, degree),)
    each = [midrange.polygon_harmonics_with_gradient(one, positions, degree) for one in lights]
    return jax.tree.map(lambda *parts: sum(parts[1:], parts[0]), *each)


@jax.jit
def _joined(parts):
    return jnp.concatenate(parts)


@jax.jit
def _develop(raster, shaded, exposure):
    return imaging.tone_map(imaging.interpolate(raster, shaded), exposure)


@experiment("annen2004.table1")
def table1(config: Table1, context: Context) -> list[Table]:
    stages = []
    for name in config.meshes or context.data.meshes()[:1]:
        subject = load(context, name, config.degree, directions=config.directions)
        camera = imaging.Camera.facing(subject.mesh, width=_SIZE, height=_SIZE)
        frame = Frame(config, subject, camera, geometry.ray_scene(subject.mesh), 1.0)
        moving = [_turned(config, _TURN * step) for step in range(config.frames + 1)]
        for way in (*_WAYS, *_EXACT):
            with context.time(f"{name}: first frame {way}, which compiles"):
                frame.draw(moving[0], way)
        taken: dict[str, list[dict[str, float]]] = {way: [] for way in (*_WAYS, *_EXACT)}
        for lights in context.progress(moving[1:], name):
            for way, frames in taken.items():
                frames.append(frame.draw(lights, way))
        by_way = {way: _milliseconds(frames) for way, frames in taken.items()}
        context.record(_row(name, subject, by_way))
        for way, spent in by_way.items():
            stages.append({"mesh": name, "way": way} | spent)
            context.record(stages[-1])
    return list(_tables(config, context.rows, stages))


def _turned(config: Table1, angle: float) -> tuple[midrange.Polygon, ...]:
    """The lights, turned about the vertical."""
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]], np.float32)
    return tuple(
        midrange.Polygon(light.vertices @ turn, light.radiance)
        for light in three_lights(config.distance, config.side)
    )


def _milliseconds(frames: list[dict[str, float]]) -> dict[str, float]:
    """The median frame: each stage, all of them, and all but the raster."""
    spent = {stage: 1e3 * statistics.median(f[stage] for f in frames) for stage in frames[0]}
    spent["frame"] = 1e3 * statistics.median(sum(f.values()) for f in frames)
    still = (sum(f.values()) - f["raster"] for f in frames)
    return spent | {"still": 1e3 * statistics.median(still)}


def _row(name: str, subject: Subject, by_way: dict[str, dict[str, float]]) -> dict[str, Any]:
    row: dict[str, Any] = {"mesh": name, "vertices": len(subject.mesh.vertices)}
    for kind in ("frame", "still"):
        rates = {way: 1e3 / spent[kind] for way, spent in by_way.items()}
        row |= {f"{kind} {way}": rate for way, rate in rates.items()}
        row[f"{kind} ratio"] = rates["with"] / rates["without"]
    if name in _PAPER:
        model, count, without, with_gradient = _PAPER[name]
        row |= {
            "model": model,
            "vertices_paper": count,
            "without_paper": without,
            "with_paper": with_gradient,
            "ratio_paper": with_gradient / without,
        }
    return row


def _tables(
    config: Table1, rows: list[dict[str, Any]], stages: list[dict[str, Any]]
) -> Iterator[Table]:
    models = [row for row in rows if "frame ratio" in row]
    yield Table(
        "Frames per second",
        rows=models,
        values={"size": _SIZE},
    )
    yield Table("The same without the raster", rows=models)
    yield Table("Milliseconds by stage", rows=stages)
    yield Table(
        "Goals",
        rows=_goals(models[0], stages[:2]),
        values={"mesh": models[0]["mesh"]},
    )


def _goals(model: dict[str, Any], stages: list[dict[str, Any]]) -> list[dict[str, Any]]:
    less, more = stages
    ratios = {
        "frames per second with / without gradient, whole": ("≥ 0.75", model["frame ratio"]),
        "the same without the raster": ("≥ 0.75", model["still ratio"]),
        "projecting with / without gradient": (
            "≤ 4",
            more["project"] / less["project"],
        ),
        "shading with / without gradient": ("≤ 3", more["shade"] / less["shade"]),
    }
    return [
        {"goal": goal, "limit": limit, "measured": measured}
        for goal, (limit, measured) in ratios.items()
    ]
