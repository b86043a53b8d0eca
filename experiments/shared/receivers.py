"""Vertices that light may reach, and what they see of it: by rays, without the bake."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from jaxsh import geometry

from ..runner import Context

_CELLS = 1 << 21  # vertices × directions at a time: some 100 MB of rays


class Receivers(NamedTuple):
    """Vertices that light may reach."""

    origins: Float[np.ndarray, "v 3"]  # of rays, off the surface as the bake's are
    normals: Float[np.ndarray, "v 3"]

    @classmethod
    def of(cls, mesh: geometry.Mesh, chosen: Int[np.ndarray, " v"], ray_bias: float) -> "Receivers":
        vertices, normals = np.asarray(mesh.vertices), np.asarray(mesh.normals)
        lift = ray_bias * np.ptp(vertices, axis=0).max() / 2
        return cls(vertices[chosen] + lift * normals[chosen], normals[chosen])


def seen_cosines(
    scene: geometry.RayScene,
    receivers: Receivers,
    directions: Float[np.ndarray, "n 3"],
    context: Context,
) -> Iterator[tuple[slice, Float[np.ndarray, "part n"], Float[np.ndarray, "part n"]]]:
    """max(0, n·ω) of some vertices at a time, and the same, zero where something is in the way."""
    for part in context.progress(parts(len(receivers.normals), len(directions)), "quadrature"):
        cosines = np.maximum(receivers.normals[part] @ directions.T, 0)
        vertex, direction = np.nonzero(cosines)
        blocked = scene.occluded(
            np.take(receivers.origins[part], vertex, axis=0), np.take(directions, direction, axis=0)
        )
        seen = cosines.copy()
        seen[vertex[blocked], direction[blocked]] = 0
        yield part, cosines, seen


def parts(vertices: int, directions: int) -> list[slice]:
    """Slices of the vertices with few enough rays to hold."""
    size = max(1, _CELLS // directions)
    return [slice(start, min(start + size, vertices)) for start in range(0, vertices, size)]
