"""Ringing: what each window costs and leaves, by what is made of the light.

First everywhere on the sphere, for surfaces that see all of their hemisphere or lobe; then on a
mesh, with the cosine and with shadows. Both with the light as it is and with its bright sources
split off, which are then shaded by rays.
"""

import dataclasses
import functools
import statistics
from collections.abc import Iterator
from typing import Any

import jax
import numpy as np
from jaxtyping import Array, Float

from jaxsh import harmonics, sphere

from ..runner import Column, Context, Table, experiment
from .ringing_lights import SUNNY, WINDOWS, Need, Probe, sunny
from .ringing_mesh import shade
from .ringing_pictures import draw_lights, draw_meshes

_REFERENCE = 48  # degree: of an impulse's irradiance and lobes up to 128 all but 1e-3
_GRID = 56  # rows of the directions looked at


@dataclasses.dataclass(frozen=True)
class Ringing:
    environments: tuple[str, ...] = ()
    """environments by name, "sunny" among them; none means all that the data has, and "sunny" """
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    degrees: tuple[int, ...] = (2, 4, 6, 10)
    """degrees of the light"""
    exponents: tuple[float, ...] = (8.0, 32.0, 128.0)
    """exponents of the glossy lobes"""
    count: int = 2
    """sources that are split off at most"""
    directions: int = 1024
    """directions of the bake"""
    vertices: int = 400
    """vertices of the mesh that are looked at; 0 leaves the mesh out"""
    size: int = 400
    """height and width of the pictures of the mesh, in pixels"""

    def __post_init__(self):
        if not self.degrees or not 0 <= min(self.degrees) <= max(self.degrees) <= _REFERENCE / 2:
            raise ValueError(f"degrees must be one or more numbers from 0 to {_REFERENCE // 2}")
        if not self.exponents or min(self.exponents) <= 0:
            raise ValueError("exponents must be one or more numbers above 0")
        for name in ("count", "directions", "size"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, got {getattr(self, name)}")
        if self.vertices < 0:
            raise ValueError(f"vertices must be at least 0, got {self.vertices}")


@experiment("ringing")
def run(config: Ringing, context: Context) -> list[Table]:
    needs = [Need("irradiance", None), *(Need(f"lobe {k:g}", k) for k in config.exponents)]
    probes = [
        Probe.of(name, sunny() if name == SUNNY else context.data.environment(name), config.count)
        for name in config.environments or (*context.data.environments(), SUNNY)
    ]
    taken = {}
    for probe in context.progress(probes, "environments"):
        taken[probe.name] = probe.taken
        with context.time(f"{probe.name}: everywhere"):
            for row in _everywhere(config, needs, probe):
                context.record(row)
    degree = max(config.degrees)
    tables = list(_tables(config, context, needs, taken))
    if config.vertices:
        name = config.mesh or context.data.meshes()[0]
        shaded = shade(
            context,
            name,
            degree,
            probes,
            needs,
            directions=config.directions,
            vertices=config.vertices,
        )
        for row in shaded.rows:
            context.record(row)
        about = f"{name}, {len(shaded.mesh.vertices):,} vertices"
        tables.append(Table("On a mesh", rows=_over_probes(shaded.rows), values={"about": about}))
        caption = (
            f"{name} under {probes[-1].name} at degree {degree}, diffuse above, a lobe of exponent "
            f"{shaded.exponent:g} below; hatched where negative"
        )
        draw_meshes(context.path("mesh.png", caption), shaded, size=config.size)
    caption = f"{probes[-1].name} at degree {degree}; hatched where negative"
    draw_lights(context.path("light.png", caption), probes[-1].image, probes[-1].rest, degree)
    return tables


@functools.cache
def _grid(degree: int) -> tuple[Float[Array, "n k"], Float[np.ndarray, " n"]]:
    quadrature = sphere.gauss_legendre(_GRID)
    basis = jax.jit(functools.partial(harmonics.evaluate, degree=degree))(quadrature.directions)
    return basis, np.asarray(quadrature.weights)


def _values(function: Float[Array, "3 k"]) -> Float[np.ndarray, "3 n"]:
    basis, _ = _grid(_REFERENCE)
    return np.asarray(function) @ np.asarray(basis)[:, : function.shape[-1]].T


def _everywhere(config: Ringing, needs: list[Need], probe: Probe) -> Iterator[dict[str, Any]]:
    """By degree, need and window, with and without the sources: against a far higher degree."""
    project = jax.jit(sphere.project_lat_long, static_argnames="degree")
    whole, rest = (project(image, degree=_REFERENCE) for image in (probe.image, probe.rest))
    _, weights = _grid(_REFERENCE)
    for need in needs:
        exact, exact_rest = (_values(need.of(light)) for light in (whole, rest))
        for degree in config.degrees:
            for split, full in ((False, whole), (True, rest)):
                light = full[:, : harmonics.num_coefficients(degree)]
                # Of the sources themselves what is exact, which rays give.
                beside = exact - exact_rest if split else np.zeros_like(exact)
                for kind in WINDOWS:
                    window = need.window(light, kind)
                    made = _values(need.of(light * window[None])) + beside
                    yield {
                        "environment": probe.name,
                        "need": need.name,
                        "degree": degree,
                        "split": split,
                        "window": kind,
                        **_measures(made, exact, weights),
                    }


def _measures(
    made: Float[np.ndarray, "3 n"], exact: Float[np.ndarray, "3 n"], weights: np.ndarray
) -> dict[str, float]:
    """In percent: length of the RGB error of the mean length; ∫ max(0, -f) of ∫ f; the lowest
    value of a channel's mean."""
    error, length = np.linalg.norm(made - exact, axis=0), np.linalg.norm(exact, axis=0)
    mean = made @ weights / weights.sum()
    return {
        "error": 100 * float(error @ weights / (length @ weights)),
        "negative": 100 * float(np.sum(np.maximum(-made, 0) @ weights) / np.sum(made @ weights)),
        "lowest": 100 * float((made.min(axis=1) / mean).min()),
    }


def _tables(
    config: Ringing, context: Context, needs: list[Need], taken: dict[str, float]
) -> Iterator[Table]:
    """The mean error over the environments and, where it is not zero, the worst negative share."""
    columns = [Column("need", "made of it"), Column("degree", "degree")]
    columns += [Column(kind, kind) for kind in WINDOWS]
    said = ", ".join(f"{name} {share:.0f} %" for name, share in taken.items())
    for title, split in (("The light as it is", False), ("Bright sources split off", True)):
        rows = []
        for need in needs:
            for degree in config.degrees:
                row: dict[str, Any] = {"need": need.name, "degree": degree}
                for kind in WINDOWS:
                    found = [
                        r
                        for r in context.rows
                        if (r["need"], r["degree"], r["split"], r["window"])
                        == (need.name, degree, split, kind)
                    ]
                    row[kind] = _cell(found)
                rows.append(row)
        yield Table(title, columns, rows, values={"taken": said})


def _cell(rows: list[dict[str, Any]]) -> str:
    error = statistics.mean(row["error"] for row in rows)
    negative = max(row["negative"] for row in rows)
    return f"{error:.1f}" + (f" ({negative:.1f})" if negative >= 0.05 else "")


def _over_probes(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The mean error, the largest share below zero and the lowest value, over all environments."""
    keys = ("need", "shadows", "split", "window")
    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in keys), []).append(row)
    return [
        dict(zip(keys, values, strict=True))
        | {
            "error": statistics.mean(row["error"] for row in group),
            "negative": max(row["negative"] for row in group),
            "lowest": min(row["lowest"] for row in group),
        }
        for values, group in groups.items()
    ]
