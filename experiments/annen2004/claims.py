"""What the paper claims of one sample and of eight, by the lights' distance; and an older rival."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import midrange, transfer

from ..runner import Column, Context, Table, experiment
from ..shared.lights import exact_light
from ..shared.subjects import Subject, load
from ..shared.tables import named
from . import irradiance, methods
from .plots import draw_claims
from .scenes import three_lights

NONE, FULL, TRILINEAR, HALF, INNER = (
    "k-means, no gradient",
    "k-means, gradient (eq. 15)",
    "grid, no gradient",
    "grid, half gradient",
    "inner grid, half gradient",
)


@dataclasses.dataclass(frozen=True)
class Claims:
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    distances: tuple[float, ...] = (1.2, 1.5, 2.0, 3.0)
    """of the lights from the origin, in the object's radius"""
    side: float = 1.0
    """of the square lights"""
    counts: tuple[int, ...] = (1, 2, 4, 8, 16)
    """numbers of k-means samples"""
    grids: tuple[int, ...] = (2, 3, 4)
    """samples along each side of a grid over the bounding box"""
    records: tuple[int, ...] = (8, 64, 512)
    """numbers of records of irradiance, for the rival"""
    degree: int = 4
    """of light and transfer"""
    directions: int = 1024
    """directions of the bake"""
    enough: float = 30.0
    """PSNR at which samples are said to be sufficient, dB"""

    def __post_init__(self):
        if not self.distances or min(self.distances) <= 1:
            raise ValueError("distances must be one or more numbers above 1, the object's radius")
        if list(self.distances) != sorted(self.distances):
            raise ValueError(f"distances must ascend, got {self.distances}")
        if not {1, 8} <= set(self.counts) or min(self.counts) < 1 or 2 not in self.grids:
            raise ValueError("counts must have 1 and 8 among them, and grids 2")
        if min(self.records, default=1) < 1 or self.side <= 0:
            raise ValueError("records must be at least 1, side above 0")


@experiment("annen2004.claims", x64=True)
def claims(config: Claims, context: Context) -> list[Table]:
    subject = load(context, config.mesh, config.degree, directions=config.directions)
    places = _places(config, subject, context.seed)
    for distance in context.progress(config.distances, "distances"):
        lights = three_lights(distance, config.side)
        positions = subject.mesh.vertices.astype(float)
        trial = methods.Trial.of(subject, exact_light(lights, positions, config.degree))
        for row in _rows(config, trial, lights, places):
            context.record({"distance": distance} | row)
    middle = min(config.distances, key=lambda distance: abs(distance - 2))
    for row in _rivals(config, subject, three_lights(middle, config.side), places, context.seed):
        context.record(row)
    box = _box_distance(subject, config)
    caption = (
        "PSNR, dB, by the lights' distance and the number of samples; dashed: the lights are twice "
        "as far as the bounding box"
    )
    rows = [row for row in context.rows if "distance" in row]
    draw_claims(
        context.path("claims.png", caption), rows, (NONE, FULL, TRILINEAR, HALF, INNER), box
    )
    return list(_tables(config, context.rows, subject, box, middle))


def _places(config: Claims, subject: Subject, seed: int) -> dict[str, Float[Array, "s 3"]]:
    """Points of the samples, by name; the grids' as well."""
    vertices = subject.mesh.vertices.astype(float)
    places = {
        f"k-means {count}": jnp.asarray(midrange.place_samples(vertices, count, seed=seed))
        for count in config.counts
    }
    for n in config.grids:
        places[f"grid {n}"] = methods.box_grid(subject, n).points.astype(float)
        places[f"inner {n}"] = methods.inner_grid(subject, n).points.astype(float)
    return places


def _expansions(
    places: Mapping[str, Array], lights: Sequence[midrange.Polygon], degree: int
) -> dict[str, midrange.Expansion]:
    """Exact ones of order 1, all at once."""
    every = methods.exact_samples(lights, jnp.concatenate(list(places.values())), degree)
    ends = np.cumsum([len(points) for points in places.values()])
    return {
        name: methods.take(every, slice(end - len(points), end))
        for (name, points), end in zip(places.items(), ends.tolist(), strict=True)
    }


def _rows(
    config: Claims,
    trial: methods.Trial,
    lights: Sequence[midrange.Polygon],
    places: Mapping[str, Array],
) -> Iterator[dict[str, Any]]:
    expansions = _expansions(places, lights, config.degree)
    positions = trial.subject.baked.positions
    for count in config.counts:
        samples = expansions[f"k-means {count}"]
        by_rule: tuple[tuple[str, methods.Rule], ...] = (NONE, "none"), (FULL, "full")
        for method, rule in by_rule:
            best = trial.blend(samples, rule)
            exponent = best.exponent if count > 1 else None
            yield {"method": method, "samples": count, "psnr": best.psnr, "exponent": exponent}
    kinds: tuple[tuple[str, str, methods.Rule], ...] = (
        (TRILINEAR, "grid", "none"),
        (HALF, "grid", "half"),
        (INNER, "inner", "half"),
    )
    for count in config.grids:
        grids = {
            "grid": methods.box_grid(trial.subject, count),
            "inner": methods.inner_grid(trial.subject, count),
        }
        for method, kind, rule in kinds:
            weights = grids[kind].weights(positions)
            radiance = trial.shade(expansions[f"{kind} {count}"], weights, rule)
            yield {"method": method, "samples": count**3, "psnr": trial.psnr(radiance)}
    one = methods.expand(lights, places["k-means 1"], config.degree, 3)
    for order, name in ((2, "second order"), (3, "third order")):
        radiance = trial.shade(methods.take(one, 0).truncated(order))
        yield {"method": f"{name}, one sample", "samples": 1, "psnr": trial.psnr(radiance)}


def _rivals(
    config: Claims,
    subject: Subject,
    lights: Sequence[midrange.Polygon],
    places: Mapping[str, Array],
    seed: int,
) -> Iterator[dict[str, Any]]:
    """Unshadowed: Ward & Heckbert's records against samples of the light, all exact."""
    mesh = subject.mesh
    positions, normals = mesh.vertices.astype(float), mesh.normals.astype(float)
    exact = irradiance.irradiance(lights, positions, normals) / jnp.pi
    bare = Subject(
        subject.name, mesh, transfer.bake(mesh, config.degree, shadows=False, progress=False)
    )
    cut_off = methods.Trial.of(bare, exact_light(lights, positions, config.degree))
    whole = cut_off._replace(reference=exact)
    for count in config.records:
        chosen = irradiance.record_places(np.asarray(positions), np.asarray(normals), count, seed)
        records = irradiance.make_records(lights, positions[chosen], normals[chosen])
        for gradients, name in ((False, "records, no gradients"), (True, "records, gradients")):
            best = max(
                whole.psnr(
                    irradiance.interpolate_records(
                        records, positions, normals, gradients=gradients, exponent=exponent
                    )
                    / jnp.pi
                )
                for exponent in methods.EXPONENTS
            )
            yield {"rival": f"Ward & Heckbert, {name}", "count": len(chosen), "whole": best}
    for name, samples in _expansions(places, lights, config.degree).items():
        kind, number = name.split()
        if kind == "grid":
            continue
        if kind == "inner":
            weights = methods.inner_grid(bare, int(number)).weights(bare.baked.positions)
            radiance, title = cut_off.shade(samples, weights, "half"), INNER
        else:
            radiance, title = cut_off.blend(samples, "full").radiance, FULL
        yield {
            "rival": title,
            "count": len(samples.point),
            "whole": whole.psnr(radiance),
            "cut off": cut_off.psnr(radiance),
        }
    yield {
        "rival": "the exact light of each vertex, cut off",
        "count": len(positions),
        "whole": whole.psnr(cut_off.reference),
    }


def _box_distance(subject: Subject, config: Claims) -> float:
    """From the centroid to the bounding box along the way to each light: the mean."""
    corners = [np.asarray(corner, np.float64) for corner in subject.box]
    middle, steps = np.asarray(subject.centroid, np.float64), []
    for light in three_lights(2.0, config.side):
        way = np.asarray(light.vertices).mean(axis=0)
        way /= np.linalg.norm(way)
        steps.append(np.min(np.where(way > 0, corners[1] - middle, corners[0] - middle) / way))
    return float(np.mean(steps))


def _tables(
    config: Claims, rows: list[dict[str, Any]], subject: Subject, box: float, middle: float
) -> Iterator[Table]:
    errors = [row for row in rows if "distance" in row]
    lines: dict[tuple[str, int], dict[str, Any]] = {}
    for row in errors:
        key = row["method"], row["samples"]
        line = lines.setdefault(key, {"method": key[0], "samples": key[1]})
        line[f"{row['distance']:g}"] = row["psnr"]
    lines = dict(sorted(lines.items(), key=lambda item: item[0][1]))
    distances = [Column(f"{d:g}", f"{d:g}", digits=1) for d in config.distances]
    columns = [*named("samples", "method"), *distances]
    yield Table(
        "PSNR by light distance and samples, dB",
        columns,
        list(lines.values()),
        values={
            "subject": subject,
            "exponents": ", ".join(f"{b:g}" for b in methods.EXPONENTS),
        },
    )
    yield _verdicts(config, errors, box)
    yield _goals(config, lines)
    yield _rival_table(config, [row for row in rows if "rival" in row], middle)


def _verdicts(config: Claims, errors: list[dict[str, Any]], box: float) -> Table:
    """The two sentences of §7.1, under either reading of the first."""
    one, eight, half = (
        {
            row["distance"]: row["psnr"]
            for row in errors
            if row["samples"] == samples and row["method"] == method
        }
        for samples, method in ((1, FULL), (8, FULL), (8, INNER))
    )
    enough = config.enough
    verdicts = []
    for limit, reading in (
        (box, "the light is farther than the bounding box"),
        (2 * box, "its gap to the bounding box is larger than the box's distance"),
    ):
        beyond = {d: psnr for d, psnr in one.items() if d > limit}
        verdicts.append(
            {
                "claim": f"one sample with gradient suffices where {reading} (> {limit:.2f})",
                "measured": _span(beyond),
                "holds": _held(beyond, enough),
            }
        )
    for psnrs, name in ((eight, "eq. 15"), (half, "half gradient, inner 2³ grid")):
        verdicts.append(
            {
                "claim": f"eight samples suffice ({name}), however near the light",
                "measured": _span(psnrs),
                "holds": _held(psnrs, enough),
            }
        )

    return Table("The paper's claims", rows=verdicts, values={"enough": enough, "box": box})


def _span(psnrs: dict[float, float]) -> str:
    if not psnrs:
        return "no such distance"
    return ", ".join(f"{psnr:.1f} dB at {distance:g}" for distance, psnr in psnrs.items())


def _held(psnrs: dict[float, float], enough: float) -> str:
    good = [distance for distance, psnr in psnrs.items() if psnr >= enough]
    if len(good) == len(psnrs):
        return "yes"
    return f"from {min(good):g} on" if good else "no"


def _goals(config: Claims, lines: dict[tuple[str, int], dict[str, Any]]) -> Table:
    """What was asked of the method, at each distance."""
    rows = []
    for goal, least, method, samples, less in (
        ("one + gradient, more than one", 9.0, FULL, 1, (NONE, 1)),
        ("eight + gradient (eq. 15)", 43.0, FULL, 8, None),
        ("half gradient, 2³ on the box", 49.0, HALF, 8, None),
        ("half gradient, inner 2³", 49.0, INNER, 8, None),
        ("half gradient, 4³ on the box", 65.0, HALF, 64, None),
        ("half gradient, inner 4³", 65.0, INNER, 64, None),
        ("second order from one", 42.0, "second order, one sample", 1, None),
    ):
        if (method, samples) not in lines:
            continue
        row: dict[str, Any] = {"goal": goal, "least": least}
        for distance in map("{:g}".format, config.distances):
            row[distance] = lines[method, samples][distance]
            if less is not None:
                row[distance] -= lines[less][distance]
        rows.append(row)
    distances = [Column(f"{d:g}", f"{d:g}", digits=1) for d in config.distances]
    columns = [Column("goal", "goal"), Column("least", "at least", digits=0), *distances]
    return Table("Goals", columns, rows)


def _rival_table(config: Claims, rivals: list[dict[str, Any]], middle: float) -> Table:

    return Table("Irradiance gradients, the older rival", rows=rivals, values={"middle": middle})
