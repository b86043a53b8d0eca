"""Small bright sources split off a probe and shaded by rays: what that is worth, and why.

Harmonics of the whole probe, and of what `sphere.split_sun` leaves of it beside the suns by
`transfer.shade_sun`, are held against sums over all pixels of the whole probe.
"""

import dataclasses
import math
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
from jaxtyping import Float

from jaxsh import harmonics, imaging, sphere, transfer

from ..runner import Column, Context, Table, experiment
from .bake import OFFSET, relative_error
from .reference import Estimate
from .sharp_pictures import draw_comparison, draw_scan
from .sharp_reference import (
    BY_COEFFICIENTS,
    VARIANTS,
    Key,
    Light,
    Subject,
    bake,
    by_drawn_directions,
    facing,
    references,
)

_SCANS = {
    "threshold": (2.0, 4.0, 8.0, 16.0, 48.0),
    "largest": (0.01, 0.03, 0.1, 0.3, 1.0),
}


@dataclasses.dataclass(frozen=True)
class Sharp:
    meshes: tuple[str, ...] = ()
    """meshes by name, "knot" among them; none means the first that the data has"""
    environments: tuple[str, ...] = ()
    """environments by name, "studio" among them; none means all that the data has"""
    degrees: tuple[int, ...] = (2, 4, 6, 10)
    """degrees of light and transfer"""
    counts: tuple[int, ...] = (1, 4, 8)
    """how many suns are split off at most"""
    scan_counts: tuple[int, ...] = (1, 4, 8)
    """the same where thresholds are tried; none tries none"""
    exponents: tuple[float, ...] = (8.0, 32.0, 128.0)
    """of the glossy lobes"""
    rays: int = 64
    """to each sun"""
    directions: int = 2048
    """directions of the bake"""
    vertices: int = 512
    """vertices of each mesh that have a reference"""
    size: int = 480
    """height of the pictures, in pixels; 0 draws none"""
    pictures: int = 1
    """how many of the probes are drawn, on the first mesh"""
    picture_directions: int = 2048
    """directions of the pictures' reference, drawn by the probe's light"""

    def __post_init__(self):
        if not self.degrees or min(self.degrees) < 0:
            raise ValueError("degrees must be one or more numbers >= 0")
        if not self.counts or min(self.counts) < 1 or min(self.scan_counts, default=1) < 1:
            raise ValueError("counts must be one or more numbers >= 1")
        for name in ("rays", "directions", "vertices", "picture_directions"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, got {getattr(self, name)}")


@experiment("sharp")
def run(config: Sharp, context: Context) -> list[Table]:
    degree = max(config.degrees)
    probes = {
        name: _environment(context, name)
        for name in config.environments or context.data.environments()
    }
    for number, name in enumerate(config.meshes or context.data.meshes()[:1]):
        with context.time(f"{name}: bake"):
            subject = bake(
                context,
                name,
                degree,
                directions=config.directions,
                vertices=config.vertices,
                size=max(16, config.size),
            )
        lights = {
            (probe, count): _light(config, image, degree, count)
            for probe, image in probes.items()
            for count in (0, *config.counts)
        }
        with context.time(f"{name}: reference"):
            found = references(context, subject, lights, (0.0, *config.exponents))
        for (probe, count), light in lights.items():
            for row in _errors(config, subject, light, found, probe, count):
                context.record(row)
        with context.time(f"{name}: thresholds"):
            for row in _scan(config, subject, probes, found, degree):
                context.record(row)
        if config.size and not number:
            _draw(config, context, subject, probes, lights)
    scanned = [row for row in context.rows if "scan" in row]
    if scanned:
        draw_scan(context.path("thresholds.png", "error by what counts as a sun"), scanned)
    return list(_tables(config, context))


def _environment(context: Context, name: str) -> Float[np.ndarray, "h w 3"]:
    known = context.data.environments()
    made = name == "studio" and name not in known
    return np.asarray(imaging.studio() if made else context.data.environment(name))


def _light(
    config: Sharp, image: Float[np.ndarray, "h w 3"], degree: int, count: int, **options: float
) -> Light:
    suns, rest = None, image
    if count:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a probe without suns has a line that says so
            suns, rest = sphere.split_sun(image, count, rays=config.rays, **options)
    rest = np.asarray(rest)
    return Light(rest, np.asarray(sphere.project_lat_long(rest, degree)), suns)


def _suns_light(
    config: Sharp,
    subject: Subject,
    points: transfer.Transfer,
    suns: sphere.Suns | None,
    exponents: tuple[float, ...],
    rays: int | None = None,
) -> dict[tuple[str, float], np.ndarray]:
    """What the suns send to some vertices, by variant and exponent (0: irradiance)."""
    if suns is None or not len(suns.solid_angle):
        none = np.zeros((points.num_points, 3), np.float32)
        return {(variant, exponent): none for variant in VARIANTS for exponent in exponents}
    rays = config.rays if rays is None else rays
    seen = transfer.sun_visibility(suns, points, subject.scene, rays=rays, ray_bias=OFFSET)
    sent = {}
    for variant in VARIANTS:
        light = {"scene": seen} if variant == "shadowed" else {"shadows": False}
        for exponent in exponents:
            how: dict[str, Any] = {"albedo": math.pi}
            if exponent:
                material = transfer.Material(0.0, 1.0, exponent)
                how = {"material": material, "eye": subject.camera.position}
            sent[variant, exponent] = np.asarray(transfer.shade_sun(suns, points, **light, **how))
    return sent


def _shaded(
    subject: Subject,
    points: transfer.Transfer,
    light: Float[np.ndarray, "3 k"],
    exponent: float,
) -> np.ndarray:
    if not exponent:
        return np.asarray(transfer.shade_diffuse(light, points, math.pi))
    material = transfer.Material(0.0, 1.0, exponent)
    return np.asarray(transfer.shade_glossy(light, points, subject.camera.position, material))


def _errors(
    config: Sharp,
    subject: Subject,
    light: Light,
    found: dict[Key, Estimate],
    probe: str,
    count: int,
) -> Iterator[dict[str, Any]]:
    """One row by degree and variant, with the parts of the error at the highest degree."""
    exponents = (0.0, *config.exponents)
    suns = _suns_light(config, subject, subject.chosen["shadowed"], light.suns, exponents)
    few = min(16, config.rays)
    sixteen = _suns_light(config, subject, subject.chosen["shadowed"], light.suns, (0.0,), rays=few)
    plain = light.suns and dataclasses.replace(light.suns, shape=None)
    discs = _suns_light(config, subject, subject.chosen["shadowed"], plain, (0.0,))
    front = facing(subject)
    for variant in VARIANTS:
        truth = {e: found[probe, 0, variant, e] for e in exponents}
        for degree in config.degrees:
            cut = light.harmonics[:, : harmonics.num_coefficients(degree)]
            row: dict[str, Any] = {
                "mesh": subject.name,
                "environment": probe,
                "count": count,
                "suns": 0 if light.suns is None else len(light.suns.solid_angle),
                "variant": variant,
                "degree": degree,
                "reference_error": 100 * truth[0.0].error,
            }
            for exponent in exponents:
                got = _shaded(subject, subject.chosen[variant], cut, exponent)
                got, true = got + suns[variant, exponent], truth[exponent].value
                if not exponent:
                    row["error"] = relative_error(got, true)
                    continue
                row[f"glossy {exponent:g}"] = relative_error(got[front], true[front])
                row[f"negative {exponent:g}"] = 100 * float((got[front] < 0).mean())
            if degree == max(config.degrees):
                row |= _parts(found, suns, sixteen, probe, count, variant)
                rest = _shaded(subject, subject.chosen[variant], cut, 0.0)
                exact = found[probe, count, variant, BY_COEFFICIENTS].value
                scale = 100 / np.linalg.norm(truth[0.0].value)
                row["bake"] = scale * float(np.linalg.norm(rest - exact))
                for name, other in (("few_rays", sixteen), ("discs", discs)):
                    got = rest + other[variant, 0.0]
                    row[f"error_{name}"] = relative_error(got, truth[0.0].value)
            yield row


def _parts(found, suns, sixteen, probe, count, variant) -> dict[str, float]:
    """Parts of the irradiance's error, each in percent of all light."""
    whole, rest, exact = (
        found[probe, c, variant, e].value
        for c, e in ((0, 0.0), (count, 0.0), (count, BY_COEFFICIENTS))
    )
    scale = 100 / float(np.linalg.norm(whole))
    return {
        "sun_light": scale * float(np.linalg.norm(whole - rest)),
        "rays": scale * float(np.linalg.norm(suns[variant, 0.0] - (whole - rest))),
        "few_rays": scale * float(np.linalg.norm(sixteen[variant, 0.0] - (whole - rest))),
        "cut": scale * float(np.linalg.norm(exact - rest)),
    }


def _scan(
    config: Sharp,
    subject: Subject,
    probes: dict[str, np.ndarray],
    found: dict[Key, Estimate],
    degree: int,
) -> Iterator[dict[str, Any]]:
    """The shadowed irradiance's error by what counts as a sun."""
    points = subject.chosen["shadowed"]
    for option, values in _SCANS.items() if config.scan_counts else ():
        for value in values:
            for probe, image in probes.items():
                for count in config.scan_counts:
                    light = _light(config, image, degree, count, **{option: value})
                    suns = _suns_light(config, subject, points, light.suns, (0.0,))
                    got = _shaded(subject, points, light.harmonics, 0.0)
                    got = got + suns["shadowed", 0.0]
                    true = found[probe, 0, "shadowed", 0.0].value
                    yield {
                        "mesh": subject.name,
                        "environment": probe,
                        "scan": option,
                        "value": value,
                        "scan_count": count,
                        "scan_error": relative_error(got, true),
                    }


def _draw(
    config: Sharp,
    context: Context,
    subject: Subject,
    probes: dict[str, np.ndarray],
    lights: dict[tuple[str, int], Light],
) -> None:
    caption = (
        "harmonics alone, harmonics beside suns, all pixels of the probe; above a matte surface, "
        "below a glossy one. Without suns black and colored patches are light below zero"
    )
    raster = imaging.rasterize(subject.mesh, subject.camera, samples=2)
    for probe, image in list(probes.items())[: config.pictures]:
        columns = {"harmonics alone": lights[probe, 0]}
        for count in config.counts:
            columns[f"{count} sun{'s' * (count > 1)}"] = lights[probe, count]
        path = context.path(f"{probe}.png", f"{subject.name} under {probe}: {caption}")
        exponent = config.exponents[len(config.exponents) // 2]
        shaded = {}
        for title, light in columns.items():
            suns = _suns_light(config, subject, subject.whole, light.suns, (0.0, exponent))
            shaded[title] = [
                _shaded(subject, subject.whole, light.harmonics, e) + suns["shadowed", e]
                for e in (0.0, exponent)
            ]
        with context.time(f"{probe}: the picture's reference"):
            shaded["all pixels"] = by_drawn_directions(
                context, subject, image, exponent, config.picture_directions
            )
        draw_comparison(path, raster, shaded)


def _tables(config: Sharp, context: Context) -> Iterator[Table]:
    rows = [row for row in context.rows if "variant" in row]
    yield _by_degree(config, rows)
    top = [row for row in rows if row["degree"] == max(config.degrees)]
    yield _glossy(config, top)
    yield Table(
        "What is left",
        rows=[row for row in top if row["variant"] == "shadowed"],
        values={"degree": max(config.degrees)},
    )
    if config.scan_counts:
        yield _scanned(context)


def _by_degree(config: Sharp, rows: list[dict[str, Any]]) -> Table:
    about = ("mesh", "environment", "variant", "count")
    lines: dict[tuple[Any, ...], dict[str, Any]] = {}
    for row in rows:
        line = lines.setdefault(tuple(row[k] for k in about), {k: row[k] for k in about})
        line |= {f"error {row['degree']}": row["error"], "suns": row["suns"]}
        line["reference"] = row["reference_error"]
    columns = [
        *(Column(name, name) for name in ("mesh", "environment", "variant")),
        Column("count", "suns at most"),
        Column("suns", "suns"),
        *(Column(f"error {d}", f"degree {d}: error, %", digits=2) for d in config.degrees),
        Column("reference", "reference's own, %", digits=2),
    ]
    return Table("Irradiance by degree and suns", columns, list(lines.values()))


def _glossy(config: Sharp, rows: list[dict[str, Any]]) -> Table:
    columns = [
        *(Column(name, name) for name in ("mesh", "environment", "variant")),
        Column("count", "suns at most"),
        *(Column(f"glossy {e:g}", f"exponent {e:g}: error, %", digits=1) for e in config.exponents),
        *(Column(f"negative {e:g}", f"{e:g}: negative, %", digits=1) for e in config.exponents),
    ]
    return Table("Glossy light", columns, rows, values={"degree": max(config.degrees)})


def _scanned(context: Context) -> Table:
    lines: dict[tuple[str, float], list[float]] = {}
    for row in context.rows:
        if "scan" in row:
            lines.setdefault((row["scan"], row["value"]), []).append(row["scan_error"])
    rows = [
        {"option": option, "value": value, "mean": np.mean(errors), "worst": np.max(errors)}
        for (option, value), errors in lines.items()
    ]
    return Table("What counts as a sun", rows=rows)
