"""Sun, sky and ground recovered from one picture of a mesh outdoors.

The picture is made without harmonics: each pixel sums the radiance of sky and ground over
directions whose rays get past the mesh, and that of the sun's disc over rays to it. Noise is added;
`inverse.fit_daylight` has to say what light that was, by more or less knowledge of the shadows.
"""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, Literal, NamedTuple, get_args

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxsh import geometry, imaging, inverse, sky, sphere, transfer

from ..runner import Context, Table, UserError, experiment
from ..shared.subjects import load
from .daylight_picture import Shown, draw

Sky = Literal["preetham", "hosek", "overcast"]
Way = Literal["none", "ignored", "transfer", "traced"]

_DEGREE = 6
_GROUND = np.array([0.3, 0.2, 0.12])
# By how much, in degrees, the sun that was found may be off in each round of tracing shadows.
_DOUBTS = 12.0, 5.0, 2.0, 0.7
_NODES = 2**14
# Where rays start above the surface, in the mesh's longest extent.
_OFFSET = 1e-3


@dataclasses.dataclass(frozen=True)
class InverseDaylight:
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    skies: tuple[Sky, ...] = get_args(Sky)
    """what shines: the model that is fitted, another one, or no sun and the CIE's overcast sky"""
    ways: tuple[Way, ...] = get_args(Way)
    """shadows: none in the picture; in it, but not in the fit; through a transfer; traced too"""
    model: Literal["preetham", "hosek"] = "preetham"
    """the sky that is fitted: Preetham's, or Hosek and Wilkie's through a fit of `sky.fit`"""
    settings: int = 6
    """suns and turbidities, drawn at random"""
    noise: float = 0.01
    """standard deviation of the noise, in the mean observed radiance"""
    height: int = 64
    """of the picture, in pixels"""
    directions: int = 2048
    """of the sky and the ground, in which rays leave each pixel"""
    albedo: float = 0.5

    def __post_init__(self):
        if self.settings < 1 or self.height < 16 or self.directions < 64 or self.noise < 0:
            raise ValueError("settings >= 1, height >= 16, directions >= 64, noise >= 0")
        if not 0 < self.albedo <= 1:
            raise ValueError(f"albedo must be above 0 and at most 1, got {self.albedo}")


class View(NamedTuple):
    """Points of a mesh, pixels of one picture or all vertices, and what each of them sees."""

    scene: geometry.RayScene
    baked: transfer.Transfer  # of the P points
    normals: Float[np.ndarray, "p 3"]
    origins: Float[np.ndarray, "p 3"]  # of rays
    directions: Float[np.ndarray, "n 3"]
    free: Bool[np.ndarray, "p n"]

    def by_sun(self, sun: Float[np.ndarray, " 3"], rays: int = 32) -> Float[np.ndarray, " p"]:
        """Irradiance by a sun's disc of radiance 1/Ω, over rays to it that all pixels share."""
        n = np.arange(rays)
        radius, turn = sky.SUN_RADIUS * np.sqrt((n + 0.5) / rays), n * np.pi * (3 - np.sqrt(5))
        across = np.linalg.svd(sun[None])[2][1:]
        aside = np.stack([np.cos(turn), np.sin(turn)], axis=1) @ across
        total = np.zeros(len(self.free))
        for direction in np.cos(radius)[:, None] * sun + np.sin(radius)[:, None] * aside:
            cosines = np.maximum(self.normals @ direction, 0)
            total += cosines * ~self.scene.occluded(self.origins, direction)
        return total / rays


class Truth(NamedTuple):
    kind: Sky
    sun: Float[np.ndarray, " 3"]
    turbidity: float

    def above(self, directions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Radiance of the sky, zero below the horizon, in kcd/m²."""
        if self.kind == "overcast":
            return np.asarray(sky.cie_radiance(directions, self.sun, 5.0, kind=1))
        if self.kind == "hosek":
            given = self.sun, self.turbidity, float(_GROUND.mean())
            return np.asarray(sky.hosek_radiance(directions, *given))
        return np.asarray(sky.preetham_radiance(directions, self.sun, self.turbidity))

    @property
    def facing(self) -> Float[np.ndarray, " 3"]:
        """Irradiance by the sun's disc of what faces it."""
        radiance = np.asarray(sky.sun_radiance(self.sun, self.turbidity))
        return np.pi * np.sin(sky.SUN_RADIUS) ** 2 * radiance * (self.kind != "overcast")

    def level(self) -> Float[np.ndarray, " 3"]:
        """Irradiance of level ground by the sky."""
        nodes = np.asarray(sphere.fibonacci(_NODES).directions, np.float64)
        return 4 * np.pi / _NODES * np.maximum(nodes[:, 2], 0) @ self.above(nodes)

    def radiance(self, directions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Radiance of sky and ground, without the sun's disc."""
        ground = _GROUND / np.pi * (self.level() + self.sun[2] * self.facing)
        return np.where(directions[:, 2:] < 0, ground, self.above(directions))


@experiment("inverse.daylight", x64=True)
def run(config: InverseDaylight, context: Context) -> Table:
    name, mesh, view, whole = _views(config, context)
    shown = []
    for kind in config.skies:
        # Without a sun all pictures are the same.
        count = 1 if kind == "overcast" else config.settings
        truths = _truths(kind, count, context.seed)
        for number, truth in enumerate(context.progress(truths, f"{kind} sky")):
            for way in config.ways:
                clean = _picture(truth, view, config.albedo, shadows=way != "none")
                noise = np.random.default_rng([context.seed, number]).normal(size=clean.shape)
                observed = clean + config.noise * clean.mean() * noise
                found = _find(way, observed, view, config)
                context.record(_row(number, way, truth, found, config))
                if number == 0 and way == config.ways[-1]:
                    # Of the vertices, as one sees them: the fit's pixels are few.
                    truly = _picture(truth, whole, config.albedo, shadows=way != "none")
                    again = _render(found.value, whole, config)
                    seen = Truth(
                        config.model, np.asarray(found.value.sun), float(found.value.turbidity)
                    )
                    shown.append(Shown(truth, truly, again, found.value, seen))
    caption = (
        f"the mesh as it is lit, of which {config.height} × {config.height} pixels with noise were "
        "observed, and as the light that was found lights it; the true light and the one found, "
        "circles where the suns are"
    )
    draw(context.path("recovered.png", caption), mesh, shown)
    about = {"name": name, "pixels": len(view.free)}
    return Table("Daylight from one picture", rows=_rows(config, context), values=about)


def _views(config: InverseDaylight, context: Context) -> tuple[str, geometry.Mesh, View, View]:
    """The pixels of the picture, and all vertices: what is fitted, and what is shown.

    Positions, normals and transfer of pixels are those of the vertices, interpolated.
    """
    name, mesh, baked = load(context, config.mesh, _DEGREE, directions=config.directions)
    camera = imaging.Camera.facing(mesh, width=config.height, height=config.height)
    scene = geometry.ray_scene(mesh)
    raster = imaging.rasterize(mesh, camera, scene=scene)
    on = np.asarray(raster.mask)
    if not on.any():
        raise UserError(f"no pixel of {config.height} is on {name}: raise the height")

    def of_pixels(values):
        return np.asarray(imaging.interpolate(raster, values), np.float64)[on]

    whole = tuple(
        np.asarray(values, np.float64)
        for values in (baked.coefficients, mesh.vertices, mesh.normals)
    )
    pixels = tuple(map(of_pixels, (baked.coefficients, mesh.vertices, mesh.normals)))
    views = [_view(mesh, scene, values, config.directions, context) for values in (pixels, whole)]
    return name, mesh, views[0], views[1]


def _view(
    mesh: geometry.Mesh,
    scene: geometry.RayScene,
    values: tuple[np.ndarray, ...],
    count: int,
    context: Context,
) -> View:
    """Of these coefficients, positions and normals, with rays into so many directions."""
    coefficients, positions, normals = values
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    baked = transfer.Transfer(
        jnp.asarray(coefficients),
        jnp.asarray(positions),
        jnp.asarray(normals),
        jnp.arange(len(positions), dtype=jnp.int32)[:, None],
    )
    directions = np.asarray(sphere.fibonacci(count).directions, np.float64)
    extent = np.ptp(np.asarray(mesh.vertices, np.float64), axis=0).max()
    origins = positions + _OFFSET * extent * normals
    free = np.zeros((len(positions), len(directions)), bool)
    for at, direction in enumerate(context.progress(directions, "rays")):
        out = normals @ direction > 0
        free[out, at] = ~scene.occluded(origins[out], direction)
    return View(scene, baked, normals, origins, directions, free)


def _truths(kind: Sky, count: int, seed: int) -> list[Truth]:
    """Suns all around, from 9 to 72 degrees up."""
    truths = []
    for height, turn, haze in np.random.default_rng(seed).uniform(size=(count, 3)):
        height, angle = 0.15 + 0.8 * height, 2 * np.pi * turn
        aside = np.sqrt(1 - height**2)
        sun = np.array([aside * np.cos(angle), aside * np.sin(angle), height])
        truths.append(Truth(kind, sun, 2.5 + 3.5 * haze))
    return truths


def _picture(truth: Truth, view: View, albedo: float, *, shadows: bool) -> Float[np.ndarray, "p 3"]:
    """Radiance of the pixels on the mesh, by sums over directions."""
    cosines = np.maximum(view.normals @ view.directions.T, 0)
    if shadows:
        cosines, sun = cosines * view.free, view.by_sun(truth.sun)
    else:
        sun = np.maximum(view.normals @ truth.sun, 0)
    weight = 4 * np.pi / len(view.directions)
    irradiance = weight * cosines @ truth.radiance(view.directions) + sun[:, None] * truth.facing
    return albedo / np.pi * irradiance


def _sunlit(view: View, sun: Float[Array, " 3"]) -> Float[Array, " p"]:
    size = jnp.full(1, 2 * np.pi * (1 - np.cos(sky.SUN_RADIUS)))
    suns = sphere.Suns(sun[None], size, jnp.ones((1, 3)))
    return transfer.sun_visibility(suns, view.baked, view.scene).fraction[:, 0].astype(sun.dtype)


@functools.cache
def _model(name: str) -> Callable[..., Array]:
    if name == "preetham":
        return functools.partial(sky.preetham_harmonics, degree=_DEGREE)
    radiance = functools.partial(sky.hosek_radiance, albedo=float(_GROUND.mean()), check="allow")
    fitted = sky.fit(
        radiance, {"turbidity": (2.5, 6.0)}, degree=_DEGREE, terms=(12, 8), log=["turbidity"]
    )
    return lambda sun, turbidity: fitted(sun, turbidity)


def _find(
    way: Way, observed: Float[np.ndarray, "p 3"], view: View, config: InverseDaylight
) -> inverse.Recovered[inverse.Daylight]:
    albedo = config.albedo
    fit = functools.partial(inverse.fit_daylight, sky=_model(config.model), throw=False)
    if way == "transfer":
        return fit(observed, view.baked, albedo)
    found = fit(observed, view.normals, albedo)
    for doubt in _DOUBTS if way == "traced" else ():
        sunlit, sure = _shadows(view, np.asarray(found.value.sun), np.radians(doubt))
        found = fit(observed, view.baked, albedo, sunlit=sunlit, mask=sure)
    return found


def _shadows(
    view: View, sun: Float[np.ndarray, " 3"], doubt: float
) -> tuple[Float[Array, " p"], Bool[np.ndarray, " p"]]:
    """What each pixel sees of the sun, and whether it would of suns around it: there it is sure.

    Elsewhere the shadow's edge would hold the fit where the sun was taken to be.
    """
    turn = np.arange(6) * np.pi / 3
    aside = np.stack([np.cos(turn), np.sin(turn)], axis=1) @ np.linalg.svd(sun[None])[2][1:]
    sunlit = _sunlit(view, jnp.asarray(sun))
    lit = np.asarray(sunlit) > 0.5
    sure = np.ones_like(lit)
    for one in np.cos(doubt) * sun + np.sin(doubt) * aside:
        faces = view.normals @ one > 0
        sure &= lit == (faces & ~view.scene.occluded(view.origins, one))
    # Where the sun only grazes, the cosine tells, not the shadow.
    return sunlit, sure | (np.abs(view.normals @ sun) < np.sin(doubt))


def _render(
    value: inverse.Daylight, view: View, config: InverseDaylight
) -> Float[np.ndarray, "p 3"]:
    """The picture that a light found makes, shadows included."""
    rest = value.harmonics(_DEGREE, sun=False, sky=_model(config.model))
    rest = transfer.shade_diffuse(rest, view.baked, config.albedo)
    return np.asarray(rest + transfer.shade_sun(value.suns, view.baked, view.scene, config.albedo))


def _row(
    number: int,
    way: Way,
    truth: Truth,
    found: inverse.Recovered[inverse.Daylight],
    config: InverseDaylight,
) -> dict[str, Any]:
    value, deviation = found.value, found.confidence.deviation
    sunny = truth.kind != "overcast"
    distance = np.linalg.norm(np.asarray(value.sun) - truth.sun)
    facing, level = np.asarray(value.facing).sum(), truth.level().sum()
    above = value.exposure * _model(config.model)(value.sun, value.turbidity)
    total = float(jnp.sum(sky.horizontal_irradiance(above) + value.sun[2] * value.facing))
    return {
        "sky": truth.kind,
        "way": way,
        "setting": number,
        "elevation": float(np.degrees(np.arcsin(truth.sun[2]))),
        "turbidity": truth.turbidity,
        "sun_error": float(np.degrees(2 * np.arcsin(distance / 2))) if sunny else float("nan"),
        "sun_deviation": float(np.degrees(np.linalg.norm(deviation.sun))),
        "turbidity_error": abs(float(value.turbidity) - truth.turbidity) if sunny else float("nan"),
        "turbidity_deviation": float(deviation.turbidity),
        "ground_error": float(np.sqrt(np.mean((value.ground - _GROUND) ** 2))),
        "ground_deviation": float(np.sqrt(np.mean(deviation.ground**2))),
        "sun_light": facing / truth.facing.sum() - 1 if sunny else float("nan"),
        "sky_light": float(jnp.sum(sky.horizontal_irradiance(above))) / level - 1,
        "sun_share": 1 - float(jnp.sum(sky.horizontal_irradiance(above))) / total,
        "residual": float(found.statistics.residual),
        "converged": found.converged,
        "at_bound": bool(found.statistics.at_bound),
    }


def _rows(config: InverseDaylight, context: Context) -> list[dict[str, Any]]:
    """A line for each sky and way: root mean squares over the settings, and the worst sun."""
    rows = []
    for kind in config.skies:
        for way in config.ways:
            of = [row for row in context.rows if (row["sky"], row["way"]) == (kind, way)]

            def rms(key, of=of):
                return float(np.sqrt(np.mean([row[key] ** 2 for row in of])))

            rows.append(
                {
                    "sky": kind,
                    "way": way,
                    "sun": rms("sun_error"),
                    "sun_worst": max(row["sun_error"] for row in of),
                    "sun_said": rms("sun_deviation"),
                    "turbidity": rms("turbidity_error"),
                    "turbidity_said": rms("turbidity_deviation"),
                    "ground": rms("ground_error"),
                    "ground_said": rms("ground_deviation"),
                    "sun_light": 100 * rms("sun_light"),
                    "sky_light": 100 * rms("sky_light"),
                    "sun_share": 100 * rms("sun_share"),
                    "residual": 100 * rms("residual"),
                    "failed": sum(not row["converged"] for row in of),
                }
            )
    return rows
