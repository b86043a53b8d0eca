"""Figures 1 and 5: a mesh under three colored area lights, by one sample and by its gradient."""

import dataclasses
import functools
import operator
from collections.abc import Iterator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsh import imaging, midrange, transfer

from ..runner import Context, Table, experiment
from ..shared.lights import exact_light
from ..shared.plots import Panel, View, draw_panels
from ..shared.subjects import Subject, load
from .scenes import exact_expansion, psnr, three_lights

_WIDTH = 0.8  # of a panel, in its heights
_SHOWN = "one sample", "with gradient", "second order", "2³ grid, half gradient"


@dataclasses.dataclass(frozen=True)
class Figure15:
    meshes: tuple[str, ...] = ()
    """meshes by name; none means the first that the data has"""
    distance: float = 3.0
    """of the lights from the origin; the meshes have radius 1"""
    side: float = 1.0
    """of the square lights"""
    degree: int = 4
    """of light and transfer"""
    resolution: int = 64
    """texels along a side of a radiance cube's face"""
    directions: int = 1024
    """directions of the bake"""
    albedo: float = 0.8
    size: int = 400
    """height of a panel, in pixels"""
    samples: int = 2
    """rays along each side of a pixel"""
    gain: float = 8.0
    """of the errors: their colors are full at ± 1/gain of white"""

    def __post_init__(self):
        if self.distance - self.side <= 1:
            raise ValueError(
                f"distance must be above 1 + side, or lights touch the mesh; got {self.distance} "
                f"with side {self.side}"
            )
        if not 0 < self.albedo <= 1:
            raise ValueError(f"albedo must be above 0 and at most 1, got {self.albedo}")
        if self.size < 16 or min(self.resolution, self.directions, self.samples) < 1:
            raise ValueError("size must be at least 16, resolution, directions, samples at least 1")
        if self.gain <= 0 or self.side <= 0:
            raise ValueError("gain and side must be above 0")


@experiment("annen2004.figure1_5")
def figure1_5(config: Figure15, context: Context) -> list[Table]:
    lights = three_lights(config.distance, config.side)
    for name in context.progress(config.meshes or context.data.meshes()[:1], "meshes"):
        subject = load(context, name, config.degree, directions=config.directions)
        with context.time(f"{name}: reference"):
            exact = exact_light(lights, subject.mesh.vertices, config.degree)
            reference = transfer.shade_diffuse(exact, subject.baked, config.albedo)
            reference.block_until_ready()
        width = round(_WIDTH * config.size)
        camera = imaging.Camera.facing(subject.mesh, width=width, height=config.size)
        view = View.of(subject.mesh, camera, reference, samples=config.samples)
        shaded = {
            "64² cube" if config.resolution == 64 else f"{config.resolution}² cube": _by_cubes(
                config, subject, lights
            ),
            "exact": _exactly(config, subject, lights),
        }
        for source, by_method in shaded.items():
            for method, values in by_method.items():
                of_object, of_picture = view.psnr(values, reference)
                context.record(
                    {
                        "mesh": name,
                        "vertices": len(subject.mesh.vertices),
                        "source": source,
                        "method": method,
                        "psnr_vertices": psnr(values, reference, view.exposure),
                        "psnr_object": of_object,
                        "psnr_picture": of_picture,
                        "relative": 100 * _relative(values, reference),
                    }
                )
        caption = (
            f"{name}: above, what each makes of the light, and the exact light of each vertex; "
            "below, how far each is from it: red where it is brighter, blue where darker"
        )
        _draw(config, context.path(f"{name}.png", caption), view, shaded, reference)
    return list(_tables(config, context.rows))


def _by_cubes(
    config: Figure15, subject: Subject, lights: Sequence[midrange.Polygon]
) -> dict[str, Float[Array, "v 3"]]:
    """From radiance cubes: one in the middle, or one at each corner of the bounding box."""
    scene = midrange.Scene(lights)
    cube = midrange.capture(scene, subject.centroid, config.resolution)
    one = midrange.taylor(cube, config.degree, 3)
    grid = midrange.Grid(*subject.box, (2, 2, 2))
    cubes = midrange.capture(scene, grid.points, config.resolution, progress=False)
    corners = midrange.taylor(cubes, config.degree, 1)
    orders = "one sample", "with gradient", "second order", "third order"
    shaded = {
        name: midrange.shade(one.truncated(order), subject.baked, config.albedo)
        for order, name in enumerate(orders)
    }
    return shaded | _between(config, subject, grid, corners)


def _exactly(
    config: Figure15, subject: Subject, lights: Sequence[midrange.Polygon]
) -> dict[str, Float[Array, "v 3"]]:
    """The same from coefficients without sampling error: what is left is the method's."""
    grid = midrange.Grid(*subject.box, (2, 2, 2))
    points = jnp.concatenate([subject.centroid[None], grid.points])
    found = exact_expansion(lights, points, config.degree)
    one, corners = (jax.tree.map(operator.itemgetter(part), found) for part in (0, slice(1, None)))
    shaded = {
        "one sample": midrange.shade(one.truncated(0), subject.baked, config.albedo),
        "with gradient": midrange.shade(one, subject.baked, config.albedo),
    }
    return shaded | _between(config, subject, grid, corners)


def _between(
    config: Figure15, subject: Subject, grid: midrange.Grid, corners: midrange.Expansion
) -> dict[str, Float[Array, "v 3"]]:
    """Trilinear between the corners of the bounding box, by each rule."""
    weights = grid.weights(subject.baked.positions)
    shade = functools.partial(
        midrange.shade, corners, subject.baked, config.albedo, weights=weights
    )
    return {
        "2³ grid, no gradient": shade(rule="none"),
        "2³ grid, whole gradient": shade(rule="full"),
        "2³ grid, half gradient": shade(rule="half"),
    }


def _relative(values: Float[Array, "v 3"], reference: Float[Array, "v 3"]) -> float:
    return float(jnp.linalg.norm(values - reference) / jnp.linalg.norm(reference))


def _draw(config: Figure15, path, view: View, shaded, reference: Float[Array, "v 3"]) -> None:
    by_method = next(iter(shaded.values()))
    above = [Panel(view.shown(by_method[name]), name) for name in _SHOWN]
    below = [
        view.error(
            f"its error, {view.psnr(by_method[name], reference)[0]:.1f} dB",
            by_method[name],
            reference,
            config.gain,
        )
        for name in _SHOWN
    ]
    draw_panels(path, [[*above, Panel(view.shown(reference), "reference")], below])


def _tables(config: Figure15, rows: list[dict[str, Any]]) -> Iterator[Table]:

    yield Table("Three area lights", rows=rows)
    yield _goals(rows)


def _goals(rows: list[dict[str, Any]]) -> Table:
    """What was asked of one sample, of its second order and of the half rule, mesh by mesh."""
    lines = []
    for mesh in dict.fromkeys(row["mesh"] for row in rows):
        cubes, exact = (
            {r["method"]: r["psnr_object"] for r in rows if r["mesh"] == mesh and test(r["source"])}
            for test in (lambda s: s != "exact", lambda s: s == "exact")
        )
        for goal, least, measured in (
            ("what the gradient gains", 9.0, cubes["with gradient"] - cubes["one sample"]),
            ("second order", 42.0, cubes["second order"]),
            ("2³ grid, half gradient, exact", 49.0, exact["2³ grid, half gradient"]),
        ):
            lines.append({"mesh": mesh, "goal": goal, "least": least, "measured": measured})

    return Table("Goals", rows=lines)
