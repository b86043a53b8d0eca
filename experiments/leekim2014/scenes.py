"""What the experiments on Lee & Kim 2014 share: the scenes of its table 1, and its errors.

A scene is a mesh under a light probe at a degree. Its light is scaled so that colors come exposed:
thresholds and errors are of linear color with white at 1.
"""

import dataclasses
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxsh import geometry, harmonics, imaging, sphere, transfer

from ..runner import Context
from ..shared.subjects import load

SIZE = 512  # of the picture, in pixels
ALBEDO = 0.5  # diffuse and specular
EXPONENT = 32.0  # the paper does not print its own
_WHITE = 99  # percentile of the largest channel, over vertices that face the eye


class Row(NamedTuple):
    """Which probe, which model, how many levels."""

    environment: str
    mesh: str
    degree: int


class Paper(NamedTuple):
    """What the paper's table 1 has on a row. Filtering ratios are shares filtered out."""

    probe: str
    model: str
    vertices: int
    adaptive: float  # frames per second
    full: float
    diffuse: float
    specular: float
    gain: float


PAPER = {
    Row("stpeters", "armadillo", 10): Paper(
        "Peter's basilica", "Armadillo", 52_000, 13.7, 5.4, 0.13, 0.80, 2.53
    ),
    Row("eucalyptus", "armadillo", 10): Paper(
        "Eucalyptus Grove", "Armadillo", 52_000, 12.1, 5.5, 0.18, 0.73, 2.20
    ),
    Row("galileo", "armadillo", 10): Paper(
        "Galileo tomb", "Armadillo", 52_000, 13.2, 5.4, 0.09, 0.78, 2.44
    ),
    Row("galileo", "maxplanck_45k", 10): Paper(
        "Galileo tomb", "Max Planck", 58_000, 13.9, 5.1, 0.19, 0.83, 2.72
    ),
    Row("grace", "maxplanck_45k", 10): Paper(
        "Grace Cathedral", "Max Planck", 58_000, 12.3, 5.1, 0.09, 0.79, 2.41
    ),
    Row("grace", "happy_buddha", 9): Paper(
        "Grace Cathedral", "Happy Buddha", 59_000, 12.7, 5.7, 0.10, 0.78, 2.23
    ),
    Row("uffizi", "happy_buddha", 10): Paper(
        "Uffizi Gallery", "Happy Buddha", 59_000, 14.2, 4.2, 0.14, 0.91, 3.38
    ),
    Row("stpeters", "happy_buddha", 9): Paper(
        "Peter's basilica", "Happy Buddha", 59_000, 14.3, 5.7, 0.16, 0.85, 2.50
    ),
}


class Quality(NamedTuple):
    """PSNR in dB of linear color, clipped to [0, 1]."""

    image: float  # over all pixels; the background is black
    object: float  # over those on the object
    vertex: float  # over the vertices that face the eye, seen or not

    def named(self) -> dict[str, float]:
        """As columns of a table."""
        return {f"psnr_{name}": value for name, value in self._asdict().items()}


class Scene(NamedTuple):
    """A baked mesh, the light, and who looks at it."""

    row: Row
    mesh: geometry.Mesh
    baked: transfer.Transfer
    light: Float[Array, "3 k"]  # exposed
    material: transfer.Material
    camera: imaging.Camera
    raster: imaging.Raster
    facing: Bool[Array, " v"]  # the normal points to the eye's side

    @property
    def eye(self) -> Float[Array, " 3"]:
        return self.camera.position

    def full(self, light: Float[Array, "3 k"] | None = None) -> Float[Array, "v 3"]:
        """The full computation, under the scene's light or another."""
        light = self.light if light is None else light
        return transfer.shade_glossy(light, self.baked, self.eye, self.material)

    def turned(self, angle: float) -> Float[Array, "3 k"]:
        """The light, turned about the vertical by so many radians."""
        return harmonics.rotate_z(self.light, angle)

    def cut(self, degree: int) -> "Scene":
        """The same at a lower degree: leading coefficients, exposure unchanged."""
        light = self.light[:, : harmonics.num_coefficients(degree)]
        return self._replace(
            row=self.row._replace(degree=degree), baked=self.baked.truncated(degree), light=light
        )

    def picture(self, color: Float[Array, "v 3"]) -> Float[Array, "h w 3"]:
        """Linear, clipped, in front of black."""
        return jnp.clip(imaging.interpolate(self.raster, color), 0, 1)

    def quality(self, color: Float[Array, "v 3"], reference: Float[Array, "v 3"]) -> Quality:
        """How far colors are from others."""
        ours, theirs = self.picture(color), self.picture(reference)
        measured = (
            imaging.psnr(ours, theirs),
            imaging.psnr(ours, theirs, self.raster.mask),
            vertex_psnr(color, reference, self.facing),
        )
        return Quality(*map(float, measured))


class Scenes:
    """Rows made into scenes. Each mesh is baked once, at the highest degree that a row has."""

    def __init__(self, context: Context, rows: Iterable[Row], directions: int = 2048):
        self._context, self._directions = context, directions
        self._degrees: dict[str, int] = {}
        for row in rows:
            self._degrees[row.mesh] = max(row.degree, self._degrees.get(row.mesh, 0))
        self._meshes: dict[str, tuple[geometry.Mesh, imaging.Camera, imaging.Raster]] = {}
        self._baked: dict[str, transfer.Transfer] = {}

    def load(self, row: Row, *, exponent: float = EXPONENT) -> Scene:
        if row.mesh not in self._baked:
            self._bake(row.mesh)
        mesh, camera, raster = self._meshes[row.mesh]
        baked = self._baked[row.mesh].truncated(row.degree)
        light = sphere.project_lat_long(self._context.data.environment(row.environment), row.degree)
        scene = Scene(
            row,
            mesh,
            baked,
            light,
            transfer.Material(ALBEDO, ALBEDO, exponent),
            camera,
            raster,
            towards(camera.position, baked),
        )
        return scene._replace(light=_exposure(scene) * light)

    def _bake(self, name: str) -> None:
        degree = self._degrees[name]
        subject = load(self._context, name, degree, directions=self._directions)
        camera = imaging.Camera.facing(subject.mesh, width=SIZE, height=SIZE)
        self._baked[name] = subject.baked
        self._meshes[name] = subject.mesh, camera, imaging.rasterize(subject.mesh, camera)


@dataclasses.dataclass(frozen=True)
class One:
    """The fields of the configs that look at one scene."""

    environment: str | None = None
    """none means the first of the data"""
    mesh: str | None = None
    """none means the first of the data"""
    frames: int = 3
    """frames of each way, in turns"""
    directions: int = 2048
    """directions of the bake"""

    def __post_init__(self):
        if min(self.frames, self.directions) < 1:
            raise ValueError("frames and directions must be at least 1")

    def open(self, context: Context, degree: int) -> tuple[Row, Scenes]:
        """The row of the table at this degree, and the scenes to load it from."""
        [first] = rows_or_default(context, (), degree)
        row = Row(self.environment or first.environment, self.mesh or first.mesh, degree)
        return row, Scenes(context, [row], self.directions)


def rows_or_default(context: Context, rows: Sequence[tuple[str, str, int]], degree: int = 4):
    """The rows of a config; where it has none, the first probe and mesh of the data."""
    first = (context.data.environments()[0], context.data.meshes()[0], degree)
    return [Row(*row) for row in rows or [first]]


def vertex_psnr(
    color: Float[Array, "v 3"], reference: Float[Array, "v 3"], facing: Bool[Array, " v"]
) -> Float[Array, ""]:
    """Over the vertices of `facing`, clipped."""
    ours, theirs = (jnp.clip(one, 0, 1)[None] for one in (color, reference))
    return imaging.psnr(ours, theirs, facing[None])


def towards(eye: Float[Array, " 3"], baked: transfer.Transfer) -> Bool[Array, " v"]:
    """Whether a vertex's normal points to the eye's side."""
    return jnp.sum((eye[None] - baked.positions) * baked.normals, axis=1) > 0


def _exposure(scene: Scene) -> float:
    largest = np.max(np.asarray(scene.full())[np.asarray(scene.facing)], axis=1)
    return 1 / float(np.percentile(largest, _WHITE))
