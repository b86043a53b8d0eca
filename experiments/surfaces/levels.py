"""Which level of a texture to look up: footprints of several sizes beside many samples a pixel."""

import dataclasses
import math
import tempfile
from pathlib import Path

from jaxtyping import Array, Float

from jaxsh import geometry, imaging

from ..runner import Context, Table, experiment
from .textured_mesh import write_glb

_FACTORS: dict[str, float] = {
    "none": 0.0,
    "half": 0.5,
    "ours": 1.0,
    "OpenGL": math.sqrt(3),
    "double": 2.0,
}


@dataclasses.dataclass(frozen=True)
class Levels:
    vertices: int = 20_000
    """vertices of the knot, about"""
    texture: int = 512
    """side of the texture, in texels"""
    sizes: tuple[int, ...] = (50, 100, 200)
    """height and width of the pictures, in pixels"""
    samples: tuple[int, ...] = (1, 2, 3)
    """rays along each side of a pixel"""
    reference: int = 16
    """the same of the reference, which looks up the texture itself"""

    def __post_init__(self):
        if min((*self.sizes, *self.samples, self.reference), default=0) < 1:
            raise ValueError("sizes, samples and reference must be at least 1")


@experiment("surfaces.levels")
def run(config: Levels, context: Context) -> Table:
    """PSNR of a texture's picture, by the factor that its footprint has."""
    with tempfile.TemporaryDirectory() as folder:
        path = write_glb(Path(folder) / "knot.glb", config.vertices, config.texture)
        mesh = geometry.read_mesh(path)
    scene = geometry.ray_scene(mesh)
    for size in context.progress(config.sizes, "sizes"):
        camera = imaging.Camera.facing(mesh, width=size, height=size)
        fine = imaging.rasterize(mesh, camera, samples=config.reference, scene=scene)
        reference = _drawn(mesh, fine, 0.0)
        for samples in config.samples:
            raster = imaging.rasterize(mesh, camera, samples=samples, scene=scene)
            found = {
                name: float(imaging.psnr(_drawn(mesh, raster, factor), reference, fine.mask))
                for name, factor in _FACTORS.items()
            }
            context.record({"size": size, "samples": samples, **found})
    return Table("Levels by footprint")


def _drawn(mesh: geometry.Mesh, raster: imaging.Raster, factor: float) -> Float[Array, "h w 3"]:
    """The base color as a screen shows it."""
    assert raster.footprint is not None
    scaled = dataclasses.replace(raster, footprint=factor * raster.footprint)
    color = imaging.base_color(mesh, scaled)
    return imaging.srgb_encode(imaging.interpolate(raster, color))
