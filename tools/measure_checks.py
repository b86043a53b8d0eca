"""What looking at an argument's values adds to a call: ``python tools/measure_checks.py``."""

import statistics
import time
from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsh import geometry, transfer
from jaxsh._core import checks

_VERTICES, _DEGREE, _PAIRS = 20_000, 4, 2_000


def timings() -> Iterator[tuple[str, float, float, float]]:
    """Of each call its name, its microseconds, those that the checks add, and by how many percent.

    The same call with the checks and without them, in turns; medians over the pairs.
    """
    mesh = geometry.knot(_VERTICES)
    baked = transfer.unshadowed(mesh.vertices, mesh.normals, _DEGREE)
    light = np.ones((3, (_DEGREE + 1) ** 2), np.float32)
    albedo = jnp.asarray(0.5)
    held = jnp.asarray(light)
    yield "light of the last frame", *_added(lambda: transfer.shade_diffuse(held, baked, albedo))
    yield "a new light", *_added(lambda: transfer.shade_diffuse(held + 0, baked, albedo))
    yield "a new light in NumPy", *_added(lambda: transfer.shade_diffuse(light, baked, albedo))


def _added(call: Callable[[], Any]) -> tuple[float, float, float]:
    look = checks.check_finite

    def timed(check: Callable[..., None]) -> float:
        checks.check_finite = check
        start = time.perf_counter()
        jax.block_until_ready(call())
        return 1e6 * (time.perf_counter() - start)

    try:
        with_checks, added = [], []
        for number in range(_PAIRS + 10):
            ways = [(True, look), (False, lambda *_, **__: None)]
            # Whatever comes first finds the caches as the last pair left them: take turns.
            took = {kind: timed(check) for kind, check in ways[:: 1 if number % 2 else -1]}
            if number >= 10:  # compiled, and warm
                with_checks.append(took[True])
                added.append(took[True] - took[False])
    finally:
        checks.check_finite = look
    return (
        statistics.median(with_checks),
        statistics.median(added),
        100 * statistics.median(added) / statistics.median(with_checks),
    )


if __name__ == "__main__":
    print(f"shade_diffuse, {_VERTICES:,} vertices, degree {_DEGREE}, float32, {jax.devices()[0]}")
    for name, microseconds, more, percent in timings():
        print(
            f"{name:25s} {microseconds:7.0f} µs, of which checks {more:5.1f} µs = {percent:.1f} %"
        )
