"""Tilings: vertices that mirror the eye into nearly the same direction share a tile."""

import functools
import heapq

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from .._core.checks import as_host_float, check_flag, check_size, check_type
from ..transfer import Transfer
from ..transfer._glossy_kernels import checked_eye, mirrored, rows_of
from ._method import check_known
from ._sharing import made_of_rows, sharing

# Vertices per block: a tile holds whole blocks, so that shapes depend on neither tiles nor eye.
BLOCK = 128
NUM_TILES = 128
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
    block: int = BLOCK,
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
    num_tiles, block = check_size("num_tiles", num_tiles), check_size("block", block)
    check_known("make_tiling", transfer, eye)
    eye = checked_eye(eye, transfer.positions.dtype)
    if areas is None:
        areas = vertex_areas(transfer)
    elif not isinstance(areas, Array):
        areas = jnp.asarray(as_host_float(areas, "areas"))
    if areas.shape != (transfer.num_points,):
        raise ValueError(f"expected areas ({transfer.num_points},), got shape {areas.shape}")
    shared = sharing(transfer.coefficients)
    if shared and shared.parts > 1:  # a device with a part of the vertices has as many blocks
        block = max(-(-block // shared.parts), min(block, _LEAST))
    axis, units = _mirrored(eye, transfer.positions, transfer.normals, distant)

    def split(part, axis, units, areas):
        axis, first = axis.astype(np.float32).T, part * len(axis)
        facing = np.sum(units.T * axis, axis=0)
        weights = areas * (np.maximum(facing, 0) + 0.05)
        blocks, last = -(-len(weights) // block), len(weights) - 1
        # What fills the last block up weighs nothing.
        spare = blocks * block - len(weights)
        weights, axis = np.pad(weights, (0, spare)), np.pad(axis, ((0, 0), (0, spare)), mode="edge")
        tiles = _split(axis.T, weights, np.arange(len(weights)), min(num_tiles, blocks), block)
        sizes = [len(tile) // block for tile in tiles]
        axes = np.stack([_towards(weights[tile] @ axis.T[tile]) for tile in tiles])
        order = np.minimum(np.concatenate(tiles), last).reshape(-1, block) + first
        tile = np.repeat(np.arange(len(tiles)), sizes) + part * len(tiles)
        return order.astype(np.int32), tile.astype(np.int32), axes.astype(units.dtype)

    return Tiling(*made_of_rows(split, shared, axis.T, units.T, areas))


@functools.partial(jax.jit, static_argnames="distant")
def _mirrored(eye, positions, normals, distant):
    """Mirrors the eye about the normals, and returns these at unit length: one program for both."""
    positions, normals = rows_of(positions, normals)
    return mirrored(eye, positions, normals, distant), normals


def _towards(vector: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
    """Scales to unit length; +z where there is no direction."""
    length = np.linalg.norm(vector)
    return vector / length if length > 0 else np.array([0.0, 0.0, 1.0])


def _split(axis, weights, vertices, count, block) -> list[np.ndarray]:
    serial, queue = 0, []

    def push(members):
        nonlocal serial
        serial += 1
        weight, offsets = weights[members], axis[members]
        offsets = offsets - weight @ offsets / weight.sum()
        cost = weight @ np.sum(offsets * offsets, axis=1) ** 3
        # A single block stays whole: it waits behind all that can be split.
        heapq.heappush(queue, (-cost if len(members) > block else 1.0, serial, members, offsets))

    push(vertices)
    while len(queue) < count:
        *_, members, offsets = heapq.heappop(queue)
        _, vectors = np.linalg.eigh(offsets.T @ (weights[members, None] * offsets))
        along = offsets @ vectors[:, -1]
        middle = np.count_nonzero(along < (along.min() + along.max()) / 2)
        cut = block * int(np.clip(round(middle / block), 1, len(members) // block - 1))
        parts = np.argpartition(along, cut)
        push(members[parts[:cut]])
        push(members[parts[cut:]])
    return [members for *_, members, _ in queue]


def vertex_areas(transfer: Transfer) -> Float[Array, " v"]:
    """Estimates areas by the mean squared length of a vertex's edges, relative to all vertices'.

    Where devices share the vertices, of edges between those of the same device.
    """

    def estimate(part, points, neighbors):
        numbers = np.arange(len(points))[:, None]
        neighbors = neighbors - part * len(points)
        near = np.where((neighbors >= 0) & (neighbors < len(points)), neighbors, numbers)
        squares = np.sum((points[near] - points[:, None]) ** 2, axis=(1, 2))
        areas = squares / np.maximum((near != numbers).sum(axis=1), 1)
        mean = areas.mean()
        return (np.maximum(areas / mean, 1e-3) if mean > 0 else np.ones_like(areas),)

    shared = sharing(transfer.coefficients)
    return made_of_rows(estimate, shared, transfer.positions, transfer.neighbors)[0]
