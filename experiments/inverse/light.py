"""Light recovered from what some views see of a mesh, with a prior of real light and without.

What is observed is summed over the pixels of a probe, not shaded by spherical harmonics, so that
it holds all of the light's bands. The prior of each probe is made of the other probes.
"""

import dataclasses
import itertools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from jaxsh import geometry, imaging, inverse, sphere, transfer

from ..runner import Context, Table, experiment
from ..shared.pixels import direct_irradiance, solid_angles
from ..shared.subjects import double, load
from .light_picture import Recovered, draw
from .prior import band_powers, power_law

ALBEDO = 0.5
# The prior's last band where normals alone are given, as `fit_light` has it.
BANDS = 12


@dataclasses.dataclass(frozen=True)
class InverseLight:
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    environments: tuple[str, ...] = ()
    """environments by name; none means all that the data has"""
    degrees: tuple[int, ...] = (2,)
    """degrees of the recovered light"""
    noise: tuple[float, ...] = (0.0, 0.01, 0.05)
    """standard deviations of the noise, in the mean observed radiance"""
    views: tuple[int, ...] = (1, 2, 4)
    """numbers of views, evenly around the mesh; the first of them is drawn"""
    points: int = 1000
    """vertices that all views of a fit see together, and that errors are measured at"""
    turns: int = 4
    """rounds of views, each turned further around the mesh, with noise of its own"""
    rows: int = 0
    """rows of a probe where it must be made smaller for speed; 0 takes all of its pixels"""
    shadow_rows: int = 64
    """rows of the probe where rays are cast to its pixels"""
    directions: int = 512
    """directions of the bake"""
    transfer_degree: int = 6
    """of the transfer with shadows"""
    height: int = 400
    """of a panel, in pixels"""

    def __post_init__(self):
        if not self.noise or min(self.noise) < 0:
            raise ValueError("noise must be one or more numbers >= 0")
        if not self.views or min(self.views) < 1 or self.points < 32 or self.turns < 1:
            raise ValueError("views and turns must be at least 1, points at least 32")
        if not self.degrees or not 1 <= min(self.degrees) <= max(self.degrees) <= 6:
            raise ValueError("degrees must be one or more numbers from 1 to 6")
        if self.transfer_degree < max(self.degrees):
            raise ValueError("transfer_degree must be at least the largest of degrees")


class Lit(NamedTuple):
    """Vertices of the mesh under each probe, by quadrature over its pixels."""

    surface: str
    vertices: Int[np.ndarray, " n"]
    irradiance: dict[str, Float[np.ndarray, "n 3"]]


@experiment("inverse.light", x64=True)
def run(config: InverseLight, context: Context) -> list[Table]:
    loaded = load(context, config.mesh, config.transfer_degree, directions=config.directions)
    name, mesh, baked = double(loaded)
    names = config.environments or tuple(context.data.environments())
    probes = {name: np.asarray(context.data.environment(name), float) for name in names}
    powers = {name: band_powers(jnp.asarray(probes[name]), BANDS) for name in names}
    normals = np.asarray(mesh.normals, float)
    rng = np.random.default_rng(context.seed)
    seen = _views(mesh, config, rng)
    measured = rng.choice(len(normals), min(config.points, len(normals)), replace=False)
    used = np.unique(np.concatenate([measured, *seen.values()]))
    lit = []
    with context.time(f"{name}: all pixels of the probes"):
        small = {name: _smaller(probe, config.rows) for name, probe in probes.items()}
        exact = {name: _direct(normals[used], probe) for name, probe in small.items()}
        lit.append(Lit("normals", used, exact))
    with context.time(f"{name}: rays to the probes"):
        small = {name: _smaller(probe, config.shadow_rows) for name, probe in probes.items()}
        lit.append(Lit("with shadows", used, _shadowed(mesh, used, small)))
    pictures = []
    cases = list(itertools.product(lit, names))
    for scene, probe in context.progress(cases, "surfaces and probes"):
        law = _variances([power for other, power in powers.items() if other != probe])
        truth = np.asarray(sphere.project_lat_long(jnp.asarray(probes[probe]), max(config.degrees)))
        at = np.full((len(normals), 3), np.nan)
        at[scene.vertices] = scene.irradiance[probe]
        for degree, views, noise, turn in itertools.product(
            config.degrees, config.views, config.noise, range(config.turns)
        ):
            chosen = seen[views, turn]
            clean = ALBEDO / np.pi * at[chosen]
            draws = np.random.default_rng([context.seed, turn, int(1e6 * noise)])
            observed = clean + noise * clean.mean() * draws.normal(size=clean.shape)
            fits = {}
            for method in ("plain", "prior"):
                prior = law if method == "prior" else None
                found = _fit(scene.surface, observed, chosen, normals, baked, degree, prior)
                fits[method] = np.asarray(found.value)
                if scene.surface == "normals":
                    again = sphere.irradiance(found.value, normals[measured])
                else:
                    again = baked.irradiances(found.value)[measured]
                row = {
                    "surface": scene.surface,
                    "environment": probe,
                    "degree": degree,
                    "views": views,
                    "noise": noise,
                    "turn": turn,
                    "method": method,
                }
                errors = _errors(found, truth, np.asarray(again), at[measured], clean.mean())
                context.record(row | errors)
            first = config.degrees[0], config.views[0], config.noise[-1], 0
            if scene.surface == "normals" and (degree, views, noise, turn) == first:
                probe_small = _smaller(probes[probe], 32)
                pictures.append(Recovered(probe, truth, fits, _direct(normals, probe_small)))
    caption = (
        "front as lit; back as lit, by least squares and with the prior; the lights themselves, "
        "blue where they are negative"
    )
    draw(context.path("recovered.png", caption), mesh, pictures, _toward(0, 1, 0), config.height)
    return _tables(context.rows, loaded.about)


def _toward(view: int, views: int, turn: float) -> Float[np.ndarray, " 3"]:
    """Direction from the mesh to a camera, a little above it."""
    angle = 2 * np.pi * view / views + turn
    toward = np.array([np.cos(angle), np.sin(angle), 0.25])
    return toward / np.linalg.norm(toward)


def _views(
    mesh: geometry.Mesh, config: InverseLight, rng: np.random.Generator
) -> dict[tuple[int, int], Int[np.ndarray, " n"]]:
    """As many vertices as asked for of those that some views see, for each round of views."""
    scene, seen = geometry.ray_scene(mesh), {}
    for views, turn in itertools.product(config.views, range(config.turns)):
        found = []
        for view in range(views):
            toward = _toward(view, views, 2 * np.pi * turn / config.turns / views)
            camera = imaging.Camera.facing(mesh, toward=tuple(toward), width=256, height=256)
            faces = np.asarray(imaging.rasterize(mesh, camera, scene=scene).face)
            found.append(np.asarray(mesh.faces)[np.unique(faces[faces >= 0])].ravel())
        found = np.unique(np.concatenate(found))
        seen[views, turn] = rng.choice(found, config.points, replace=len(found) < config.points)
    return seen


def _smaller(probe: Float[np.ndarray, "h w 3"], rows: int) -> Float[np.ndarray, "r c 3"]:
    """Mean over blocks of pixels by solid angle; the probe itself where rows is 0."""
    height, width, _ = probe.shape
    if not 0 < rows < height:
        return probe
    step = height // rows
    if height % rows or width % step:
        raise ValueError(f"{rows} rows do not divide a probe of {height}")
    weights = np.broadcast_to(solid_angles(height, width), (height, width))
    weighted = (probe * weights[..., None]).reshape(rows, step, width // step, step, 3)
    return (
        weighted.sum((1, 3))
        / weights.reshape(rows, step, width // step, step).sum((1, 3))[..., None]
    )


def _direct(
    normals: Float[np.ndarray, "n 3"], probe: Float[np.ndarray, "h w 3"]
) -> Float[np.ndarray, "n 3"]:
    return np.asarray(direct_irradiance(jnp.asarray(normals), jnp.asarray(probe)))


def _shadowed(
    mesh: geometry.Mesh, vertices: Int[np.ndarray, " n"], probes: dict[str, Any]
) -> dict[str, Float[np.ndarray, "n 3"]]:
    """The same with what the mesh itself hides taken away, by a ray to each pixel."""
    height, width, _ = next(iter(probes.values())).shape
    directions = np.asarray(sphere.lat_long(height, width).directions, float)
    solid = np.broadcast_to(solid_angles(height, width), (height, width)).ravel()
    scene, size = geometry.ray_scene(mesh), float(np.ptp(np.asarray(mesh.vertices), axis=0).max())
    found = {name: np.zeros((len(vertices), 3)) for name in probes}
    for row, vertex in enumerate(vertices):
        normal = np.asarray(mesh.normals[vertex], float)
        cosine = directions @ normal
        above = cosine > 0
        origin = np.asarray(mesh.vertices[vertex], float) + 1e-4 * size * normal
        clear = ~np.asarray(scene.occluded(origin, directions[above]))
        weight = (cosine * solid)[above] * clear
        for name, probe in probes.items():
            found[name][row] = weight @ probe.reshape(-1, 3)[above]
    return found


def _variances(powers: list[Float[np.ndarray, " bands"]]) -> Float[np.ndarray, " bands"]:
    """The law of the other probes; what is shipped where there is no other."""
    if not powers:
        return np.asarray(inverse.light_variances(BANDS))
    level, fall = power_law(powers)
    return level * np.arange(1.0, BANDS + 1) ** -fall


def _fit(
    surface: str,
    observed: Float[np.ndarray, "n 3"],
    chosen: Int[np.ndarray, " n"],
    normals: Float[np.ndarray, "v 3"],
    baked: transfer.Transfer,
    degree: int,
    prior: Float[np.ndarray, " bands"] | None,
) -> inverse.RecoveredLight:
    if surface == "normals":
        return inverse.fit_light(observed, normals[chosen], ALBEDO, degree, prior=prior)
    rows = jax.tree.map(lambda x: x[chosen], baked)
    prior = None if prior is None else prior[: baked.degree]
    return inverse.fit_light(observed, rows, ALBEDO, degree, prior=prior)


def _errors(
    found: inverse.RecoveredLight,
    truth: Float[np.ndarray, "3 k"],
    again: Float[np.ndarray, "n 3"],
    expected: Float[np.ndarray, "n 3"],
    mean: float,
) -> dict[str, float]:
    """Of the light by its own length, in %, and of the irradiance as `environment` has it."""
    count = found.value.shape[-1]
    error = np.asarray(found.value) - truth[:, :count]
    apart = np.linalg.norm(again - expected, axis=-1).mean()
    ratio = error / np.asarray(found.confidence.deviation)
    return {
        "light_error": 100 * float(np.linalg.norm(error) / np.linalg.norm(truth[:, :count])),
        "irradiance_error": 100 * float(apart / np.linalg.norm(expected, axis=-1).mean()),
        "error_in_deviations": float(np.sqrt(np.mean(ratio[:, 1:] ** 2))),
        "noise_found": float(found.noise) / mean,
        "least_determined": float(found.determined[:, 1:9].min()),
    }


def _tables(rows: list[dict[str, Any]], about: str) -> list[Table]:
    """Means over the probes and the rounds of views."""
    keys = "surface", "degree", "views", "noise"
    shown = []
    for case in dict.fromkeys(tuple(row[key] for key in keys) for row in rows):
        of = [row for row in rows if tuple(row[key] for key in keys) == case]
        line: dict[str, Any] = dict(zip(keys, case, strict=True)) | {"noise": 100 * case[-1]}
        for method in ("plain", "prior"):
            mine = [row for row in of if row["method"] == method]
            line |= {
                f"light_{method}": np.mean([row["light_error"] for row in mine]),
                f"worst_{method}": max(row["light_error"] for row in mine),
                f"irradiance_{method}": np.mean([row["irradiance_error"] for row in mine]),
                f"deviations_{method}": np.sqrt(
                    np.mean([row["error_in_deviations"] ** 2 for row in mine])
                ),
            }
        line["noise_found"] = 100 * np.median(
            [r["noise_found"] for r in of if r["method"] == "prior"]
        )
        shown.append({key: x if isinstance(x, str | int) else float(x) for key, x in line.items()})
    return [Table("Light from views of a mesh", rows=shown, values={"about": about})]
