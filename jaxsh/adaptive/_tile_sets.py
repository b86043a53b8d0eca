"""Which vertices share a tile: those that mirror the eye into nearly the same direction."""

import functools
import heapq

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int, Int8

from .._core.linalg import matmul
from ..harmonics import degree_of, evaluate, rotate
from ..transfer import Transfer
from ..transfer._glossy_kernels import checked_eye, in_steps, reflected, rows_of, unit
from ._local_rule import check_rule, local_rule

# Vertices per block: a tile holds whole blocks, so that shapes depend on neither tiles nor eye.
BLOCK = 128
DIRECTIONS = 40
COUNT = 128
EXPONENT = 32.0


class Tiling(eqx.Module):
    """Vertices in blocks, blocks in tiles: indices alone. Made by `make_tiling`.

    `order` names the vertex at each place, the last vertex again where a block must be filled up;
    `tile` is the tile of each block, ascending. `axes` are where a tile's vertices mirror the
    eye, on average.
    """

    order: Int[Array, "blocks b"]
    tile: Int[Array, " blocks"]
    axes: Float[Array, "tiles 3"]


class TileSet(eqx.Module):
    """A transfer in the order of a tiling, ready for frame after frame. Made by `make_tiles`.

    It serves any eye, and best the one it was made for. Sets of one mesh, count and block have
    the same shapes, so that code compiled for one serves all.
    """

    tiling: Tiling
    place: Int[Array, " v"]  # where in `order` each vertex is
    samples: Int8[Array, "blocks n b"] | Float[Array, "blocks n b"]
    steps: Float[Array, "blocks n"]  # what samples count: of transfer, in each tile's directions
    directions: Float[Array, "tiles n 3"]
    basis: Float[Array, "k tiles n"]  # there
    powers: Float[Array, "terms bands"]  # of the lobe around them, as `LocalRule` has it
    lowest: Float[Array, ""]
    positions: Float[Array, "3 places"]
    normals: Float[Array, "3 places"]  # at unit length

    @property
    def degree(self) -> int:
        return degree_of(len(self.basis))


def make_tiles(
    transfer: Transfer,
    eye: Float[ArrayLike, " 3"],
    *,
    distant: bool = False,
    count: int = COUNT,
    block: int = BLOCK,
    directions: int = DIRECTIONS,
    exponent: float = EXPONENT,
    quantized: bool = True,
) -> TileSet:
    """Tiles for the view from `eye`: the transfer regrouped, and sampled, by reflected direction.

    **Arguments**

    - `transfer`: concrete.
    - `eye`: a point, or with `distant` the direction to an eye far away.
    - `count`: of tiles. More are more exact.
    - `block`: the number of vertices that a tile's size is a multiple of.
    - `directions`: of each tile. More are more exact, and cost more per frame; as many as
      `transfer.sample` takes leave no error.
    - `exponent`: of the lobes to come. Others are less exact.
    - `quantized`: whether samples are rounded to eight bits, which the error does not show.

    Takes `directions` numbers a vertex. Neither traceable nor differentiable; raises `ValueError`
    for an eye that is no vector, for a count, block or directions below 1, and for an exponent
    that is not above -1.
    """
    check_rule(directions, exponent)
    tiling = make_tiling(transfer, eye, distant=distant, count=count, block=block)
    return arrange(transfer, tiling, directions=directions, exponent=exponent, quantized=quantized)


def make_tiling(
    transfer: Transfer,
    eye: Float[ArrayLike, " 3"],
    *,
    distant: bool = False,
    count: int = COUNT,
    block: int = BLOCK,
    areas: Float[ArrayLike, " v"] | None = None,
) -> Tiling:
    """Split all vertices again and again, the costliest tile first, into `count` tiles.

    A tile costs Σ area·(max(n·ω_o, 0) + 0.05)·|B - B̄|⁶, and is split at the middle of its extent
    along its longest axis. Where there are fewer blocks than `count`, each is a tile. Arguments
    and errors as for `make_tiles`; `areas` of the vertices, relative to their mean, where they are
    known already.
    """
    if count < 1 or block < 1:
        raise ValueError(f"expected count and block of at least 1, got {count} and {block}")
    eye = checked_eye(eye, transfer.positions.dtype)
    axis = np.asarray(reflected(eye, transfer.positions, transfer.normals, distant), np.float32)
    facing = np.sum(np.asarray(unit(transfer.normals.T)) * axis, axis=0)
    areas = vertex_areas(transfer) if areas is None else np.asarray(areas)
    weights = areas * (np.maximum(facing, 0) + 0.05)
    blocks, last = -(-len(weights) // block), len(weights) - 1
    # What fills the last block up weighs nothing.
    spare = blocks * block - len(weights)
    weights, axis = np.pad(weights, (0, spare)), np.pad(axis, ((0, 0), (0, spare)), mode="edge")
    tiles = _split(axis.T, weights, np.arange(len(weights)), min(count, blocks), block)
    sizes = [len(tile) // block for tile in tiles]
    axes = [_towards(weights[tile] @ axis.T[tile]) for tile in tiles]
    return Tiling(
        jnp.asarray(np.minimum(np.concatenate(tiles), last).reshape(-1, block).astype(np.int32)),
        jnp.asarray(np.repeat(np.arange(len(tiles), dtype=np.int32), sizes)),
        jnp.asarray(np.stack(axes), transfer.positions.dtype),
    )


def arrange(
    transfer: Transfer,
    tiling: Tiling,
    *,
    directions: int = DIRECTIONS,
    exponent: float = EXPONENT,
    quantized: bool = True,
) -> TileSet:
    """The transfer in the order of a tiling, in directions about each tile's own.

    Other arguments and errors as for `make_tiles`; raises `ValueError` for a tiling of another
    mesh too.
    """
    check_rule(directions, exponent)
    order, vertices = np.asarray(tiling.order), len(transfer.positions)
    place = np.full(max(vertices, order.max() + 1), -1, np.int32)
    place[order.ravel()] = np.arange(order.size, dtype=np.int32)
    if len(place) != vertices or place.min() < 0:
        held = np.count_nonzero(place >= 0)
        raise ValueError(f"expected a tiling of {vertices} vertices, got one of {held}")
    dtype = transfer.positions.dtype
    rule = local_rule(transfer.degree, directions, float(exponent))
    rule = tuple(jnp.asarray(part, dtype) for part in rule)
    return _arrange(transfer, tiling, jnp.asarray(place), rule, quantized)


@functools.partial(jax.jit, static_argnames="quantized")
def _arrange(transfer, tiling, place, rule, quantized):
    directions, rows, powers, lowest = rule
    turns = _turns(tiling.axes)
    directions = matmul(directions[None], jnp.swapaxes(turns, 1, 2))
    rows = rotate(rows, turns[:, None])

    def sampled(part):
        vertices, tile = part
        coefficients = transfer.coefficients.at[vertices].get(mode="promise_in_bounds")
        samples = matmul(rows[tile], coefficients.T)
        return in_steps(samples, 1) if quantized else (samples, jnp.ones_like(samples[:, 0]))

    samples, steps = jax.lax.map(sampled, (tiling.order, tiling.tile))
    basis = evaluate(directions, transfer.degree, axis=0)
    order = tiling.order.reshape(-1)
    positions, normals = rows_of(transfer.positions[order], transfer.normals[order])
    return TileSet(
        tiling, place, samples, steps, directions, basis, powers, lowest, positions, normals
    )


def _turns(axes: Float[Array, "tiles 3"]) -> Float[Array, "tiles 3 3"]:
    """Rotations that take +z to each axis (Duff et al. 2017, "Building an orthonormal basis")."""
    x, y, z = axes.T
    sign = jnp.where(z < 0, -1.0, 1.0).astype(axes.dtype)
    a = -1 / (sign + z)
    b = x * y * a
    first = jnp.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    return jnp.stack([first, jnp.stack([b, sign + y * y * a, -y], axis=-1), axes], axis=-1)


def _towards(vector: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
    """At unit length, or +z where there is no direction."""
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


def vertex_areas(transfer: Transfer) -> Float[np.ndarray, " v"]:
    """The mean squared length of a vertex's edges, relative to that of all: its area, roughly."""
    points, neighbors = np.asarray(transfer.positions), np.asarray(transfer.neighbors)
    real = neighbors != np.arange(len(points))[:, None]
    squares = np.sum((points[neighbors] - points[:, None]) ** 2, axis=(1, 2))
    areas = squares / np.maximum(real.sum(axis=1), 1)
    mean = areas.mean()
    return np.maximum(areas / mean, 1e-3) if mean > 0 else np.ones_like(areas)
