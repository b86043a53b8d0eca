"""A mesh on the ground through a day: the sky in harmonics, the sun with ray-traced shadows."""

import dataclasses
import functools
import warnings
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import geometry, imaging, sky, transfer

from ..runner import Context, Table, experiment
from ..shared.plots import Panel, animate, draw_panels
from ..shared.timing import timed
from .spheres import LUMINANCE

_MESH_ALBEDO, _GROUND_ALBEDO = (0.62, 0.58, 0.52), (0.30, 0.29, 0.26)
_KEY = 0.34  # Reinhard et al. 2002, eq. 1: what the mean of the picture becomes
_ADAPTATION = 0.75  # of the eye to the hour; with 1 all hours are equally bright
_REACH = 400.0  # of the ground, in half heights of the mesh
_OFFSET = 2e-3  # of rays from the surface
_DPI = 100


@dataclasses.dataclass(frozen=True)
class Figure15:
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    turbidity: float = 3.0
    bands: int = 5
    """bands of the sky's light and of the transfer, up to 7"""
    latitude: float = 48.2
    declination: float = 15.0
    """of the sun, in degrees: the season"""
    frames: int = 24
    """pictures between sunrise and sunset"""
    sheet: int = 8
    """pictures on the contact sheet"""
    height: int = 400
    """of a picture, in pixels; its width is 4/3 of it"""
    samples: int = 2
    """rays along each side of a pixel"""
    directions: int = 256
    """directions of the bake"""
    bounces: int = 0
    """bounces of the sky's light"""

    def __post_init__(self):
        if not 2 <= self.bands <= 7 or not 2.5 <= self.turbidity <= 6:
            raise ValueError("bands must be from 2 to 7 and turbidity in [2.5, 6]")
        if not 2 <= self.sheet <= self.frames or self.height < 16:
            raise ValueError("frames must be at least sheet, sheet at least 2, height at least 16")
        if abs(self.latitude) + abs(self.declination) >= 90:
            raise ValueError("the sun must rise and set: |latitude| + |declination| < 90")


class Scene(NamedTuple):
    """The mesh on its ground, one mesh, and what each sample of the picture sees of it."""

    mesh: geometry.Mesh
    rays: geometry.RayScene
    baked: transfer.Transfer
    albedo: Float[Array, "v 3"]
    camera: imaging.Camera
    raster: imaging.Raster
    positions: Float[np.ndarray, "n 3"]  # of the samples, a little above the surface
    normals: Float[np.ndarray, "n 3"]
    views: Float[np.ndarray, "p 3"]  # of the pixels


class Frame(NamedTuple):
    hour: float
    sun: Float[np.ndarray, " 3"]
    image: Float[Array, "h w 3"]


@experiment("habel2008.figure1_5")
def figure1_5(config: Figure15, context: Context) -> Table:
    """A mesh and its shadows from sunrise to sunset (figures 1 and 5)."""
    scene = _scene(config, context)
    hours = _hours(config)
    frames = []
    for hour in context.progress(hours, "frames"):
        sun = sun_at_hour(hour, config.latitude, config.declination)
        (image, seconds, lit), whole = timed(_render, config, scene, sun)
        context.record(
            {
                "hour": 12 + hour,
                "elevation": float(np.degrees(np.arcsin(sun[2]))),
                "sky": _level(sky.horizontal_irradiance(_sky(config, sun, None))),
                "sun": _level(_sun_irradiance(config, sun) * sun[2]),
                "sunlit": 100 * lit,
                "shade_ms": 1e3 * seconds,
                "frame_ms": 1e3 * whole,
            }
        )
        frames.append(Frame(hour, sun, image))
    pictures = _exposed(frames)
    chosen = np.linspace(0, len(frames) - 1, config.sheet).round().astype(int)
    caption = f"{config.bands} bands of sky and the sun's own light, from sunrise to sunset"
    panels = [Panel(image, _caption(f)) for f, image in zip(frames, pictures, strict=True)]
    sheet = [panels[i] for i in chosen]
    draw_panels(
        context.path("day.png", caption), [sheet[i : i + 4] for i in range(0, len(sheet), 4)]
    )
    animate(context.path("day.gif", "the same, moving"), [[panel] for panel in panels])
    return _table(config, context, chosen)


def sun_at_hour(hour: float, latitude: float, declination: float) -> Float[np.ndarray, " 3"]:
    """Towards the sun, so many hours after solar noon; x is east and y north."""
    turn, height, tilt = np.radians([15 * hour, latitude, declination])
    return np.array(
        [
            -np.cos(tilt) * np.sin(turn),
            np.sin(tilt) * np.cos(height) - np.cos(tilt) * np.sin(height) * np.cos(turn),
            np.sin(tilt) * np.sin(height) + np.cos(tilt) * np.cos(height) * np.cos(turn),
        ]
    )


def _hours(config: Figure15) -> Float[np.ndarray, " n"]:
    """From a little after sunrise to a little before sunset, in hours after noon."""
    height, tilt = np.radians([config.latitude, config.declination])
    half = np.degrees(np.arccos(-np.tan(height) * np.tan(tilt))) / 15
    return np.linspace(-0.985 * half, 0.985 * half, config.frames)


def _scene(config: Figure15, context: Context) -> Scene:
    name = config.mesh or context.data.meshes()[0]
    subject = _standing(context.data.mesh(name))
    ground = _ground()
    mesh = _joined(subject, ground)
    count = len(subject.vertices)
    with context.time("bake"), warnings.catch_warnings():
        # What stands on the ground touches it: a few vertices there see nothing, rightly.
        warnings.filterwarnings("ignore", "bake: .* see nothing")
        albedo = np.repeat([_MESH_ALBEDO, _GROUND_ALBEDO], [count, len(ground.vertices)], axis=0)
        baked = transfer.bake(
            mesh,
            config.bands - 1,
            directions=config.directions,
            bounces=config.bounces,
            albedo=albedo.mean(axis=1).astype(np.float32),
            ray_bias=_OFFSET / _REACH,
            progress=False,
        )
    camera = _camera(subject, config.height)
    raster = imaging.rasterize(mesh, camera, samples=config.samples)
    faces = np.asarray(mesh.faces)[np.maximum(np.asarray(raster.face), 0)]
    weights = np.asarray(raster.barycentric)
    positions, normals = (
        np.einsum("hwkc,hwk->hwc", np.asarray(a)[faces], weights).reshape(-1, 3)
        for a in (mesh.vertices, mesh.normals)
    )
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-9)
    return Scene(
        mesh,
        geometry.ray_scene(mesh),
        baked,
        jnp.asarray(albedo, jnp.float32),
        camera,
        raster,
        positions + _OFFSET * normals,
        normals,
        np.asarray(camera.rays()[1]),
    )


def _standing(mesh: geometry.Mesh) -> geometry.Mesh:
    """Of height 2, upright on the plane z = 0 in the middle."""
    low, high = (np.asarray(f(np.asarray(mesh.vertices), axis=0)) for f in (np.min, np.max))
    shift = np.array([*(low + high)[:2] / 2, low[2]])
    scaled = (np.asarray(mesh.vertices) - shift) * (2 / (high - low)[2])
    return geometry.make_mesh(scaled, np.asarray(mesh.faces))


def _ground(rings: int = 56, spokes: int = 72, reach: float = _REACH) -> geometry.Mesh:
    """A disc, fine in the middle, where shadows fall, and coarse far out."""
    near = np.linspace(0.03, 2.5, 2 * rings // 3)
    radii = np.concatenate([near, np.geomspace(2.6, reach, rings - len(near))])
    angle = 2 * np.pi * np.arange(spokes) / spokes
    x, y = (np.outer(radii, f(angle)).ravel() for f in (np.cos, np.sin))
    points = np.stack([np.append(x, 0), np.append(y, 0), np.zeros(len(x) + 1)], axis=-1)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(rings - 1), np.arange(spokes), indexing="ij"))
    a, b = i * spokes + j, i * spokes + (j + 1) % spokes
    rest = [np.stack([a, a + spokes, b + spokes], -1), np.stack([a, b + spokes, b], -1)]
    ring = np.arange(spokes)
    middle = np.stack([np.full(spokes, len(x)), ring, (ring + 1) % spokes], axis=-1)
    return geometry.make_mesh(points, np.concatenate([middle, *rest]))


def _joined(one: geometry.Mesh, other: geometry.Mesh) -> geometry.Mesh:
    vertices = np.concatenate([one.vertices, other.vertices])
    faces = np.concatenate([one.faces, np.asarray(other.faces) + len(one.vertices)])
    return geometry.make_mesh(vertices, faces)


def _camera(subject: geometry.Mesh, height: int) -> imaging.Camera:
    """From the south, with the horizon in the picture."""
    wide = float(np.abs(np.asarray(subject.vertices)[:, :2]).max())
    distance = 5.2 + wide
    return imaging.Camera(
        position=(0.9, -distance, 1.7),
        target=(0.0, 0.0, 0.95),
        fov_y=30.0,
        width=round(4 / 3 * height),
        height=height,
    )


def _sky(config: Figure15, sun, window) -> Float[Array, "3 k"]:
    sun = jnp.asarray(sun, jnp.float32)
    return sky.preetham_harmonics(sun, config.turbidity, config.bands - 1, window=window)


def _sun_irradiance(config: Figure15, sun) -> Float[np.ndarray, " 3"]:
    """Of a surface that faces the sun, klx in each channel."""
    radiance = sky.sun_radiance(jnp.asarray(sun, jnp.float32), config.turbidity)
    return np.asarray(radiance) * 4 * np.pi * np.sin(sky.SUN_RADIUS / 2) ** 2


def _level(irradiance) -> float:
    return float(LUMINANCE @ np.asarray(irradiance))


def _render(config: Figure15, scene: Scene, sun) -> tuple[Float[Array, "h w 3"], float, float]:
    """The picture, the seconds that the sky's shading took, and the share of samples in the sun."""

    def shade():
        return transfer.shade_diffuse(_sky(config, sun, "habel"), scene.baked, scene.albedo)

    shaded, seconds = timed(shade)
    facing = np.maximum(scene.normals @ sun, 0)
    open_ = (facing > 0) & (np.asarray(scene.raster.face).ravel() >= 0)
    lit = np.zeros(len(facing), np.float32)
    lit[open_] = ~scene.rays.occluded(
        scene.positions[open_], np.broadcast_to(sun.astype(np.float32), (open_.sum(), 3))
    )
    height, width = scene.raster.shape
    n = scene.raster.samples
    direct = (facing * lit).reshape(height, n, width, n).mean(axis=(1, 3))
    paint = imaging.interpolate(scene.raster, scene.albedo)
    behind = _backdrop(config, scene, sun).reshape(height, width, 3)
    sky_part = imaging.interpolate(scene.raster, shaded, jnp.asarray(behind))
    strength = jnp.asarray(_sun_irradiance(config, sun) / np.pi, jnp.float32)
    image = (
        jnp.maximum(sky_part, 0)
        + paint * jnp.asarray(direct, jnp.float32)[..., None] * (strength[None, None])
    )
    on = np.asarray(scene.raster.face).ravel() >= 0
    return image, seconds, float(lit[on].mean())


def _backdrop(config: Figure15, scene: Scene, sun) -> Float[np.ndarray, "n 3"]:
    """The sky itself above the horizon, and below it ground without end."""
    up = jnp.asarray(scene.views).at[:, 2].set(jnp.maximum(scene.views[:, 2], 0))
    above = np.asarray(sky.preetham_radiance(up, jnp.asarray(sun, jnp.float32), config.turbidity))
    received = np.asarray(sky.horizontal_irradiance(_sky(config, sun, None)))
    received = received + _sun_irradiance(config, sun) * sun[2]
    below = np.array(_GROUND_ALBEDO) / np.pi * received
    return np.where(scene.views[:, 2:] > 0, above, below).astype(np.float32)


def _exposed(frames: list[Frame]) -> list[Float[np.ndarray, "h w 3"]]:
    """Reinhard's curve, its exposure following the light of the hour most of the way."""
    levels = [
        float(np.exp(np.mean(np.log(np.maximum(np.asarray(f.image) @ LUMINANCE, 1e-3)))))
        for f in frames
    ]
    noon = max(levels)
    curve = functools.partial(imaging.tone_map, curve="reinhard", white=3.0)
    return [
        np.asarray(curve(f.image, _KEY / (level**_ADAPTATION * noon ** (1 - _ADAPTATION))))
        for f, level in zip(frames, levels, strict=True)
    ]


def _caption(frame: Frame) -> str:
    minutes = round(60 * (12 + frame.hour))
    elevation = np.degrees(np.arcsin(frame.sun[2]))
    return f"{minutes // 60:02d}:{minutes % 60:02d}   sun {elevation:.0f}° up"


def _table(config: Figure15, context: Context, chosen) -> Table:

    return Table(
        "Through the day",
        rows=[context.rows[i] for i in chosen],
        values={"bake_seconds": context.times["bake"]["seconds"], "adaptation": _ADAPTATION},
    )
