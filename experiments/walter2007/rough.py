"""Rough materials: the lobe of `Material.ggx` beside Phong's, against the true reflection."""

import dataclasses
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxsh import geometry, harmonics, imaging, sphere, transfer

from ..runner import Column, Context, Table, experiment
from ..shared.plots import Panel, View, draw_panels
from ..shared.subjects import load
from .microfacets import incoming

_EXPONENTS = np.geomspace(0.5, 1000, 40)
_FINE = 96, 96  # halfway vectors by height and azimuth, for coefficients
_OFFSET = 1e-3  # of rays, in half-extents
_BLOCK = 512  # vertices whose rays are cast together


@dataclasses.dataclass(frozen=True)
class Rough:
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    environment: str | None = None
    """environment by name; none means the first that the data has"""
    degrees: tuple[int, ...] = (4, 10)
    """degrees of light, transfer and lobe; the mesh is shaded at the highest"""
    roughness: tuple[float, ...] = (0.2, 0.35, 0.5, 0.7, 1.0)
    """roughness, whose square is α"""
    specular: tuple[float, ...] = (1.0, 0.04)
    """reflectance along the normal"""
    angles: tuple[float, ...] = (0.0, 30.0, 45.0, 60.0, 75.0)
    """angles between normal and eye, in degrees"""
    directions: int = 1024
    """directions of the bake"""
    rays: int = 16
    """halfway vectors by height, and by azimuth, at each vertex; 0 leaves the mesh out"""
    size: int = 300
    """height and width of the pictures, in pixels"""

    def __post_init__(self):
        if not self.degrees or not self.roughness or not self.specular or not self.angles:
            raise ValueError("degrees, roughness, specular and angles must each have a value")
        if not 0 <= min(self.angles) <= max(self.angles) < 90:
            raise ValueError("angles must be from 0 to below 90")


@experiment("rough")
def run(config: Rough, context: Context) -> list[Table]:
    nearest = {}
    for degree in config.degrees:
        for roughness in context.progress(config.roughness, f"degree {degree}"):
            for specular in config.specular:
                phong = _phong(roughness, specular, degree)
                nearest[degree, roughness, specular] = phong
                for row in _by_angle(config, degree, roughness, specular, phong):
                    context.record(row)
    rows = [row for row in context.rows if row["what"] == "lobe"]
    columns = [Column("degree", "degree"), Column("specular", "reflectance")]
    columns += [Column("roughness", "roughness")]
    columns += [Column(f"{angle:g}", f"{angle:g}°") for angle in config.angles]
    uniform = max(row["uniform"] for row in rows)
    tables = [Table("Lobes", columns, _cells(config, rows), values={"uniform": uniform})]
    if config.rays:
        tables.append(_mesh(config, context, nearest))
    return tables


def _cells(config: Rough, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    cells: dict[tuple[Any, ...], dict[str, Any]] = {}
    for row in rows:
        names = "degree", "specular", "roughness"
        cell = cells.setdefault(tuple(row[n] for n in names), {n: row[n] for n in names})
        cell[f"{row['angle']:g}"] = f"{row['error']:.0f} ({row['phong_error']:.0f})"
    return list(cells.values())


def _turned(cosines: Float[np.ndarray, " v"]) -> Float[np.ndarray, "v 3"]:
    """Normals at these cosines to the eye, which is at z."""
    return np.stack([np.sqrt(1 - cosines**2), 0 * cosines, cosines], axis=1)


def _true(cosines, roughness: float, specular: float, degree: int) -> Float[np.ndarray, "v k"]:
    """Coefficients with which light turns into radiance."""
    normals = _turned(cosines)
    eyes = np.broadcast_to([0.0, 0.0, 1.0], normals.shape)
    directions, weights = incoming(eyes, normals, roughness, specular, _FINE)
    evaluate = jax.jit(harmonics.evaluate, static_argnums=1)
    return np.stack(
        [w @ np.asarray(evaluate(d, degree)) for d, w in zip(directions, weights, strict=True)]
    )


def _by_lobe(cosines, material: transfer.Material, degree: int) -> Float[np.ndarray, "v k"]:
    """The same of an open surface, by a material's lobe."""
    normals = _turned(cosines)
    surface = transfer.unshadowed(np.zeros_like(normals), normals, degree)
    up = np.array([0.0, 0.0, 1.0])
    return np.asarray(transfer.fixed_view(surface, up, material, distant=True).coefficients)


class Phong(NamedTuple):
    """The nearest Phong lobe."""

    exponent: float
    albedo: float

    @property
    def material(self) -> transfer.Material:
        return transfer.Material(0.0, self.albedo, self.exponent)


def _phong(roughness: float, specular: float, degree: int) -> Phong:
    """Least squares over all views, as a camera sees them: weighted by their cosine."""
    cosines, weights = np.polynomial.legendre.leggauss(12)
    cosines = (cosines + 1) / 2
    weights = (weights * cosines)[:, None]
    true = _true(cosines, roughness, specular, degree)
    best, least = Phong(1.0, 0.0), np.inf
    for exponent in _EXPONENTS:
        lobe = _by_lobe(cosines, transfer.Material(0.0, 1.0, exponent), degree)
        albedo = np.sum(weights * lobe * true) / np.sum(weights * lobe**2)
        error = np.sum(weights * (true - albedo * lobe) ** 2)
        if error < least:
            best, least = Phong(float(exponent), float(albedo)), error
    return best


def _by_angle(config: Rough, degree: int, roughness: float, specular: float, phong: Phong):
    cosines = np.cos(np.radians(config.angles))
    true = _true(cosines, roughness, specular, degree)
    ggx = _by_lobe(cosines, transfer.Material.ggx(0.0, specular, roughness), degree)
    other = _by_lobe(cosines, phong.material, degree)
    length = np.linalg.norm(true, axis=1)
    for i, angle in enumerate(config.angles):
        yield {
            "what": "lobe",
            "degree": degree,
            "roughness": roughness,
            "specular": specular,
            "angle": angle,
            "error": 100 * np.linalg.norm(ggx[i] - true[i]) / length[i],
            "phong_error": 100 * np.linalg.norm(other[i] - true[i]) / length[i],
            "uniform": 100 * abs(ggx[i, 0] / true[i, 0] - 1),
            "exponent": phong.exponent,
        }


def _mesh(config: Rough, context: Context, nearest: dict[tuple[Any, ...], Phong]) -> Table:
    degree = max(config.degrees)
    subject = load(context, config.mesh, degree, directions=config.directions)
    name = config.environment or context.data.environments()[0]
    light = sphere.project_lat_long(context.data.environment(name), degree)
    light = light * harmonics.window("hann", degree)[None].astype(light.dtype)
    camera = imaging.Camera.facing(subject.mesh, width=config.size, height=config.size)
    view = View.by(subject.mesh, camera, samples=2)
    seen = np.flatnonzero(np.asarray(view.facing) > 0)
    scene = Scene(
        subject.mesh, geometry.ray_scene(subject.mesh), camera.position, seen, light, config.rays
    )
    shown: list[list[Panel]] = []
    for specular in config.specular:
        for roughness in config.roughness:
            with context.time(f"roughness {roughness:g}, {specular:g}: reference"):
                true = _by_rays(scene, roughness, specular)
            phong = nearest[degree, roughness, specular]
            ggx, other = (
                transfer.shade_glossy(light, subject.baked, camera.position, material)
                for material in (transfer.Material.ggx(0.0, specular, roughness), phong.material)
            )
            exposed = view._replace(
                exposure=float(
                    imaging.auto_exposure(imaging.interpolate(view.raster, true), view.raster.mask)
                )
            )
            row: dict[str, Any] = {
                "what": "mesh",
                "roughness": roughness,
                "specular": specular,
                "exponent": phong.exponent,
            }
            for key, made in (("ggx", ggx), ("phong", other)):
                apart = jnp.linalg.norm((made - true)[seen], axis=1)
                row[key] = 100 * float(apart.mean() / jnp.linalg.norm(true[seen], axis=1).mean())
                row[f"{key}_psnr"] = exposed.psnr(made, true)[0]
            row["ratio"] = row["ggx"] / row["phong"]
            context.record(row)
            if roughness in config.roughness[:3:2]:  # few enough to look at
                title = f"roughness {roughness:g}, F₀ {specular:g}"
                shown.append(
                    [
                        Panel(exposed.shown(true), f"true, {title}"),
                        Panel(exposed.shown(ggx), f"GGX lobe, {row['ggx']:.0f} % off"),
                        Panel(exposed.shown(other), f"Phong, {row['phong']:.0f} % off"),
                        exposed.error("GGX − true", ggx, true, 4),
                        exposed.error("Phong − true", other, true, 4),
                    ]
                )
    caption = f"{subject.name} under {name}, cut to degree {degree}"
    draw_panels(context.path("mesh.png", caption), shown)
    rows = [row for row in context.rows if row["what"] == "mesh"]
    values = {"about": subject.about, "light": name, "degree": degree, "rays": config.rays**2}
    return Table("On a mesh", rows=rows, values=values)


class Scene(NamedTuple):
    """A mesh in view, and what its true reflection is summed with."""

    mesh: geometry.Mesh
    rays: geometry.RayScene
    eye: Float[Array, " 3"]
    seen: Int[np.ndarray, " s"]  # vertices that face the eye
    light: Float[Array, "3 k"]
    halfway: int  # vectors by height, and by azimuth


def _by_rays(scene: Scene, roughness: float, specular: float) -> Float[Array, "v 3"]:
    """True radiance of the vertices in view, zero elsewhere."""
    mesh, light = scene.mesh, scene.light
    degree = harmonics.degree_of(light.shape[-1])
    vertices, normals = (np.asarray(a, np.float64) for a in (mesh.vertices, mesh.normals))
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    origins = vertices + _OFFSET * np.ptp(vertices, axis=0).max() / 2 * normals
    eyes = np.asarray(scene.eye, np.float64) - vertices
    eyes /= np.linalg.norm(eyes, axis=1, keepdims=True)
    out = np.zeros(vertices.shape, light.dtype)

    @jax.jit
    def radiance(directions, weights):
        basis = harmonics.evaluate(directions, degree)
        seen = jnp.einsum("vnk,ck->vnc", basis, light, precision="highest")
        return jnp.einsum("vn,vnc->vc", weights, seen, precision="highest")

    counts = scene.halfway, scene.halfway
    for some in np.array_split(scene.seen, -(-len(scene.seen) // _BLOCK)):
        directions, weights = incoming(eyes[some], normals[some], roughness, specular, counts)
        vertex, ray = np.nonzero(weights)
        blocked = scene.rays.occluded(origins[some][vertex], directions[vertex, ray])
        weights[vertex[blocked], ray[blocked]] = 0
        filled = _BLOCK - len(some)
        directions = np.pad(directions, ((0, filled), (0, 0), (0, 0)), mode="edge")
        weights = np.pad(weights, ((0, filled), (0, 0)))
        made = radiance(directions.astype(out.dtype), weights.astype(out.dtype))
        out[some] = np.asarray(made)[: len(some)]
    return jnp.asarray(out)
