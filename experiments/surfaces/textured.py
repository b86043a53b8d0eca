"""A textured GLB under soft probes, shaded by harmonics of degree 10 and rendered by Mitsuba."""

import dataclasses
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import geometry, harmonics, imaging, sphere, transfer

from ..runner import Context, Table, experiment
from ..shared.plots import Panel, draw_panels
from .by_mitsuba import render, scene
from .textured_mesh import write_glb

_GAIN = 8  # of the picture of differences


@dataclasses.dataclass(frozen=True)
class Textured:
    environments: tuple[str, ...] = ()
    """environments by name, "studio" among them; none means all that the data has"""
    vertices: int = 20_000
    """vertices of the knot, about"""
    texture: int = 512
    """side of the texture, in texels"""
    degrees: tuple[int, ...] = (2, 4, 6, 10)
    """degrees of light and transfer"""
    soft: int = 10
    """degree to which a probe is blurred, with a Hann window"""
    directions: int = 2048
    """directions of the bake"""
    size: int = 240
    """height and width of the pictures, in pixels"""
    samples: int = 3
    """rays along each side of a pixel"""
    paths: int = 256
    """Mitsuba's samples a pixel, in each of two renders"""

    def __post_init__(self):
        if not self.degrees or min(self.degrees) < 0 or self.soft < 1:
            raise ValueError("degrees must be one or more numbers >= 0, soft at least 1")
        for name in ("texture", "directions", "size", "samples", "paths"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, got {getattr(self, name)}")


class _Subject(NamedTuple):
    """What all lights share."""

    glb: Path
    camera: imaging.Camera
    raster: imaging.Raster
    baked: transfer.Transfer
    seen: Float[Array, "hn wn 3"]  # base color of the raster's samples
    at_vertices: Float[Array, "v 3"]


@experiment("surfaces.textured")
def run(config: Textured, context: Context) -> Table:
    """PSNR of a textured mesh against Mitsuba's direct lighting."""
    names, top = config.environments or context.data.environments(), max(config.degrees)
    with tempfile.TemporaryDirectory() as folder:
        subject = _subject(config, context, Path(folder) / "knot.glb")
        sheet = []
        for name in context.progress(names, "environments"):
            for light, picture in _lights(config, context, name).items():
                with context.time(f"{name}, {light}: Mitsuba"):
                    halves = _rendered(config, context, subject, picture)
                ours = {}
                for row, image in _compared(config, subject, picture, halves):
                    context.record({"environment": name, "light": light, **row})
                    ours[row["color"], row["degree"]] = image
                sheet.append(
                    _panels(f"{name}, {light}", ours["texture", top], halves, subject.raster)
                )
    caption = f"ours at degree {top}, Mitsuba, and {_GAIN} times the difference of both"
    draw_panels(context.path("textured.png", caption), sheet)
    return Table("Beside Mitsuba", values={"vertices": subject.baked.num_points})


def _subject(config: Textured, context: Context, path: Path) -> _Subject:
    glb = write_glb(path, config.vertices, config.texture)
    mesh = geometry.read_mesh(glb)
    with context.time("bake"):
        baked = transfer.bake(
            mesh,
            max(config.degrees),
            directions=config.directions,
            seed=context.seed,
            progress=False,
        )
        jax.block_until_ready(baked.coefficients)
    camera = imaging.Camera.facing(mesh, width=config.size, height=config.size)
    raster = imaging.rasterize(mesh, camera, samples=config.samples)
    at_vertices = imaging.base_color(mesh)
    return _Subject(glb, camera, raster, baked, imaging.base_color(mesh, raster), at_vertices)


def _lights(config: Textured, context: Context, name: str) -> dict[str, Float[np.ndarray, "h w 3"]]:
    """The probe, blurred and as it is, as pictures that both renderers get."""
    made = name == "studio" and name not in context.data.environments()
    whole = imaging.studio() if made else context.data.environment(name)
    # Of the size of the blurred one: Mitsuba looks rows up a little differently at the poles.
    height, width = 128, 256
    light = sphere.project_lat_long(whole, config.soft)
    light = light * harmonics.window("hann", config.soft).astype(light.dtype)[None]
    blurred = sphere.reconstruct_lat_long(light, height, width)
    return {"soft": np.maximum(np.asarray(blurred), 0), "whole": np.asarray(whole)}


def _rendered(
    config: Textured, context: Context, subject: _Subject, picture: Float[np.ndarray, "h w 3"]
) -> tuple[np.ndarray, np.ndarray]:
    mi, made = scene(subject.glb, picture, subject.camera)
    seeds = 2 * context.seed, 2 * context.seed + 1
    one, other = (render(mi, made, samples=config.paths, seed=seed) for seed in seeds)
    return one, other


def _compared(
    config: Textured,
    subject: _Subject,
    picture: Float[np.ndarray, "h w 3"],
    halves: tuple[np.ndarray, np.ndarray],
) -> Iterator[tuple[dict[str, Any], Float[Array, "h w 3"]]]:
    """Rows by degree, with the texture at each sample of the raster or at each vertex alone."""
    one, other = (jnp.asarray(half) for half in halves)
    theirs, mask = (one + other) / 2, subject.raster.mask
    exposure = imaging.auto_exposure(theirs, mask)

    def shown(image: Array) -> Array:
        return imaging.tone_map(image, exposure)

    noise = float(jnp.mean((shown(one) - shown(other))[mask] ** 2)) / 4
    for degree in config.degrees:
        light = sphere.project_lat_long(jnp.asarray(picture), degree)
        baked = subject.baked.truncated(degree)
        for color in ("texture", "vertices"):
            if color == "texture":
                radiance = transfer.shade_diffuse(light, baked, 1.0)
                image = imaging.interpolate(subject.raster, radiance, color=subject.seen)
            else:
                radiance = transfer.shade_diffuse(light, baked, subject.at_vertices)
                image = imaging.interpolate(subject.raster, radiance)
            error = float(jnp.mean((shown(image) - shown(theirs))[mask] ** 2))
            yield (
                {
                    "degree": degree,
                    "color": color,
                    "psnr": float(imaging.psnr(shown(image), shown(theirs), mask)),
                    "psnr_all": float(imaging.psnr(shown(image), shown(theirs))),
                    "psnr_linear": float(imaging.psnr(exposure * image, exposure * theirs, mask)),
                    # Of the reference's mean, told by its halves; and without it.
                    "noise": -10 * np.log10(noise),
                    "psnr_without_noise": -10 * np.log10(max(error - noise, 1e-12)),
                },
                shown(image),
            )


def _panels(
    title: str,
    ours: Float[Array, "h w 3"],
    halves: tuple[np.ndarray, np.ndarray],
    raster: imaging.Raster,
) -> list[Panel]:
    mean = jnp.asarray((halves[0] + halves[1]) / 2)
    theirs = np.asarray(imaging.tone_map(mean, imaging.auto_exposure(mean, raster.mask)))
    difference = np.clip(_GAIN * np.abs(np.asarray(ours) - theirs), 0, 1)
    return [
        Panel(np.asarray(ours), f"{title}: ours"),
        Panel(theirs, "Mitsuba"),
        Panel(difference, f"difference × {_GAIN}"),
    ]
