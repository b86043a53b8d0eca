"""Self-shadowed meshes under light probes: what bakes, shadows, a bounce and degrees are worth.

Transfer is baked once per mesh at the highest degree; a lower degree is its leading coefficients.
The irradiance that shading makes of it is held against integrals over all pixels of the probe,
and against paths where light bounces.
"""

import dataclasses
import functools
import warnings
from collections.abc import Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import geometry, harmonics, imaging, sphere, transfer

from ..runner import Context, Table, experiment
from .bake import OFFSET, Subject, bake, bounces_alone, relative_error
from .first_light_tables import tables
from .pictures import Picture, draw_errors, draw_sheet, draw_variants
from .reference import Estimate, irradiance
from .still import draw_still

_STILL = (
    "copper on paper: sun and lamp split off the probe and shaded by rays, the rest by transfer of "
    "degree 10, with a bounce and a glossy lobe"
)
_SHEET = "shadowed, with a bounce, at the highest degree, before each probe, its suns split off"
_VARIANTS = (
    "the three variants, what shadows take and what the bounce adds, suns split off. Last, all of "
    "the light by harmonics, cut off at the highest degree: dark bands along a shadow's edge are "
    "their ringing below zero"
)
_WIDTH = 0.8  # of a picture, in its heights


@dataclasses.dataclass(frozen=True)
class FirstLight:
    meshes: tuple[str, ...] = ()
    """meshes by name; none means the first that the data has"""
    environments: tuple[str, ...] = ()
    """environments by name; none means all that the data has"""
    degrees: tuple[int, ...] = (2, 4, 6, 10)
    """degrees of light and transfer"""
    directions: int = 2048
    """directions of the bake"""
    suns: int = 8
    """how many bright sources are split off a probe at most"""
    rays: int = 64
    """from a vertex to each of them"""
    albedo: float = 0.5
    """of the surface, where it is shaded and where light bounces"""
    vertices: int = 2000
    """vertices of each mesh that have a reference"""
    paths: int = 2048
    """paths per vertex in each half of the reference of the bounce"""
    transfer_directions: int = 65536
    """directions of the reference of the transfer, in two halves"""
    size: int = 512
    """height of the pictures, in pixels"""
    samples: int = 3
    """rays along each side of a pixel"""
    still: int = 480
    """height of the picture of a glossy knot, in pixels; 0 draws none"""

    def __post_init__(self):
        if not self.degrees or min(self.degrees) < 0:
            raise ValueError("degrees must be one or more numbers >= 0")
        for name in ("suns", "rays", "directions", "vertices", "paths", "samples"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, got {getattr(self, name)}")
        if self.transfer_directions < 2:
            raise ValueError(
                f"transfer_directions must be at least 2, got {self.transfer_directions}"
            )
        if not 0 < self.albedo <= 1:
            raise ValueError(f"albedo must be above 0 and at most 1, got {self.albedo}")
        if self.size < 16:
            raise ValueError(f"size must be at least 16 pixels, got {self.size}")
        if self.still and self.still < 16:
            raise ValueError(f"still must be 0 or at least 16 pixels, got {self.still}")


@experiment("first_light")
def run(config: FirstLight, context: Context) -> list[Table]:
    degree = max(config.degrees)
    environments = {
        name: context.data.environment(name)
        for name in config.environments or context.data.environments()
    }
    lights = {
        name: _project(config, context, name, degree, environments[name]) for name in environments
    }
    pictures: list[list[Picture]] = []
    for name in context.progress(config.meshes or context.data.meshes()[:1], "meshes"):
        subject = bake(
            context,
            name,
            degree,
            directions=config.directions,
            albedo=config.albedo,
            chosen=config.vertices,
            transfer_directions=config.transfer_directions,
        )
        with context.time(f"{name}: suns"):
            sunlit = {key: _sunlit(config, subject, lights[key]) for key in lights}
        pictures.append(_draw(config, context, subject, environments, lights, sunlit))
        with context.time(f"{name}: reference"):
            references = irradiance(
                subject.mesh,
                subject.chosen,
                {name: np.asarray(environment) for name, environment in environments.items()},
                albedo=config.albedo,
                paths=config.paths,
                ray_bias=OFFSET,
                context=context,
            )
        for picture in pictures[-1]:
            key = picture.environment
            for row in _errors(config, subject, lights[key], sunlit[key], references[key], picture):
                context.record(row)
    if config.still:
        with context.time("still"):
            draw_still(context.path("still.png", _STILL), height=config.still)
    draw_sheet(context.path("first_light.png", _SHEET), pictures)
    caption = f"under {pictures[0][0].environment}: {_VARIANTS}"
    draw_variants(context.path("variants.png", caption), [row[0] for row in pictures])
    rows = [row for row in context.rows if "variant" in row]
    draw_errors(context.path("errors.png", "error of the irradiance by degree"), rows)
    return list(tables(context, config.degrees, round(_WIDTH * config.size)))


class Light(NamedTuple):
    """A probe's light: whole, and without the suns that were split off."""

    whole: Float[Array, "3 k"]
    rest: Float[Array, "3 k"]
    suns: sphere.Suns


def _project(
    config: FirstLight, context: Context, name: str, degree: int, environment: Float[Array, "h w 3"]
) -> Light:
    project = jax.jit(functools.partial(sphere.project_lat_long, degree=degree))
    whole = context.measure(f"project {name}", project, environment).value
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a probe without any has none in the table
        suns, rest = sphere.split_sun(environment, config.suns, rays=config.rays)
    return Light(whole, project(rest), suns)


def _sunlit(config: FirstLight, subject: Subject, light: Light) -> dict[str, Float[Array, "v 3"]]:
    """What the suns send to all vertices directly, by variant."""
    scene = geometry.ray_scene(subject.mesh)
    seen = transfer.sun_visibility(
        light.suns, subject.mesh, scene, rays=config.rays, ray_bias=OFFSET
    )
    shade = functools.partial(transfer.shade_sun, light.suns, subject.mesh, albedo=config.albedo)
    shadowed = shade(seen)
    return {
        "unshadowed": shade(shadows=False),
        "shadowed": shadowed,
        "one bounce": shadowed,
    }


def _draw(
    config: FirstLight,
    context: Context,
    subject: Subject,
    environments: dict[str, Array],
    lights: dict[str, Light],
    sunlit: dict[str, dict[str, Array]],
) -> list[Picture]:
    """Draw each variant at the highest degree under each environment, its suns split off."""
    width = round(_WIDTH * config.size)
    camera = imaging.Camera.facing(subject.mesh, width=width, height=config.size)
    with context.time(f"{subject.name}: raster"):
        raster = imaging.rasterize(subject.mesh, camera, samples=config.samples)
    pictures = []
    for name, environment in environments.items():
        light, degree = lights[name], max(config.degrees)
        shaded = _radiance_split(config, subject, light, sunlit[name], degree)
        shaded["ringing"] = _radiance(config, subject, light.whole)["shadowed"]
        renders = {variant: imaging.interpolate(raster, each) for variant, each in shaded.items()}
        exposure = float(imaging.auto_exposure(renders["ringing"], raster.mask))
        background = np.asarray(imaging.backdrop(environment, camera))
        alpha = np.asarray(raster.alpha)[..., None]
        arrays = {variant: np.asarray(render) for variant, render in renders.items()}
        pictures.append(Picture(subject.name, name, arrays, background, alpha, exposure))
    return pictures


def _radiance(
    config: FirstLight, subject: Subject, light: Float[Array, "3 k"]
) -> dict[str, Float[Array, "v 3"]]:
    return {
        variant: transfer.shade_diffuse(light, baked, config.albedo)
        for variant, baked in subject.transfers.items()
    }


def _radiance_split(
    config: FirstLight,
    subject: Subject,
    light: Light,
    sunlit: dict[str, Float[Array, "v 3"]],
    degree: int,
) -> dict[str, Float[Array, "v 3"]]:
    """The rest and what bounces of the suns by harmonics, the suns' direct light by rays."""
    rest = light.rest[:, : harmonics.num_coefficients(degree)]
    shaded = _radiance(config, subject, rest)
    shaded = {variant: radiance + sunlit[variant] for variant, radiance in shaded.items()}
    bounces = bounces_alone(subject.transfers["one bounce"], subject.transfers["shadowed"])
    indirect = transfer.shade_diffuse(light.suns.harmonics(degree), bounces, config.albedo)
    shaded["one bounce"] += indirect
    return shaded


def _errors(
    config: FirstLight,
    subject: Subject,
    light: Light,
    sunlit: dict[str, Float[Array, "v 3"]],
    reference: dict[str, Estimate],
    picture: Picture,
) -> Iterator[dict[str, Any]]:
    """One row by degree and variant: its errors, and PSNR, without and with the suns split off."""
    reflectance = config.albedo / np.pi
    for degree in config.degrees:
        cut = light.whole[:, : harmonics.num_coefficients(degree)]
        shaded = _radiance(config, subject, cut)
        split = _radiance_split(config, subject, light, sunlit, degree)
        for variant in shaded:
            row = {
                "mesh": subject.name,
                "environment": picture.environment,
                "degree": degree,
                "variant": variant,
                "suns": len(light.suns.solid_angle),
                "reference_error": 100 * reference[variant].error,
            }
            for ending, radiance in (("", shaded[variant]), ("_split", split[variant])):
                got = np.asarray(radiance)[subject.chosen] / reflectance
                exposed, exact = (
                    jnp.clip(picture.exposure * reflectance * jnp.asarray(x)[None], 0, 1)
                    for x in (got, reference[variant].value.astype(got.dtype))
                )
                row[f"error{ending}"] = relative_error(got, reference[variant].value)
                row[f"psnr{ending}"] = float(imaging.psnr(exposed, exact))
                if not ending:
                    for other in ("shadowed", "one bounce"):
                        error = relative_error(got, reference[other].value)
                        row[f"error_to_{other.replace(' ', '_')}"] = error
            yield row
