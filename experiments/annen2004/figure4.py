"""Figure 4: a head moved under a local light, whose light is sampled once, in the middle."""

import dataclasses
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import geometry, imaging, midrange, transfer

from ..runner import Column, Context, Table, experiment
from ..shared.lights import exact_light, rectangle
from ..shared.plots import GROUND, Panel, View, camera_on, draw_panels
from ..shared.subjects import Subject, load
from .scenes import psnr

_COLOR = (1.0, 0.93, 0.8)
_TOWARD = (0.0, -1.0, -0.12)  # to the camera: a little from below, where the light is seen
_WIDTH = 0.8  # of a panel, in its heights
_ORDERS = "one sample", "with gradient", "second order"


@dataclasses.dataclass(frozen=True)
class Figure4:
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    shift: float = 0.8
    """how far the head goes to each side; the mesh has radius 1"""
    positions: int = 5
    """odd: the one in the middle has the sample"""
    height: float = 2.4
    """of the light above the sample"""
    forward: float = 0.8
    """of the light before the sample, towards the camera"""
    side: float = 0.8
    """of the square light"""
    degree: int = 4
    """of light and transfer"""
    resolution: int = 64
    """texels along a side of the radiance cube's face"""
    directions: int = 1024
    """directions of the bake"""
    albedo: float = 0.8
    size: int = 400
    """height of a panel, in pixels"""
    samples: int = 2
    """rays along each side of a pixel"""
    gain: float = 4.0
    """of the errors: their colors are full at ± 1/gain of white"""

    def __post_init__(self):
        if self.positions < 3 or self.positions % 2 == 0:
            raise ValueError(f"positions must be odd and at least 3, got {self.positions}")
        if self.shift <= 0 or self.side <= 0 or self.gain <= 0:
            raise ValueError("shift, side and gain must be above 0")
        if self.height <= 1:
            raise ValueError(f"height must be above 1, over the head, got {self.height}")
        if not 0 < self.albedo <= 1:
            raise ValueError(f"albedo must be above 0 and at most 1, got {self.albedo}")
        if self.size < 16 or min(self.resolution, self.directions, self.samples) < 1:
            raise ValueError("size must be at least 16, resolution, directions, samples at least 1")


class Place(NamedTuple):
    """The head at one position: what each order and the exact light make of it."""

    x: float
    mesh: geometry.Mesh
    shaded: dict[str, Float[Array, "v 3"]]
    reference: Float[Array, "v 3"]


@experiment("annen2004.figure4")
def figure4(config: Figure4, context: Context) -> Table:
    subject = load(context, config.mesh, config.degree, directions=config.directions)
    above = np.asarray(subject.centroid) + np.array([0.0, -config.forward, config.height])
    light = rectangle(above, subject.centroid, (config.side, config.side), _COLOR)
    cube = midrange.capture(midrange.Scene([light]), subject.centroid, config.resolution)
    expansion = midrange.taylor(cube, config.degree, 2)
    steps = np.linspace(-config.shift, config.shift, config.positions)
    places = [_place(config, subject, light, expansion, float(x)) for x in steps]
    camera = _camera(config, light, places)
    behind = _lamp(config, camera, light)
    middle = places[config.positions // 2]
    exposure = View.of(middle.mesh, camera, middle.reference).exposure
    panels: dict[str, list[Panel]] = {}
    for place in context.progress(places, "positions"):
        view = View.by(place.mesh, camera, samples=config.samples)._replace(exposure=exposure)
        row = _row(config, view, place)
        context.record(row)
        for name, panel in _panels(config, view, place, row, behind).items():
            panels.setdefault(name, []).append(panel)
    caption = (
        f"{subject.name} under a light that is sampled once, for the head in the middle; the last "
        "row is how far the gradient is from the reference: red where brighter, blue where darker"
    )
    draw_panels(context.path("figure4.png", caption), list(panels.values()))
    return _table(config, subject)


def _place(
    config: Figure4,
    subject: Subject,
    light: midrange.Polygon,
    expansion: midrange.Expansion,
    x: float,
) -> Place:
    """The head so far to the side, light and sample where they were."""
    moved = subject.baked.positions + jnp.asarray([[x, 0.0, 0.0]], subject.baked.positions.dtype)
    baked = eqx.tree_at(lambda t: t.positions, subject.baked, moved)
    mesh = eqx.tree_at(lambda m: m.vertices, subject.mesh, moved)
    shaded = {
        name: midrange.shade(expansion.truncated(order), baked, config.albedo)
        for order, name in enumerate(_ORDERS)
    }
    exact = exact_light([light], moved, config.degree)
    return Place(x, mesh, shaded, transfer.shade_diffuse(exact, baked, config.albedo))


def _camera(config: Figure4, light: midrange.Polygon, places: list[Place]) -> imaging.Camera:
    """One for all panels, that sees the light and the head wherever it goes."""
    seen = jnp.concatenate([light.vertices, places[0].mesh.vertices, places[-1].mesh.vertices])
    return camera_on(
        seen,
        toward=_TOWARD,
        width=round(_WIDTH * config.size),
        height=config.size,
        margin=0.03,
    )


def _lamp(
    config: Figure4, camera: imaging.Camera, light: midrange.Polygon
) -> Float[Array, "h w 3"]:
    """The light itself, behind the head: white on the screen."""
    faces = jnp.asarray([[0, 1, 2], [0, 2, 3]], jnp.int32)
    mesh = geometry.Mesh(light.vertices, faces, jnp.zeros_like(light.vertices))
    raster = imaging.rasterize(mesh, camera, samples=config.samples)
    glow = jnp.broadcast_to(light.radiance[None], light.vertices.shape)
    return imaging.interpolate(raster, glow, GROUND)


def _row(config: Figure4, view: View, place: Place) -> dict[str, Any]:
    row: dict[str, Any] = {"x": place.x}
    for name, values in place.shaded.items():
        of_object, of_picture = view.psnr(values, place.reference)
        row[name] = of_object
        row[f"{name}, picture"] = of_picture
        row[f"{name}, vertices"] = psnr(values, place.reference, view.exposure)
    return row


def _panels(
    config: Figure4, view: View, place: Place, row: dict[str, Any], behind: Float[Array, "h w 3"]
) -> dict[str, Panel]:
    shown = {
        name: Panel(view.shown(place.shaded[name], behind), f"{name}: {row[name]:.1f} dB")
        for name in _ORDERS[:2]
    }
    title = "gradient, its error"
    apart = view.error(title, place.shaded["with gradient"], place.reference, config.gain)
    return shown | {
        "reference": Panel(view.shown(place.reference, behind), "reference"),
        "difference": apart,
    }


def _table(config: Figure4, subject: Subject) -> Table:
    columns = [
        Column("x", "moved by", digits=2),
        *(Column(name, f"{name}, dB", digits=1) for name in _ORDERS),
        *(Column(f"{name}, vertices", f"{name}, vertices, dB", digits=1) for name in _ORDERS),
        Column("with gradient, picture", "with gradient, whole picture, dB", digits=1),
    ]
    return Table(
        "A head under a local light",
        columns,
        values={"subject": subject},
    )
