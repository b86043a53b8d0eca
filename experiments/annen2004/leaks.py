"""Light that leaks through walls where samples stand on both sides of them."""

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxsh import geometry, midrange

from ..runner import Context, Table, experiment
from ..shared.lights import rectangle
from ..shared.timing import fastest

_SHARPNESS = 50  # of the cosine by which Majercik et al. filter distances


@dataclasses.dataclass(frozen=True)
class Config:
    half: float = 0.4
    """half of the box's side; samples lie in a cube of side 2"""
    grids: tuple[int, ...] = (9, 5)
    """samples along each axis"""
    resolution: int = 16
    """of the cubes and of the maps of distances"""
    positions: int = 2000
    """inside the box, and as many outside"""
    degree: int = 2
    """of the light"""
    rounds: int = 3
    """in which all take turns, to time them"""

    def __post_init__(self):
        if not 0 < self.half < 1:
            raise ValueError("half must be between 0 and 1")
        if not self.grids or min(self.grids) < 2:
            raise ValueError("grids must be at least 2")
        if min(self.resolution, self.positions, self.rounds) < 1 or self.degree < 0:
            raise ValueError("resolution, positions and rounds must be at least 1, degree 0")


@experiment("annen2004.leaks")
def leaks(config: Config, context: Context) -> list[Table]:
    """A lamp above a closed box: light at places inside, which is none, and outside."""
    lamp = rectangle((0, 0, 1.6), (0, 0, 0), (2, 1), (1, 1, 1))
    scene = midrange.Scene([lamp], [_box(config.half)])
    rng = np.random.default_rng(context.seed)
    inside = rng.uniform(-config.half, config.half, (config.positions, 3)) * 0.98
    outside = rng.uniform(-1, 1, (4 * config.positions, 3))
    outside = outside[(np.abs(outside) > 1.02 * config.half).any(axis=1)][: config.positions]
    inside, outside = (points.astype(np.float32) for points in (inside, outside))
    with context.time("light outside"):
        exact = _light(scene, outside, config)
    for count in context.progress(list(config.grids), "grids"):
        grid = midrange.Grid(-np.ones(3, np.float32), np.ones(3, np.float32), (count, count, count))
        cubes = midrange.capture(scene, grid.points, config.resolution, progress=False)
        samples = midrange.make_expansion(
            grid.points, *midrange.project_cube_with_gradient(cubes, config.degree)
        )
        ways = dict(_ways(cubes, grid, config.resolution))
        calls = {name: lambda way=way: way(outside).values for name, way in ways.items()}
        seconds = fastest(calls, rounds=config.rounds)
        for name, way in ways.items():
            within = midrange.interpolate(samples, way(inside), inside)
            error = midrange.interpolate(samples, way(outside), outside) - exact
            context.record(
                {
                    "samples": count,
                    "weights": name,
                    "leak": float(jnp.abs(within[:, :, 0]).max()),
                    "mean_leak": float(jnp.abs(within[:, :, 0]).mean()),
                    "error": 100 * float(jnp.linalg.norm(error) / jnp.linalg.norm(exact)),
                    "microseconds": 1e6 * seconds[name] / len(outside),
                }
            )
    return [Table("Light through the walls of a closed box", rows=context.rows)]


def _box(half: float) -> geometry.Mesh:
    corners = np.array(list(np.ndindex(2, 2, 2)), np.float32) * 2 * half - half
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [[a, b, c] for a, b, c, _ in quads] + [[c, d, a] for a, _, c, d in quads]
    return geometry.make_mesh(corners, np.array(faces))


def _light(scene: midrange.Scene, points: np.ndarray, config: Config) -> Float[Array, "v 3 k"]:
    parts = [
        midrange.project_cube(midrange.capture(scene, part, 32, progress=False), config.degree)
        for part in np.array_split(points, max(len(points) // 250, 1))
    ]
    return jnp.concatenate(parts)


Way = Callable[[np.ndarray], midrange.Weights]


def _ways(
    cubes: midrange.RadianceCube, grid: midrange.Grid, size: int
) -> Iterator[tuple[str, Way]]:
    """Weights at positions, by name: plain ones, and by two tests of what hides samples."""
    moments = _moments(cubes, size)

    def by_distances(positions: np.ndarray) -> midrange.Weights:
        weights = grid.weights(positions)
        assert weights.indices is not None
        values = _by_distances(weights.values, weights.indices, positions, grid.points, moments)
        return midrange.Weights(values, weights.cells)

    yield "plain", grid.weights
    yield "distances (Majercik et al.)", by_distances
    yield "planes", lambda x: midrange.visible_weights(grid.weights(x), cubes, x)


def _moments(cubes: midrange.RadianceCube, size: int) -> Float[Array, "s h w 2"]:
    """Mean distance and mean square of it around the directions of an octahedral map."""
    side = (np.arange(size) + 0.5) / size * 2 - 1
    u, v = (axis.ravel() for axis in np.meshgrid(side, side, indexing="ij"))
    z = 1 - np.abs(u) - np.abs(v)
    folded = (1 - np.abs(v)) * np.where(u >= 0, 1, -1), (1 - np.abs(u)) * np.where(v >= 0, 1, -1)
    vectors = np.stack([np.where(z >= 0, u, folded[0]), np.where(z >= 0, v, folded[1]), z], -1)
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    cosines = np.maximum(vectors @ np.asarray(cubes.directions, np.float64).T, 0) ** _SHARPNESS
    filters = cosines * np.asarray(cubes.solid_angles)
    filters /= filters.sum(axis=1, keepdims=True)
    far = 4 * np.ptp(np.asarray(cubes.point), axis=0).max()
    distance = np.minimum(np.asarray(cubes.distance, np.float64), far)
    both = np.stack([distance @ filters.T, distance**2 @ filters.T], axis=-1)
    return jnp.asarray(both.reshape(-1, size, size, 2), cubes.distance.dtype)


@jax.jit
def _by_distances(
    values: Float[Array, "v n"],
    indices: Int[Array, "v n"],
    positions: Float[Array, "v 3"],
    points: Float[Array, "s 3"],
    moments: Float[Array, "s h w 2"],
) -> Float[Array, "v n"]:
    """Weights times the cube of Chebyshev's bound on how much is farther away, scaled to one."""
    offsets = positions[:, None] - points[indices]
    distance = jnp.linalg.norm(offsets, axis=-1)
    mean, square = jnp.moveaxis(_look_up(moments, indices, offsets), -1, 0)
    variance = jnp.maximum(square - mean**2, 1e-6)
    bound = variance / (variance + jnp.maximum(distance - mean, 0) ** 2)
    left = values * bound**3
    return left / jnp.maximum(jnp.sum(left, axis=-1, keepdims=True), 1e-3)


def _look_up(moments: Array, indices: Array, offsets: Array) -> Float[Array, "v n 2"]:
    """Interpolate bilinearly on the octahedral maps of samples."""
    size = moments.shape[1]
    x, y, z = jnp.moveaxis(offsets / jnp.sum(jnp.abs(offsets), axis=-1, keepdims=True), -1, 0)
    below = z < 0
    u = jnp.where(below, (1 - jnp.abs(y)) * jnp.where(x >= 0, 1, -1), x)
    v = jnp.where(below, (1 - jnp.abs(x)) * jnp.where(y >= 0, 1, -1), y)
    row, column = ((side + 1) / 2 * size - 0.5 for side in (u, v))
    first, second = jnp.floor(row), jnp.floor(column)
    total: Any = 0
    for i in (0, 1):
        for j in (0, 1):
            share = (1 - jnp.abs(row - first - i)) * (1 - jnp.abs(column - second - j))
            at = _folded((first + i).astype(int), (second + j).astype(int), size)
            total += share[..., None] * moments[(indices, *at)]
    return total


def _folded(i: Array, j: Array, size: int) -> tuple[Array, Array]:
    """Carry texels beyond a border of an octahedral map to where it goes on."""
    j = jnp.where((i < 0) | (i >= size), size - 1 - j, j)
    i = jnp.clip(i, 0, size - 1)
    i = jnp.where((j < 0) | (j >= size), size - 1 - i, i)
    return i, jnp.clip(j, 0, size - 1)
