"""What the experiments on Annen et al. 2004 share: baked meshes, area lights, light at vertices.

The meshes have a bounding sphere of radius 1 around the origin, +z up, and look along -y.
Distances are in that radius.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxsh import geometry, imaging, midrange, transfer

from ..runner import Context

RED, GREEN, BLUE = (1.0, 0.18, 0.12), (0.2, 0.9, 0.25), (0.15, 0.3, 1.0)

# Of the three lights of figures 1 and 5, as the camera sees them: left, right, and above behind.
_TOWARDS = (-0.85, -0.55, 0.2), (0.8, -0.45, 0.35), (0.15, 0.35, 0.95)


Vector = Sequence[float] | Float[Array | np.ndarray, " 3"]


class Subject(NamedTuple):
    """A mesh and its transfer, with shadows."""

    name: str
    mesh: geometry.Mesh
    baked: transfer.Transfer

    @property
    def about(self) -> str:
        """Its name and size, for a note."""
        return f"{self.name}, {len(self.mesh.vertices):,} vertices"

    @property
    def centroid(self) -> Float[Array, " 3"]:
        """Of the vertices: where the paper takes a single sample (§5)."""
        return jnp.mean(self.mesh.vertices, axis=0)

    @property
    def box(self) -> tuple[Float[Array, " 3"], Float[Array, " 3"]]:
        """The corners of the bounding box."""
        return jnp.min(self.mesh.vertices, axis=0), jnp.max(self.mesh.vertices, axis=0)


def load(context: Context, name: str | None, degree: int, *, directions: int = 1024) -> Subject:
    """A mesh of the data, the first where none is named; its bake is timed."""
    name = name or context.data.meshes()[0]
    mesh = context.data.mesh(name)
    with context.time(f"{name}: bake"):
        baked = transfer.bake(
            mesh, degree, directions=directions, seed=context.seed, progress=False
        )
        jax.block_until_ready(baked.coefficients)
    return Subject(name, mesh, baked)


def rectangle(
    center: Vector,
    target: Vector,
    size: tuple[float, float],
    radiance: Vector,
    *,
    two_sided: bool = False,
) -> midrange.Polygon:
    """An area light of this width and height that faces the target; its width is level."""
    center, target = np.asarray(center, np.float64), np.asarray(target, np.float64)
    normal = (target - center) / np.linalg.norm(target - center)
    # Beside the vertical any direction is level.
    upright = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 1 - 1e-9 else np.array([0.0, 1.0, 0.0])
    across = np.cross(upright, normal)
    across /= np.linalg.norm(across)
    up = np.cross(normal, across)
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * (np.array(size) / 2)
    vertices = center + corners @ np.stack([across, up])
    dtype = jnp.result_type(float)
    return midrange.Polygon(
        jnp.asarray(vertices, dtype), jnp.asarray(radiance, dtype), two_sided=two_sided
    )


def three_lights(
    distance: float, size: float, *, center: Vector = (0.0, 0.0, 0.0)
) -> tuple[midrange.Polygon, ...]:
    """Squares in red, green and blue around a centre, which they face; none hides another."""
    center = np.asarray(center, np.float64)
    lights = []
    for towards, color in zip(_TOWARDS, (RED, GREEN, BLUE), strict=True):
        away = distance * np.array(towards) / np.linalg.norm(towards)
        lights.append(rectangle(center + away, center, (size, size), color))
    return tuple(lights)


def exact_light(
    lights: Sequence[midrange.Polygon],
    positions: Float[ArrayLike, "*batch 3"],
    degree: int,
    *,
    occluded: bool = False,
    blockers: Sequence[midrange.Polygon] = (),
) -> Float[Array, "*batch 3 k"]:
    """Coefficients at each position without sampling: the reference of all figures.

    `occluded`: whether lights hide each other, which costs twice as much for each.
    """
    total = 0.0
    for number, light in enumerate(lights):
        others = [*lights[:number], *lights[number + 1 :]] if occluded else []
        total = total + midrange.polygon_harmonics(
            light, positions, degree, blockers=(*others, *blockers)
        )
    return jnp.asarray(total)


def exact_expansion(
    lights: Sequence[midrange.Polygon], points: Float[ArrayLike, "*batch 3"], degree: int
) -> midrange.Expansion:
    """Coefficients and gradient without sampling, of lights that do not hide each other."""
    parts = [midrange.polygon_harmonics_with_gradient(light, points, degree) for light in lights]
    light, gradient = (sum(part[1:], part[0]) for part in zip(*parts, strict=True))
    return midrange.make_expansion(jnp.asarray(points), light, gradient)


def cut(expansion: midrange.Expansion, order: int) -> midrange.Expansion:
    """The same expansion to a lower order."""
    return midrange.Expansion(expansion.point, expansion.terms[..., : (1, 4, 10, 20)[order]])


def psnr(values: Float[Array, "v 3"], reference: Float[Array, "v 3"], exposure: float) -> float:
    """Of radiance at vertices, linear, not clipped; the peak is what the exposure takes to 1."""
    error = exposure * (values - reference)[None]
    return float(imaging.psnr(error, jnp.zeros_like(error)))
