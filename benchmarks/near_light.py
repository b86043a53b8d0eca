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
from jaxsh import harmonics, midrange

from . import page
from ._sections import Cores, Rows, Section

VERTICES = 25_000
DEGREES = (2, 4, 8)
SAMPLES = 4  # on each of the square's two triangles
LIGHT, GRADIENT = "light", "light and gradient"


def timings(cores: Cores, rounds: int, dtype: str) -> Iterator[dict[str, Any]]:
    """Two rows for each degree: one square at all vertices, alone and with gradient."""
    generator = np.random.default_rng(0)
    points = generator.normal(size=(VERTICES, 3))
    points = jnp.asarray(points / np.linalg.norm(points, axis=1, keepdims=True), dtype)
    square = three_lights(3.0, 1.0)[0]
    samples = midrange.surface_samples([square], SAMPLES)
    for degree in DEGREES:
        light = _jitted(midrange.polygon_harmonics, square, points, degree)
        summed = _jitted(_sum, samples, points, degree)
        with_gradient = _jitted(midrange.polygon_harmonics_with_gradient, square, points, degree)
        calls = {LIGHT: light, "sampled": summed, GRADIENT: with_gradient}
        times = interleaved(calls, rounds=rounds)
        exact, other = light(), summed()
        rival = {
            "sampled": ratio(times["sampled"], times[LIGHT]),
            "error": float(jnp.abs(other - exact).max() / jnp.abs(exact).max()),
        }
        for quantity in (LIGHT, GRADIENT):
            row = {
                "quantity": quantity,
                "degree": degree,
                "ours_ms": times[quantity].median_ms,
                "per_arc_ns": 1e6 * times[quantity].median_ms / (4 * VERTICES),
                "compile_s": times[quantity].first_seconds,
            }
            yield row | rival if quantity == LIGHT else row


def _sum(samples: midrange.SurfaceSamples, points: jax.Array, degree: int):
    """Coefficients (N, 3, K): the basis at all points, sample by sample."""
    total = jnp.zeros(())
    for place, normal, area in zip(samples.points, samples.normals, samples.areas, strict=True):
        s = place - points
        size = area * jnp.maximum(-(s @ normal), 0) / jnp.sum(s * s, axis=1) ** 1.5
        total += size[None] * harmonics.evaluate(s, degree, axis=0)
    return samples.radiance[0][None, :, None] * total.T[:, None]  # one emitter, one radiance


def _jitted(function: Callable[..., Any], light: Any, points: jax.Array, degree: int):
    return functools.partial(
        jax.jit(lambda light, points: function(light, points, degree)), light, points
    )


def draw(figure: Figure, rows: Rows) -> None:
    """Plot the time of the exact light by degree, and that of samples over it."""
    left, right = figure.subplots(1, 2)
    for cores, style in (("one", "-"), ("all", "--")):
        label = f"{cores} core{'s' if cores == 'all' else ''}"
        for quantity, color in ((LIGHT, "#0072B2"), (GRADIENT, "#009E73")):
            some = page.matching(rows, quantity=quantity, cores=cores)
            if some:
                degrees = [row["degree"] for row in some]
                line = {"color": color, "marker": "o", "label": f"{quantity}, {label}"}
                left.plot(degrees, [row["ours_ms"] for row in some], style, **line)
                if quantity == LIGHT:
                    right.plot(degrees, [row["sampled"] for row in some], style, **line)
    right.axhline(1, color="0.4", lw=1)
    left.set(xlabel="degree", ylabel="exact, ms", ylim=(0, None))
    right.set(xlabel="degree", ylabel="time of 8 samples over the exact light's", ylim=(0, None))
    for axes in (left, right):
        axes.set_xticks(DEGREES)
        axes.grid(alpha=0.3)
        axes.legend(frameon=False)


SECTION = Section(
    name="near_light",
    title="Exact light of polygons",
    intro=f"A square at {VERTICES:,} vertices around it, without sampling "
    "(`midrange.polygon_harmonics`), beside the least that a sum over samples takes: the basis "
    "towards 8 points of its surface, whose error stands beside.",
    columns=[
        Column("quantity", "quantity"),
        Column("degree", "degree"),
        Column("ours_ms", "exact, ms", digits=1),
        Column("per_arc_ns", "per arc, ns", digits=0),
        Column("sampled", "sampled / exact", digits=2),
        Column("error", "error of 8 samples", digits=5),
        Column("compile_s", "first call, s", digits=2),
    ],
    timings=timings,
    draw=draw,
    note="Errors are the largest of a coefficient over the largest coefficient.",
)
