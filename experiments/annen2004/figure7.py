"""Figure 7: one sample against eight, with and without gradients, where one light hides another."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import imaging, midrange

from ..runner import Column, Context, Table, experiment
from ..shared.plots import Panel, View, draw_panels
from ..shared.subjects import Subject, load
from .dots import glass
from .methods import Trial, box_grid, take
from .overlap import overlapping, overlapping_light

_SAMPLES = 8
_WIDTH = 0.9  # of a panel, in its heights
_GAIN = 4.0  # of the errors' colors: full at ± 1/4 of white
_TOWARD = (-0.35, -1.0, 0.3)  # from the mesh to the camera


@dataclasses.dataclass(frozen=True)
class Figure7:
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    degree: int = 4
    """of light and transfer"""
    resolutions: tuple[int, ...] = (64,)
    """texels along a side of a radiance cube's face; pictures are of the first"""
    directions: int = 1024
    """directions of the bake"""
    size: int = 400
    """height of a panel, in pixels"""
    samples: int = 2
    """rays along each side of a pixel"""

    def __post_init__(self):
        if not self.resolutions or min(*self.resolutions, self.directions, self.samples) < 1:
            raise ValueError("resolutions (one or more), directions and samples must be at least 1")
        if self.size < 16:
            raise ValueError(f"size must be at least 16 pixels, got {self.size}")


class Sampled(NamedTuple):
    """Expansions of order 1 around the mean, the eight k-means samples and the 2³ grid's."""

    one: midrange.Expansion
    eight: midrange.Expansion
    grid: midrange.Expansion


class Shown(NamedTuple):
    """A rendering: the paper's letter for it, if it has one, and how it was made."""

    letter: str
    name: str
    radiance: Float[Array, "v 3"]
    exponent: float | None = None


@experiment("annen2004.figure7", x64=True)
def figure7(config: Figure7, context: Context) -> list[Table]:
    subject = load(context, config.mesh, config.degree, directions=config.directions)
    lights = overlapping()
    with context.time("reference"):
        exact = overlapping_light(lights, subject.mesh.vertices, config.degree)
        trial = Trial.of(subject, exact)
    eight = midrange.place_samples(subject.mesh.vertices, _SAMPLES, seed=context.seed)
    renderings: list[list[Shown]] = []
    for resolution in context.progress(config.resolutions, "resolutions"):
        with context.time(f"samples of {resolution}²"):
            sampled = _sample(subject, lights, jnp.asarray(eight), config.degree, resolution)
        renderings.append(list(_renderings(trial, sampled)))
        for shown in renderings[-1]:
            context.record(
                {
                    "letter": shown.letter,
                    "name": shown.name,
                    "resolution": resolution,
                    "psnr": trial.psnr(shown.radiance),
                    "exponent": shown.exponent,
                }
            )
    caption = (
        f"{subject.name}: letters as in the paper; the others it lacks. Below each its error: red "
        "where it is brighter than the reference, blue where darker; dots are the samples of (e) "
        "and (f), as in glass. The paper's red and blue lights are orange and azure here: together "
        "they are near white, and what one of them alone reaches has its color"
    )
    _draw(config, context.path("figure7.png", caption), trial, renderings[0], eight)
    return [_table(config, context.rows, subject), _verdicts(config, context.rows)]


def _sample(
    subject: Subject,
    lights: tuple[midrange.Polygon, ...],
    eight: Float[Array, "8 3"],
    degree: int,
    resolution: int,
) -> dict[str, Sampled]:
    """By the paper's gradient and by that of edges, from the same cubes."""
    points = jnp.concatenate([subject.centroid[None], eight, box_grid(subject, 2).points])
    cubes = midrange.capture(midrange.Scene(lights), points, resolution, progress=False)
    sampled = {}
    for gradient in ("surface", "edges"):
        terms = midrange.project_cube_with_gradient(cubes, degree, gradient=gradient)
        expansion = midrange.make_expansion(cubes.point, *terms)
        parts = 0, slice(1, 1 + _SAMPLES), slice(1 + _SAMPLES, None)
        sampled[gradient] = Sampled(*(take(expansion, part) for part in parts))
    return sampled


def _renderings(trial: Trial, sampled: dict[str, Sampled]) -> Iterator[Shown]:
    """All but the reference, by both gradients."""
    surface, edges = sampled["surface"], sampled["edges"]
    grid = box_grid(trial.subject, 2).weights(trial.subject.baked.positions)
    yield Shown("a", "one sample", trial.shade(surface.one.truncated(0)))
    yield Shown("b", "one, gradient", trial.shade(surface.one))
    plain, full = trial.blend(surface.eight, "none"), trial.blend(surface.eight, "full")
    yield Shown("e", "eight", plain.radiance, plain.exponent)
    yield Shown("f", "eight, gradient", full.radiance, full.exponent)
    yield Shown("", "one, edge gradient", trial.shade(edges.one))
    full = trial.blend(edges.eight, "full")
    yield Shown("", "eight, edge gradient", full.radiance, full.exponent)
    yield Shown("", "2³ grid", trial.shade(surface.grid, grid, "none"))
    yield Shown("", "2³ grid, half gradient", trial.shade(surface.grid, grid, "half"))
    yield Shown("", "2³ grid, half edge gradient", trial.shade(edges.grid, grid, "half"))


def _draw(
    config: Figure7, path: Path, trial: Trial, renderings: list[Shown], eight: np.ndarray
) -> None:
    mesh, width = trial.subject.mesh, round(_WIDTH * config.size)
    camera = imaging.Camera.facing(mesh, width=width, height=config.size, toward=_TOWARD)
    view = View.of(mesh, camera, trial.reference, samples=config.samples)

    def error(shown: Shown) -> Panel:
        return view.error("its error", shown.radiance, trial.reference, _GAIN)

    panels = [Panel(view.shown(x.radiance), _title(x, trial)) for x in renderings]
    c = Panel(view.shown(trial.reference), "(c) reference")
    d = Panel(glass(view, camera, eight, samples=config.samples), "(d) eight samples")
    order = (0, 1, 4, 2, 3), (5, 6, 7, 8)  # with the paper's letters first
    above, below = ([panels[i] for i in line] for line in order)
    first, last = ([error(renderings[i]) for i in line] for line in order)
    draw_panels(path, [above, first, [*below, c], [*last, d]])


def _title(shown: Shown, trial: Trial) -> str:
    letter = f"({shown.letter}) " if shown.letter else ""
    return f"{letter}{shown.name}, {trial.psnr(shown.radiance):.1f} dB"


def _table(config: Figure7, rows: list[dict[str, Any]], subject: Subject) -> Table:
    lines: dict[str, dict[str, Any]] = {}
    for row in rows:
        line = lines.setdefault(row["name"], {key: row[key] for key in ("letter", "name")})
        line[f"psnr {row['resolution']}"] = row["psnr"]
        line[f"exponent {row['resolution']}"] = row["exponent"]
    columns = [Column("letter", "figure 7"), Column("name", "method")]
    for n in config.resolutions:
        columns.append(Column(f"psnr {n}", f"PSNR, cubes of {n}², dB", digits=1))
    columns.append(Column(f"exponent {config.resolutions[0]}", "b of eq. 16", digits=0))
    return Table(
        "One sample against eight, where one light hides another",
        columns,
        list(lines.values()),
        values={"subject": subject},
    )


def _verdicts(config: Figure7, rows: list[dict[str, Any]]) -> Table:
    """What the paper says of its figure, held against the table."""
    by = {row["name"]: row["psnr"] for row in rows if row["resolution"] == config.resolutions[0]}
    order = [by[name] for name in ("one sample", "one, gradient", "eight, gradient")]
    lines = [
        (
            "(a) < (b) < (f)",
            f"{order[0]:.1f} < {order[1]:.1f} < {order[2]:.1f} dB",
            order == sorted(order),
        ),
        (
            '(b) "does similarly well as" (e)',
            f"{by['one, gradient']:.1f} and {by['eight']:.1f} dB",
            abs(by["one, gradient"] - by["eight"]) < 3,
        ),
        (
            '(f) is "virtually the same result as the reference image"',
            f"{by['eight, gradient']:.1f} dB",
            by["eight, gradient"] >= 40,
        ),
        (
            "a trilinear 2³ grid without gradients, which the paper lacks, does worse than (f)",
            f"{by['2³ grid']:.1f} and {by['eight, gradient']:.1f} dB",
            by["2³ grid"] < by["eight, gradient"],
        ),
    ]
    verdicts = [
        {"claim": claim, "measured": measured, "holds": "yes" if holds else "no"}
        for claim, measured, holds in lines
    ]

    return Table("What the paper says of it", rows=verdicts)
