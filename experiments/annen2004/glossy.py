"""Glossy near light (§4.2): coefficients at every vertex from few samples, through a lobe."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsh import imaging, midrange, transfer

from ..runner import Column, Context, Table, experiment
from ..shared.lights import exact_light
from ..shared.plots import Panel, View, draw_panels
from ..shared.subjects import Subject, load
from .methods import box_grid, expand, take
from .scenes import exact_expansion, three_lights

_WIDTH = 0.8  # of a panel, in its heights
_ORDERS = "one sample", "with gradient", "second order"
_GRIDS = {2: "2³ grid, half gradient", 4: "4³ grid, half gradient"}


@dataclasses.dataclass(frozen=True)
class Glossy:
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    distance: float = 3.0
    """of the lights from the origin; the meshes have radius 1"""
    side: float = 1.0
    """of the square lights"""
    degree: int = 6
    """of light, transfer and lobe"""
    exponents: tuple[float, ...] = (32.0, 8.0)
    """of the lobe; pictures are of the first"""
    diffuse: float = 0.3
    """diffuse albedo in the pictures"""
    specular: float = 0.5
    """specular albedo in the pictures"""
    directions: int = 1024
    """directions of the bake"""
    size: int = 400
    """height of a panel, in pixels"""
    samples: int = 2
    """rays along each side of a pixel"""
    gain: float = 8.0
    """of the errors: their colors are full at ± 1/gain of white"""

    def __post_init__(self):
        if self.distance - self.side <= 1 or self.side <= 0:
            raise ValueError("distance must be above 1 + side, or lights touch the mesh")
        if not self.exponents or min(self.exponents) <= 0 or self.gain <= 0:
            raise ValueError("exponents (one or more) and gain must be above 0")
        if self.size < 16 or min(self.directions, self.samples) < 1:
            raise ValueError("size must be at least 16, samples and directions at least 1")


class Surface(NamedTuple):
    """What is measured: a material, and its name."""

    name: str
    material: transfer.Material


@experiment("annen2004.glossy")
def glossy(config: Glossy, context: Context) -> list[Table]:
    """A glossy mesh near lights, from few samples and by the light of each vertex (§4.2)."""
    subject = load(context, config.mesh, config.degree, directions=config.directions)
    lights = three_lights(config.distance, config.side)
    with context.time("light of each vertex"):
        exact = exact_light(lights, subject.mesh.vertices, config.degree)
        jax.block_until_ready(exact)
    by = dict(_approximate(config, subject, lights))
    width = round(_WIDTH * config.size)
    camera = imaging.Camera.facing(subject.mesh, width=width, height=config.size)
    for surface in context.progress(list(_surfaces(config)), "surfaces"):

        def shade(light: Float[Array, "v 3 k"], surface: Surface = surface):
            return transfer.shade_glossy(light, subject.baked, camera.position, surface.material)

        reference = shade(exact)
        view = View.of(subject.mesh, camera, reference, samples=config.samples)
        shaded = {name: shade(light) for name, light in by.items()}
        line: dict[str, Any] = {"surface": surface.name}
        for name, radiance in shaded.items():
            line[name], _ = view.psnr(radiance, reference)
        context.record(line)
        if surface.name == _shown(config):
            caption = (
                f"{subject.name}, {surface.name}: above, light from few samples, and of each "
                "vertex; below, how far each is from it: red where brighter, blue where darker"
            )
            _draw(config, context.path("glossy.png", caption), view, shaded, reference)
    return [_table(config, context.rows, subject)]


def _approximate(
    config: Glossy, subject: Subject, lights: tuple[midrange.Polygon, ...]
) -> Iterator[tuple[str, Float[Array, "v 3 k"]]]:
    """Coefficients at every vertex from samples whose own are exact."""
    vertices = subject.mesh.vertices
    one = expand(lights, subject.centroid[None], config.degree, 2)
    one = jax.tree.map(lambda a: a[0], one)
    for order, name in enumerate(_ORDERS):
        yield name, midrange.extrapolate(one.truncated(order), vertices)
    grids = [box_grid(subject, count) for count in _GRIDS]
    points = jnp.concatenate([grid.points for grid in grids])
    expansions, start = exact_expansion(lights, points, config.degree), 0
    for name, grid in zip(_GRIDS.values(), grids, strict=True):
        samples = take(expansions, slice(start, start := start + len(grid.points)))
        yield name, midrange.interpolate(samples, grid.weights(vertices), vertices, rule="half")


def _surfaces(config: Glossy) -> Iterator[Surface]:
    yield Surface("diffuse", transfer.Material(1.0, 0.0, config.exponents[0]))
    for exponent in config.exponents:
        yield Surface(f"glossy, {exponent:g}", transfer.Material(0.0, 1.0, exponent))
    both = transfer.Material(config.diffuse, config.specular, config.exponents[0])
    yield Surface(_shown(config), both)


def _shown(config: Glossy) -> str:
    return f"diffuse {config.diffuse:g} + glossy {config.specular:g}, {config.exponents[0]:g}"


def _draw(config: Glossy, path: Path, view: View, shaded: dict[str, Array], reference) -> None:
    above = [Panel(view.shown(radiance), name) for name, radiance in shaded.items()]
    below = [
        view.error(
            f"its error, {view.psnr(radiance, reference)[0]:.1f} dB",
            radiance,
            reference,
            config.gain,
        )
        for radiance in shaded.values()
    ]
    draw_panels(path, [[*above, Panel(view.shown(reference), "light of each vertex")], below])


def _table(config: Glossy, rows: list[dict[str, Any]], subject: Subject) -> Table:
    columns = [Column("surface", "surface, exponent")]
    columns += [Column(name, f"{name}, dB", digits=1) for name in (*_ORDERS, *_GRIDS.values())]
    return Table(
        "Glossy surfaces near light",
        columns,
        rows,
        values={"subject": subject},
    )
