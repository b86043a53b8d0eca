"""Directions split into tiles: all tiles of a level at once, in NumPy."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

# Values of 16 bits, which NumPy sorts by their digits, in linear time.
_KEYS = 2**16
# Tiles split at once, at most, so that there are keys for 16 places along each one's axis.
_AT_ONCE = _KEYS // 16
_TINY = 1e-30
# Which products of components make a covariance, and where each stands in it.
_FIRST, _SECOND = (0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2)
_SYMMETRIC = [0, 1, 2, 1, 3, 4, 2, 4, 5]


class _Nodes(NamedTuple):
    """A tree of ranges of blocks; the two parts of a range come after it."""

    start: Int[np.ndarray, " nodes"]
    size: Int[np.ndarray, " nodes"]
    # The least cost of a node and of those that it is a part of: the order in which the costliest
    # of all tiles would be split, one after the other.
    key: Float[np.ndarray, " nodes"]
    parent: Int[np.ndarray, " nodes"]
    is_split: Bool[np.ndarray, " nodes"]


def split(
    axis: Float[np.ndarray, "3 n"], weights: Float[np.ndarray, " n"], count: int, block: int
) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " tiles"], Float[np.ndarray, "tiles 3"]]:
    """Split again and again what costs most, Σ weight·|B - B̄|⁶, until there are `count` tiles.

    At the middle of the tile's extent along its longest axis, at a multiple of `block`, which
    divides n. All tiles that are to be split anyway are so at once: whole blocks keep sums over
    tiles sums over rows, and a sort of 16-bit keys, tile and place along the axis, moves them all.

    Returns an order of the members, tile by tile; each tile's number of blocks; and its mean B.
    """
    rows = np.empty((4, len(weights) // block, block), np.float32)
    rows.reshape(4, -1)[:] = *axis, weights
    order = np.arange(len(weights), dtype=np.int32).reshape(-1, block)
    one = (np.array([value]) for value in (0, len(order), np.inf, -1, False))
    nodes = _Nodes(*one)
    while True:
        chosen = _costliest(nodes, count - 1)
        now = chosen[~nodes.is_split[chosen]][:_AT_ONCE]
        if not len(now):
            break
        now = now[np.argsort(nodes.start[now])]
        nodes = _halved(nodes, now, rows, order)
    is_tile = np.ones(len(nodes.key), bool)
    is_tile[1:] = np.isin(nodes.parent[1:], chosen)
    is_tile[chosen] = False
    tiles = np.flatnonzero(is_tile)
    tiles = tiles[np.argsort(nodes.start[tiles])]
    sizes = nodes.size[tiles]
    return order.ravel(), sizes, _means(rows, sizes).T


def _costliest(nodes: _Nodes, count: int) -> Int[np.ndarray, " some"]:
    """The `count` nodes that are split first, as far as they are known; a block stays whole."""
    able = np.flatnonzero(nodes.size > 1)
    return able[np.argsort(-nodes.key[able], kind="stable")[:count]]


def _halved(nodes: _Nodes, now: Int[np.ndarray, " some"], rows, order) -> _Nodes:
    """Splits nodes, in the order of their starts: moves their members, and adds their parts."""
    starts, sizes = nodes.start[now], nodes.size[now]
    blocks = np.arange(sizes.sum()) + np.repeat(starts - _firsts(sizes), sizes)
    whole = len(blocks) == len(order)
    some, members = (rows, order) if whole else (rows[:, blocks], order[blocks])
    size = order.shape[1]

    offsets = some[:3] - _spread(_means(some, sizes), sizes)
    weighted = offsets * some[3]
    products = np.stack([weighted[i] * offsets[j] for i, j in zip(_FIRST, _SECOND, strict=True)])
    _, vectors = np.linalg.eigh(_sums(products, sizes)[_SYMMETRIC].T.reshape(-1, 3, 3))
    offsets *= _spread(vectors[:, :, 2].T, sizes)
    along = offsets[0] + offsets[1] + offsets[2]
    low, high = (
        extreme.reduceat(extreme.reduce(along, axis=1), _firsts(sizes))
        for extreme in (np.minimum, np.maximum)
    )
    steps = _KEYS // len(now)
    along -= _spread(low, sizes)
    along *= _spread((steps - 1) / np.maximum(high - low, _TINY), sizes)
    below = np.add.reduceat(np.count_nonzero(along < (steps - 1) / 2, axis=1), _firsts(sizes))
    cuts = np.clip(np.rint(below / size).astype(int), 1, sizes - 1)
    keys = along.astype(np.uint16)
    keys += np.repeat((np.arange(len(now)) * steps).astype(np.uint16), sizes)[:, None]
    moved = np.argsort(keys, axis=None, kind="stable")
    some = some.reshape(4, -1).take(moved, axis=1).reshape(some.shape)
    rows[:, blocks], order[blocks] = some, members.ravel().take(moved).reshape(members.shape)

    parts = np.stack([cuts, sizes - cuts], axis=1).ravel()
    offsets = some[:3] - _spread(_means(some, parts), parts)
    offsets *= offsets
    squares = offsets[0] + offsets[1] + offsets[2]
    [costs] = _sums((squares * squares * squares * some[3])[None], parts)
    nodes.is_split[now] = True
    added = (
        np.stack([starts, starts + cuts], axis=1).ravel(),
        parts,
        np.minimum(np.repeat(nodes.key[now], 2), costs),
        np.repeat(now, 2),
        np.zeros(len(parts), bool),
    )
    return _Nodes(*map(np.append, nodes, added))


def _firsts(sizes: Int[np.ndarray, " ranges"]) -> Int[np.ndarray, " ranges"]:
    """Finds where each range begins, of those that follow each other."""
    return np.cumsum(sizes) - sizes


def _sums(rows: Float[np.ndarray, "m blocks b"], sizes) -> Float[np.ndarray, "m ranges"]:
    """Sums over each range of so many blocks."""
    return np.add.reduceat(rows @ np.ones(rows.shape[2], rows.dtype), _firsts(sizes), axis=1)


def _spread(values: Float[np.ndarray, "*m ranges"], sizes) -> Float[np.ndarray, "*m blocks 1"]:
    """Gives each block what its range has."""
    return np.repeat(values.astype(np.float32), sizes, axis=-1)[..., None]


def _means(rows: Float[np.ndarray, "4 blocks b"], sizes) -> Float[np.ndarray, "3 ranges"]:
    return _sums(rows[:3] * rows[3], sizes) / np.maximum(_sums(rows[3:], sizes), _TINY)
