"""Seconds of a first call: trace, compile and run, for arrays of few rows."""

import statistics
import time
from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp

from experiments.runner import Column
from jaxsh import geometry, harmonics, midrange, transfer

from ._sections import Cores, Section

# Small enough that compiling is all that counts.
_ROWS = 2


def timings(cores: Cores, rounds: int, dtype: str) -> Iterator[dict[str, Any]]:
    """One row per call: medians over the rounds of the process's CPU time and of wall time.

    Each round starts with empty caches, and without the persistent one.
    """
    jax.config.update("jax_enable_compilation_cache", False)
    calls = _calls()
    rounds = min(rounds, 3)
    for name, call in calls.items():
        jax.block_until_ready(call())  # what is made once per process: tables, imports
        cpu, wall = zip(*(_first(call) for _ in range(rounds)), strict=True)
        yield {
            "call": name,
            "cpu_s": statistics.median(cpu),
            "wall_s": statistics.median(wall),
        }


def _first(call: Callable[[], Any]) -> tuple[float, float]:
    jax.clear_caches()
    start = time.process_time(), time.perf_counter()
    jax.block_until_ready(call())
    return time.process_time() - start[0], time.perf_counter() - start[1]


def _calls() -> dict[str, Callable[[], Any]]:
    points = jnp.asarray([[0.0, 0, 0], [0.1, 0.2, 0.3]])[:_ROWS]
    corners = jnp.asarray([[1.0, -1, 2], [-1, -1, 2], [-1, 1, 2], [1, 1, 2]])
    light = midrange.Polygon(corners, jnp.ones(3))
    baked = transfer.bake(geometry.knot(300), 4, directions=64, progress=False)
    material = transfer.Material(0.5, 0.5, 32.0)
    distant, eye = jnp.ones((3, 25)), jnp.asarray([0.0, 0, 5])

    def backward(points):
        return jax.grad(lambda p: harmonics.evaluate(p, 10).sum())(points)

    return {
        "evaluate, degree 10": lambda: harmonics.evaluate(points, 10),
        "its reverse mode": lambda: backward(points + 1),
        "polygon_harmonics, degree 4": lambda: midrange.polygon_harmonics(light, points, 4),
        "polygon_harmonics_with_gradient, degree 4": (
            lambda: midrange.polygon_harmonics_with_gradient(light, points, 4)
        ),
        "shade_glossy, degree 4": lambda: transfer.shade_glossy(distant, baked, eye, material),
    }


SECTION = Section(
    name="first_call",
    title="First calls",
    intro="Seconds to trace, compile and run, for two rows, on one core.",
    columns=[
        Column("call", "call"),
        Column("cpu_s", "CPU, s", digits=2),
        Column("wall_s", "wall, s", digits=2),
    ],
    timings=timings,
    cores=("one",),
    keeps_memory=False,
)
