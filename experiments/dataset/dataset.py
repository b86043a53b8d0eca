"""A mesh from many sides under many lights: pictures, normals, depth, masks, cameras, lights."""

import dataclasses
import functools
import hashlib
import math
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import geometry, imaging, transfer

from ..runner import Context, Table, UserError, experiment
from ..shared.process import cores, peak_gigabytes
from . import lights, sources, views, writing
from .lights import Light

_BUFFERS = ("normal.exr", "depth.exr", "mask.png", "albedo.png")
_SMALL = 160  # pixels, of the pictures in the report
# Radiance of all lights that is held at a time, in bytes.
_HELD = 2**28
_SHEET = "some views (rows) under some lights (columns)"


@dataclasses.dataclass(frozen=True)
class Dataset:
    mesh: str = sources.VASE
    """a file, a mesh of the data by name, or "vase", which has a texture and is made at run time"""
    up: Literal["z", "y"] | None = None
    """the axis that points up in the mesh's file; none means as its format says"""
    environments: tuple[str, ...] = ()
    """files, or environments of the data by name; none means all that the data has"""
    turns: int = 8
    """rotations of each environment about the vertical, evenly over the circle"""
    suns: int = 8
    """times of the day with sun and sky; 0 for none"""
    day: str = "2026-06-21"
    """whose suns they are"""
    latitude: float = 48.1
    """in degrees, north positive"""
    longitude: float = 11.6
    """in degrees, east positive"""
    turbidity: float = 3.0
    """of the sky"""
    ground: float = 0.2
    """albedo of the ground below the sky"""
    views: int = 12
    """cameras around the vertical, evenly over the circle"""
    elevations: tuple[float, ...] = (15.0,)
    """of the cameras in degrees: a ring of views at each"""
    fov_y: float = 30.0
    """vertical angle of view in degrees"""
    size: int = 512
    """width and height in pixels"""
    samples: int = 2
    """rays along each side of a pixel"""
    degree: int = 6
    """of lights and transfer; at most 6 with suns, whose sky is of no more"""
    directions: int = 256
    """of the bake"""
    bounces: int = 1
    """of the bake"""
    format: Literal["png", "exr"] = "png"
    """png: exposed, clipped, sRGB in 8 bits; exr: linear radiance in 16"""
    folder: str | None = None
    """where it goes; none means a folder beside the results. A run goes on with what it finds"""

    def __post_init__(self):
        for name in ("turns", "views", "size", "samples", "directions"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, got {getattr(self, name)}")
        if min(self.suns, self.bounces, self.degree) < 0:
            raise ValueError("suns, bounces and degree must not be negative")
        if not 2.5 <= self.turbidity <= 6:
            raise ValueError(f"turbidity must be between 2.5 and 6, got {self.turbidity}")
        if not 0 <= self.ground <= 1:
            raise ValueError(f"ground must be between 0 and 1, got {self.ground}")
        if not 0 < self.fov_y < 180:
            raise ValueError(f"fov_y must be between 0 and 180 degrees, got {self.fov_y}")
        if self.suns and self.degree > 6:
            raise ValueError(
                f"degree must be at most 6 with suns, as their sky is, got {self.degree}"
            )
        if not self.elevations or not all(abs(e) <= 89 for e in self.elevations):
            raise ValueError(f"elevations must be between -89 and 89, got {self.elevations}")


class _Scene(NamedTuple):
    """What all pictures share."""

    mesh: geometry.Mesh
    rays: geometry.RayScene
    cameras: list[imaging.Camera]
    lights: list[Light]
    radiance: Callable[[int], Float[Array, "v 3"]]  # of a white surface under a light, by number
    kept: int  # for how many lights it is kept


@experiment("dataset")
def dataset(config: Dataset, context: Context) -> Table:
    try:
        return _dataset(config, context)
    except OSError as error:  # no room, no permission, a file where a folder should be
        raise UserError(f"{error}; what is whole stays, and the same command goes on") from error


def _dataset(config: Dataset, context: Context) -> Table:
    folder = Path(config.folder) if config.folder else context.folder.with_suffix(".files")
    mesh = sources.mesh(context, config.mesh, config.up)
    environments = config.environments or tuple(context.data.environments())
    with context.time("lights"):
        chosen = lights.of_probes(context, environments, config.turns, config.degree)
        if config.suns:
            day = {
                name: getattr(config, name)
                for name in ("day", "latitude", "longitude", "turbidity", "ground")
            }
            chosen += lights.of_day(config.suns, config.degree, **day)
    with writing.claimed(folder, _about(config, mesh, environments, chosen, context.seed)):
        return _make(config, context, folder, mesh, chosen)


def _make(
    config: Dataset,
    context: Context,
    folder: Path,
    mesh: geometry.Mesh,
    chosen: list[lights.Light],
) -> Table:
    with context.time("bake"):
        baked, bounced = _bake(config, mesh, folder, context.seed)
    cameras = views.around(
        mesh,
        config.views,
        config.elevations,
        fov_y=config.fov_y,
        width=config.size,
        height=config.size,
        margin=0.05,
    )
    scene = _scene(mesh, baked, bounced, cameras, chosen)
    exposures = _exposures(scene, context)
    _tell(folder, scene, exposures)
    start, cpu = time.perf_counter(), time.process_time()
    made, size = _draw(config, scene, exposures, folder, context)
    seconds, cpu = time.perf_counter() - start, time.process_time() - cpu
    context.record(
        {
            "mesh": Path(config.mesh).name,
            "vertices": len(mesh.vertices),
            "views": len(cameras),
            "lights": len(chosen),
            "pictures": len(cameras) * len(chosen),
            "made": made,
            "seconds": seconds,
            "rate": made / seconds,
            "cpu": cpu / made if made else math.nan,
            "megabytes": size / 1e6,
            "peak_gigabytes": peak_gigabytes(),
            "bake_seconds": context.times["bake"]["seconds"],
        }
    )
    _sheet(config, scene, exposures, context.path("dataset.png", _SHEET))
    return Table("The dataset", values={"folder": str(folder)})


def _about(
    config: Dataset,
    mesh: geometry.Mesh,
    environments: tuple[str, ...],
    chosen: list[Light],
    seed: int,
) -> dict[str, Any]:
    """What decides every bit of the dataset, but for versions and machine."""
    settings = dataclasses.asdict(config) | {"environments": list(environments), "seed": seed}
    del settings["folder"]
    settings["mesh"] = Path(config.mesh).name  # wherever it lies
    return {
        "what": "pictures of a mesh from many sides under many lights",
        "pictures": f"images/VIEW/LIGHT.{config.format}",
        "views": [f"views/VIEW/{name}" for name in _BUFFERS],
        "settings": settings,
        "digests": {
            "mesh": _digest(mesh),
            "lights": _digest([(light.coefficients, light.sun) for light in chosen]),
        },
    }


def _digest(tree: Any) -> str:
    digest = hashlib.sha256()
    for leaf in jax.tree.leaves(tree):
        digest.update(np.ascontiguousarray(leaf).data)
    return digest.hexdigest()[:16]


def _bake(
    config: Dataset, mesh: geometry.Mesh, folder: Path, seed: int
) -> tuple[transfer.Transfer, transfer.Transfer | None]:
    """The transfer, and its part that bounces where suns need that by itself."""
    bake = functools.partial(
        transfer.bake, mesh, config.degree, directions=config.directions, seed=seed
    )
    try:
        if not config.bounces:
            return jax.block_until_ready(bake(store=folder / "transfer")), None
        albedo = np.asarray(imaging.base_color(mesh).mean(axis=1))
        baked = bake(bounces=config.bounces, albedo=albedo, store=folder / "transfer")
        if not config.suns:
            return jax.block_until_ready(baked), None
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # vertices that see nothing, told already
            direct = bake(store=folder / "transfer_direct")
    except ValueError as error:
        raise UserError(" ".join(str(error).split())) from error
    bounced = dataclasses.replace(baked, coefficients=baked.coefficients - direct.coefficients)
    return jax.block_until_ready((baked, bounced))


def _scene(
    mesh: geometry.Mesh,
    baked: transfer.Transfer,
    bounced: transfer.Transfer | None,
    cameras: list[imaging.Camera],
    chosen: list[Light],
) -> _Scene:
    kept, rays = max(1, _HELD // mesh.vertices.nbytes), geometry.ray_scene(mesh)

    @functools.lru_cache(maxsize=kept)
    def radiance(number: int) -> Float[Array, "v 3"]:
        return chosen[number].radiance(mesh, baked, bounced, rays)

    return _Scene(mesh, rays, cameras, chosen, radiance, kept)


def _exposures(scene: _Scene, context: Context) -> list[float]:
    """What takes the 99th percentile of the vertices to white: one number for a light."""
    colors = imaging.base_color(scene.mesh)
    found = []
    for number in context.progress(range(len(scene.lights)), "lights"):
        shaded = scene.radiance(number) * colors
        found.append(float(imaging.auto_exposure(shaded[None])))
    return found


def _tell(folder: Path, scene: _Scene, exposures: list[float]) -> None:
    """Write cameras and lights."""
    cameras = [{"view": f"{n:04}"} | views.told(c) for n, c in enumerate(scene.cameras)]
    writing.words(folder / "cameras.json", cameras)
    told = [
        {"light": f"{number:04}", "exposure": exposure} | light.told()
        for number, (light, exposure) in enumerate(zip(scene.lights, exposures, strict=True))
    ]
    writing.words(folder / "lights.json", told)


def _draw(
    config: Dataset, scene: _Scene, exposures: list[float], folder: Path, context: Context
) -> tuple[int, int]:
    """Write what is missing; how many pictures that were, and the bytes of all new files."""
    blocks = [
        range(start, min(start + scene.kept, len(scene.lights)))
        for start in range(0, len(scene.lights), scene.kept)
    ]
    rounds = [(block, view) for block in blocks for view in range(len(scene.cameras))]
    made = 0
    with writing.writer(cores()) as writer:
        for block, view in context.progress(rounds, "views"):
            images = folder / "images" / f"{view:04}"
            paths = {number: images / f"{number:04}.{config.format}" for number in block}
            missing = {number: path for number, path in paths.items() if not path.exists()}
            about = folder / "views" / f"{view:04}"
            buffers = [name for name in _BUFFERS if not (about / name).exists()]
            if not missing and not buffers:
                continue
            raster = imaging.rasterize(
                scene.mesh, scene.cameras[view], samples=config.samples, scene=scene.rays
            )
            color = imaging.base_color(scene.mesh, raster)
            if buffers:
                _buffers(scene, view, raster, color, about, buffers, writer)
            for number, path in missing.items():
                radiance, exposure = scene.radiance(number), exposures[number]
                writer.write(path, _picture(raster, radiance, color, exposure, config.format))
            made += len(missing)
    return made, writer.size


def _buffers(
    scene: _Scene,
    view: int,
    raster: imaging.Raster,
    color: Float[Array, "hn wn 3"],
    folder: Path,
    wanted: list[str],
    writer: writing.Writer,
) -> None:
    """Write what a view shows whatever the light, those that are wanted.

    Normals and depth are those at pixels' centers, not mixed along edges; zero beside the mesh.
    """
    camera = scene.cameras[view]
    if {"normal.exr", "depth.exr"} & set(wanted):
        centers = imaging.rasterize(scene.mesh, camera, scene=scene.rays)
        if "normal.exr" in wanted:
            normal = imaging.interpolate(centers, scene.mesh.normals)
            length = jnp.linalg.norm(normal, axis=2, keepdims=True)
            normal = jnp.where(length > 0, normal / jnp.where(length > 0, length, 1), 0)
            writer.write(folder / "normal.exr", normal.astype(jnp.float16))
        if "depth.exr" in wanted:
            depth = imaging.interpolate(centers, views.depths(scene.mesh, camera))
            writer.write(folder / "depth.exr", depth[..., 0])
    if "mask.png" in wanted:
        writer.write(folder / "mask.png", raster.alpha)
    if "albedo.png" in wanted:
        albedo = imaging.interpolate(raster, jnp.ones_like(scene.mesh.vertices), color=color)
        writer.write(folder / "albedo.png", imaging.srgb_encode(jnp.clip(albedo, 0, 1)))


@functools.partial(jax.jit, static_argnames="form")
def _picture(
    raster: imaging.Raster,
    radiance: Float[Array, "v 3"],
    color: Float[Array, "hn wn 3"],
    exposure: float,
    form: str,
) -> Float[Array, "h w 3"]:
    image = imaging.interpolate(raster, radiance, color=color)
    if form == "exr":
        return jnp.minimum(image, jnp.finfo(jnp.float16).max).astype(jnp.float16)
    return imaging.tone_map(image, exposure)


def _sheet(config: Dataset, scene: _Scene, exposures: list[float], path: Path) -> None:
    """Draw some views under some lights, small."""
    rows = []
    for view in _some(len(scene.cameras), 3):
        camera = dataclasses.replace(scene.cameras[view], width=_SMALL, height=_SMALL)
        raster = imaging.rasterize(scene.mesh, camera, samples=3, scene=scene.rays)
        color = imaging.base_color(scene.mesh, raster)
        row = [
            _picture(raster, scene.radiance(number), color, exposures[number], "png")
            for number in _some(len(scene.lights), 5)
        ]
        rows.append(np.concatenate(row, axis=1))
    imaging.write_image(path, np.concatenate(rows))


def _some(count: int, most: int) -> list[int]:
    """Up to `most` of the numbers below `count`, evenly."""
    return sorted({round(i) for i in np.linspace(0, count - 1, min(count, most))})
