"""Exact light of polygons at many vertices, beside sums over as many samples of their surface."""

import functools
from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from experiments.annen2004.scenes import three_lights
from experiments.runner import Column
from experiments.shared.timing import interleaved, ratio
from jaxsh import midrange

from . import page
from ._sections import Cores, Rows, Section

VERTICES = 25_000
DEGREES = (2, 4, 8)
SAMPLES = 4  # on each of a square's two triangles, and at least so many by its area
QUANTITIES = {"light": "#0072B2", "light and gradient": "#009E73"}


def timings(cores: Cores, rounds: int, dtype: str) -> Iterator[dict[str, Any]]:
    """Two rows for each degree: one square at all vertices, alone and with gradient."""
    generator = np.random.default_rng(0)
    points = generator.normal(size=(VERTICES, 3))
    points = jnp.asarray(points / np.linalg.norm(points, axis=1, keepdims=True), dtype)
    square = three_lights(3.0, 1.0)[0]
    samples = midrange.surface_samples([square], SAMPLES)
    exact = midrange.polygon_harmonics, midrange.polygon_harmonics_with_gradient
    summed = midrange.project_surface, midrange.project_surface_with_gradient
    for degree in DEGREES:
        for quantity, ours, theirs in zip(QUANTITIES, exact, summed, strict=True):
            calls = {
                "exact": _jitted(ours, square, points, degree),
                "sampled": _jitted(theirs, samples, points, degree),
            }
            times = interleaved(calls, rounds=rounds)
            first, other = (jax.tree.leaves(calls[name]())[0] for name in calls)
            yield {
                "quantity": quantity,
                "degree": degree,
                "ours_ms": times["exact"].median_ms,
                "per_arc_ns": 1e6 * times["exact"].median_ms / (4 * VERTICES),
                "sampled": ratio(times["sampled"], times["exact"]),
                "error": float(jnp.abs(other - first).max() / jnp.abs(first).max()),
                "compile_s": times["exact"].first_seconds,
            }


def _jitted(function: Callable[..., Any], light: Any, points: jax.Array, degree: int):
    return functools.partial(
        jax.jit(lambda light, points: function(light, points, degree)), light, points
    )


def draw(figure: Figure, rows: Rows) -> None:
    """Plot the time of samples over that of the exact light by degree."""
    axes = figure.subplots()
    axes.axhline(1, color="0.4", lw=1)
    for quantity, color in QUANTITIES.items():
        for cores, style in (("one", "-"), ("all", "--")):
            some = page.matching(rows, quantity=quantity, cores=cores)
            if some:
                line = zip(*((row["degree"], row["sampled"]) for row in some), strict=True)
                label = f"{quantity}, {cores} core{'s' if cores == 'all' else ''}"
                axes.plot(*line, style, color=color, marker="o", label=label)
    axes.set(xlabel="degree", ylabel="time of samples over ours", ylim=(0, None))
    axes.set_xticks(DEGREES)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)


SECTION = Section(
    name="near_light",
    title="Exact light of polygons",
    intro=f"A square at {VERTICES:,} vertices around it, without sampling "
    "(`midrange.polygon_harmonics`), beside a sum over samples of its surface "
    "(`midrange.project_surface`), as few as do.",
    columns=[
        Column("quantity", "quantity"),
        Column("degree", "degree"),
        Column("ours_ms", "exact, ms", digits=1),
        Column("per_arc_ns", "per arc, ns", digits=0),
        Column("sampled", "sampled / exact", digits=2),
        Column("error", "error of samples", digits=5),
        Column("compile_s", "first call, s", digits=2),
    ],
    timings=timings,
    draw=draw,
    note="Errors are the largest of a coefficient over the largest coefficient.",
)
