"""Figure 6: the light that arrives at a vertex, from a sample elsewhere, and as it is there."""

import dataclasses
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.spatial import KDTree

from jaxsh import imaging, midrange, sphere

from ..runner import Column, Context, Table, experiment
from ..shared.lights import exact_light
from ..shared.plots import GROUND, Panel, draw_panels
from .scenes import three_lights

_ORDERS = "sample", "with gradient", "second order"

# The faces of an unfolded cube: row and column, the direction of the face's middle, and what is
# upwards on it. Towards -y, where the mesh looks; the seam is where no light is.
_FACES = (
    (0, 1, (0, 0, 1), (0, 1, 0)),
    (1, 0, (1, 0, 0), (0, 0, 1)),
    (1, 1, (0, -1, 0), (0, 0, 1)),
    (1, 2, (-1, 0, 0), (0, 0, 1)),
    (1, 3, (0, 1, 0), (0, 0, 1)),
    (2, 1, (0, 0, -1), (0, -1, 0)),
)


@dataclasses.dataclass(frozen=True)
class Figure6:
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    quantiles: tuple[float, ...] = (0.5, 1.0)
    """vertices by the error of the gradient there: 0.5 is the median one, 1 the worst"""
    distance: float = 3.0
    """of the lights from the origin; the mesh has radius 1"""
    side: float = 1.0
    """of the square lights"""
    degree: int = 4
    resolution: int = 64
    """texels along a side of a radiance cube's face"""
    size: int = 136
    """height and width of a cube's face in the picture, in pixels"""

    def __post_init__(self):
        if not self.quantiles or not all(0 <= q <= 1 for q in self.quantiles):
            raise ValueError(f"quantiles must be one or more in [0, 1], got {self.quantiles}")
        if self.distance - self.side <= 1:
            raise ValueError(
                f"distance must be above 1 + side, or lights touch the mesh; got {self.distance} "
                f"with side {self.side}"
            )
        if self.side <= 0 or self.degree < 1 or min(self.resolution, self.size) < 1:
            raise ValueError("side must be above 0, degree, resolution and size at least 1")


@experiment("annen2004.figure6")
def figure6(config: Figure6, context: Context) -> Table:
    name = config.mesh or context.data.meshes()[0]
    mesh = context.data.mesh(name)
    lights = three_lights(config.distance, config.side)
    scene = midrange.Scene(lights)
    middle = jnp.mean(mesh.vertices, axis=0)
    cube = midrange.capture(scene, middle, config.resolution)
    expansion = midrange.taylor(cube, config.degree, 2)
    exact = exact_light(lights, mesh.vertices, config.degree)
    errors = _relative(midrange.extrapolate(expansion.truncated(1), mesh.vertices), exact)
    ranked = np.argsort(np.asarray(errors))
    chosen = [int(ranked[round(q * (len(ranked) - 1))]) for q in config.quantiles]
    rows = []
    for quantile, vertex in zip(config.quantiles, chosen, strict=True):
        point = mesh.vertices[vertex]
        found = {
            order: midrange.extrapolate(expansion.truncated(i), point)
            for i, order in enumerate(_ORDERS)
        }
        there = midrange.capture(scene, point, config.resolution)
        found["its own cube"] = midrange.project_cube(there, config.degree)
        row = _row(config, mesh, lights, middle, quantile, vertex)
        for key, light in found.items():
            row[key] = 100 * float(_relative(light, exact[vertex]))
        context.record(row)
        rows.append(_panels(config, cube, there, found, exact[vertex], row))
    caption = (
        "light that arrives, as unfolded cubes seen from within, towards -y: captured in the "
        "middle of the mesh, projected, extrapolated to a vertex; exact there, and captured there. "
        f"Projections of degree {config.degree} at one exposure, cubes at another; light below "
        "zero is black"
    )
    draw_panels(context.path("figure6.png", caption), rows)
    return _table(config, name)


def _relative(light: Float[Array, "*v 3 k"], exact: Float[Array, "*v 3 k"]) -> Float[Array, "*v"]:
    """The L2 error over the sphere and all colors, by Parseval, relative to the light."""
    return jnp.linalg.norm(light - exact, axis=(-2, -1)) / jnp.linalg.norm(exact, axis=(-2, -1))


def _row(config: Figure6, mesh, lights, middle, quantile: float, vertex: int) -> dict[str, Any]:
    point = mesh.vertices[vertex]
    centers = jnp.stack([jnp.mean(light.vertices, axis=0) for light in lights])
    return {
        "quantile": quantile,
        "vertex": vertex,
        "moved": float(jnp.linalg.norm(point - middle)),
        "nearest": float(jnp.min(jnp.linalg.norm(centers - point[None], axis=1))),
    }


def _panels(config: Figure6, cube, there, found, exact, row) -> list[Panel]:
    """A row of the picture: the sample's cube, what is made of it, the truth, and its cube."""
    views, blank = _unfolded(config.size)
    seen = {
        name: sphere.reconstruct(light, jnp.asarray(views, light.dtype)).T
        for name, light in [*found.items(), ("exact", exact)]
    }
    exposure = float(1 / jnp.max(seen["exact"]))
    titles = {
        "sample": f"sample: {row['sample']:.1f} %",
        "with gradient": f"with gradient: {row['with gradient']:.1f} %",
        "second order": f"second order: {row['second order']:.1f} %",
        "exact": "exact at the vertex",
    }
    shown = [Panel(_picture(seen[name] * exposure, blank), title) for name, title in titles.items()]
    first, last = (
        Panel(_picture(_captured(c, views), blank), title)
        for c, title in ((cube, "captured in the middle"), (there, "captured at the vertex"))
    )
    return [first, *shown, last]


def _unfolded(size: int) -> tuple[Float[np.ndarray, "n 3"], np.ndarray]:
    """Directions of the pixels of a cube's cross, (3 size) × (4 size), and where no face is."""
    views = np.zeros((3 * size, 4 * size, 3), np.float32)
    blank = np.ones((3 * size, 4 * size), bool)
    steps = (2 * np.arange(size) + 1) / size - 1
    u, v = np.meshgrid(steps, -steps)
    for i, j, middle, up in _FACES:
        place = np.s_[i * size : (i + 1) * size, j * size : (j + 1) * size]
        right = np.cross(middle, up)
        views[place] = middle + u[..., None] * right + v[..., None] * np.array(up)
        blank[place] = False
    views[blank] = 1.0  # any direction but zero
    return (views / np.linalg.norm(views, axis=-1, keepdims=True)).reshape(-1, 3), blank


def _captured(cube: midrange.RadianceCube, views: Float[np.ndarray, "n 3"]) -> Float[Array, "n 3"]:
    """The texel nearest to each direction."""
    return cube.radiance[KDTree(np.asarray(cube.directions)).query(views)[1]]


def _picture(radiance: Float[Array, "n 3"], blank: np.ndarray) -> Float[np.ndarray, "h w 3"]:
    light = np.asarray(radiance).reshape(*blank.shape, 3)
    light = np.where(blank[..., None], np.float32(GROUND), light)
    return np.asarray(imaging.tone_map(jnp.asarray(light)))


def _table(config: Figure6, name: str) -> Table:
    columns = [
        Column("quantile", "vertex, by error of the gradient", digits=2),
        Column("moved", "from the sample", digits=2),
        Column("nearest", "from the nearest light's center", digits=2),
        *(Column(order, f"{order}, %", digits=1) for order in _ORDERS),
        Column("its own cube", "its own cube, projected, %", digits=1),
    ]
    return Table("Incident light at a vertex", columns, values={"name": name})
