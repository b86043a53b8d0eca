"""Tilings: vertices that mirror the eye into nearly the same direction share a tile."""

import functools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from .._core.checks import as_host_float, check_flag, check_size, check_type
from .._core.xla import materialize
from ..transfer import Transfer
from ..transfer._glossy_kernels import checked_eye, mirrored, rows_of
from ._method import check_known
from ._sharing import made_of_rows, on_rows, sharing
from ._splits import split as tiles_of

# Vertices per block: a tile holds whole blocks, so that shapes depend on neither tiles nor eye.
BLOCK = 64
NUM_TILES = 400
# Of a small mesh, blocks are smaller; of one that would have fewer than 16 vertices in each, this:
# its normals differ so much from vertex to vertex that a tile's border must not be rounded.
_SMALLEST = 4
# Vertices of a block at least, where devices share out the vertices and those of their blocks.
_LEAST = 16


class Tiling(eqx.Module):
    """Groups vertices in blocks and blocks in tiles, by indices alone. Made by `make_tiling`.

    `permutation` names the vertex at each place, the last vertex again where a block must be
    filled up; `tile` is the tile of each block, ascending. `axes` are where a tile's vertices
    mirror the eye, on average. Where several devices share the vertices, each has blocks and tiles
    of its own vertices, one device after the other.

    **Example**

    >>> from jaxsh import adaptive, sphere, transfer
    >>> points = sphere.fibonacci(50).directions
    >>> made = transfer.unshadowed(points, points, degree=2)
    >>> tiling = adaptive.make_tiling(made, points[0], num_tiles=3, block=8)
    >>> tiling.permutation.shape, tiling.axes.shape
    ((7, 8), (3, 3))
    """

    permutation: Int[Array, "blocks b"]
    tile: Int[Array, " blocks"]
    axes: Float[Array, "tiles 3"]


def make_tiling(
    transfer: Transfer,
    eye: Float[ArrayLike, " 3"],
    *,
    distant: bool = False,
    num_tiles: int = NUM_TILES,
    block: int | None = None,
    areas: Float[ArrayLike, " v"] | None = None,
) -> Tiling:
    """Split all vertices again and again, the costliest tile first, into `num_tiles` tiles.

    A tile costs Σ area·(max(n·ω_o, 0) + 0.05)·|B - B̄|⁶, and is split at the middle of its extent
    along its longest axis. Where there are fewer blocks than `num_tiles`, each is a tile.
    Arguments and errors as for `make_tiles`; `areas` of the vertices, relative to their mean,
    where they are known already.

    **Example**

    >>> from jaxsh import adaptive, sphere, transfer
    >>> points = sphere.fibonacci(50).directions
    >>> made = transfer.unshadowed(points, points, degree=2)
    >>> adaptive.make_tiling(made, points[0], num_tiles=3, block=8).permutation.shape
    (7, 8)
    """
    check_type("transfer", transfer, Transfer)
    distant = check_flag("distant", distant)
    num_tiles = check_size("num_tiles", num_tiles)
    block = _usual(transfer, num_tiles) if block is None else check_size("block", block)
    check_known("make_tiling", transfer, eye)
    eye = checked_eye(eye, transfer.positions.dtype)
    if not transfer.num_points:
        raise ValueError("expected a transfer of at least one point, got one of none")
    if areas is None:
        areas = vertex_areas(transfer)
    elif not isinstance(areas, Array):
        areas = jnp.asarray(as_host_float(areas, "areas"))
    if areas.shape != (transfer.num_points,):
        raise ValueError(f"expected areas ({transfer.num_points},), got shape {areas.shape}")
    shared = sharing(transfer.coefficients)
    if shared and shared.parts > 1:  # a device with a part of the vertices has as many blocks
        block = max(-(-block // shared.parts), min(block, _LEAST))

    def split(part, seen):
        count, dtype = len(seen), seen.dtype
        blocks = -(-count // block)
        # What fills the last block up weighs nothing.
        seen = np.pad(seen.astype(np.float32), ((0, blocks * block - count), (0, 0)), mode="edge")
        seen[count:, 3] = 0
        tiled, sizes, means = tiles_of(seen[:, :3].T, seen[:, 3], min(num_tiles, blocks), block)
        order = np.minimum(tiled, np.int32(count - 1)).reshape(-1, block)
        tile = np.repeat(np.arange(len(sizes), dtype=np.int32), sizes)
        first = np.int32(part * count), np.int32(part * len(sizes))
        return order + first[0], tile + first[1], _towards(means.astype(dtype))

    seen = _seen(eye, transfer.positions, transfer.normals, areas, distant)
    return Tiling(*made_of_rows(split, shared, seen))


@functools.partial(jax.jit, static_argnames="distant")
def _seen(eye, positions, normals, areas, distant) -> Float[Array, "v 4"]:
    """Tells where each vertex mirrors the eye, and what it weighs."""
    positions, normals = rows_of(positions, normals)
    # Once: below it has two uses, and each would compute it anew for every component.
    axis = materialize(functools.partial(mirrored, distant=distant), eye, positions, normals)
    weights = areas * (jnp.maximum(jnp.sum(normals * axis, axis=0), 0) + 0.05)
    return jnp.concatenate([axis, weights[None].astype(axis.dtype)]).T


def _usual(transfer: Transfer, num_tiles: int) -> int:
    """Returns the largest block, a power of two, that leaves blocks enough to choose tiles from."""
    each = transfer.num_points / (1.6 * num_tiles)
    return min(BLOCK, 2 ** int(math.log2(each))) if each >= 16 else _SMALLEST


def _towards(vectors: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Scales to unit length; +z where there is no direction."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    up = np.array([0, 0, 1], vectors.dtype)
    return np.where(lengths > 0, vectors / np.where(lengths > 0, lengths, 1), up)


@functools.partial(jax.jit, static_argnames="shared")
def _areas(points, neighbors, shared):
    def estimate(points, neighbors):
        count = len(points)
        numbers = jnp.arange(count, dtype=neighbors.dtype)[:, None]
        if shared and shared.names is not None:
            neighbors = neighbors - count * jax.lax.axis_index(shared.names)
        near = (neighbors >= 0) & (neighbors < count)
        others, squares = jnp.where(near, neighbors, numbers), 0.0
        for x in points.T:
            along = x.at[others].get(mode="promise_in_bounds") - x[:, None]
            squares += jnp.sum(along * along, axis=1)
        edges = jnp.sum(near & (neighbors != numbers), axis=1, dtype=points.dtype)
        areas = squares / jnp.maximum(edges, 1)
        mean = jnp.mean(areas)
        return jnp.where(mean > 0, jnp.maximum(areas / mean, 1e-3), jnp.ones_like(areas))

    return on_rows(estimate, shared, (0, 0), 0, points, neighbors)


def vertex_areas(transfer: Transfer) -> Float[Array, " v"]:
    """Estimates areas by the mean squared length of a vertex's edges, relative to all vertices'.

    Where devices share the vertices, of edges between those of the same device.
    """

    shared = sharing(transfer.coefficients)
    return _areas(transfer.positions, transfer.neighbors, shared)
