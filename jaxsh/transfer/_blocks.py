"""Vertices block by block: on every core, with a bar that grows and a checkpoint that remembers."""

import contextlib
import sys
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from jaxtyping import Float

from .._core.host import cores
from ._checkpoint import Checkpoint
from ._gather import TILE

Gather = Callable[[slice], np.ndarray]


class Blocks:
    """Fills arrays of one shape for a bake, on threads, in blocks of whole tiles.

    Tiles that the checkpoint holds are not computed again, and new ones are added to it.
    """

    def __init__(
        self,
        shape: tuple[int, int],
        dtype: np.dtype,
        chunk: int,
        checkpoint: Checkpoint | None,
        bar: Any,
    ):
        (self._count, self._width), self._dtype = shape, dtype
        self._size = -(-chunk // TILE) * TILE
        self._checkpoint = checkpoint
        self._finished = iter(checkpoint.read() if checkpoint else ())
        self._bar = bar

    def fill(self, gather: Gather) -> Float[np.ndarray, "v k"]:
        """The array whose rows `gather` computes for a slice of them."""
        tiles = np.zeros((-(-self._count // TILE), TILE, self._width), self._dtype)
        rows = tiles.reshape(-1, self._width)[: self._count]
        start = 0
        for tile, finished in zip(tiles, self._finished, strict=False):
            tile[:] = finished
            start = min(start + TILE, self._count)
        self._bar.update(start)
        starts = range(start, self._count, self._size)
        parts = [slice(start, min(start + self._size, self._count)) for start in starts]
        with contextlib.closing(_in_order(gather, parts)) as blocks:
            for part, values in blocks:
                rows[part] = values
                if self._checkpoint:
                    self._checkpoint.append(tiles[part.start // TILE : -(-part.stop // TILE)])
                self._bar.update(len(values))
        return rows


class _NoBar(contextlib.nullcontext):
    def __enter__(self):
        return self

    def update(self, rows: int) -> None: ...


def progress_bar(total: int, shown: bool):
    """A context that counts vertices on a terminal, once it has taken more than a second."""
    if not shown:
        return _NoBar()
    from tqdm import tqdm

    # `disable=None`: not where nobody looks, as in a log.
    return tqdm(total=total, desc="bake", unit=" vertices", delay=1, file=sys.stderr, disable=None)


def _in_order(gather: Gather, parts: list[slice]) -> Generator[tuple[slice, np.ndarray]]:
    """Each part with its rows. After an exception or an interrupt later parts are not begun."""
    with ThreadPoolExecutor(cores()) as pool:
        futures = [pool.submit(gather, part) for part in parts]
        try:
            for part, future in zip(parts, futures, strict=True):
                yield part, future.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
