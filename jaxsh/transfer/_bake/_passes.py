"""Passes over all vertices, block by block on every core, with a bar and a checkpoint."""

import contextlib
import dataclasses
import sys
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..._core.host import cores
from ._checkpoint import Checkpoint
from ._gather import TILE

Gather = Callable[[slice], np.ndarray]


@dataclasses.dataclass(frozen=True)
class Passes:
    """Fills arrays of one shape, one for each pass, on threads, in blocks of whole tiles.

    Tiles that the checkpoint holds are not computed again, and new ones are added to it.
    """

    shape: tuple[int, int]
    dtype: np.dtype
    chunk: int
    checkpoint: Checkpoint | None
    bar: Any

    def run(self, number: int, gather: Gather) -> Float[np.ndarray, "v k"]:
        """Compute the array of pass `number`: `gather` gives its rows for a slice of them."""
        count, width = self.shape
        tiles = np.zeros((-(-count // TILE), TILE, width), self.dtype)
        rows = tiles.reshape(-1, width)[:count]
        first = 0
        if self.checkpoint:
            finished = self.checkpoint.read(number * len(tiles), len(tiles))
            tiles[: len(finished)] = finished
            first = min(len(finished) * TILE, count)
        self.bar.update(first)
        size = -(-self.chunk // TILE) * TILE
        parts = [slice(start, min(start + size, count)) for start in range(first, count, size)]
        with contextlib.closing(_in_order(gather, parts)) as blocks:
            for part, values in blocks:
                rows[part] = values
                if self.checkpoint:
                    self.checkpoint.append(tiles[part.start // TILE : -(-part.stop // TILE)])
                self.bar.update(len(values))
        return rows


class _NoBar(contextlib.nullcontext):
    def __enter__(self):
        return self

    def update(self, rows: int) -> None: ...


def progress_bar(total: int, shown: bool):
    """Count vertices on a terminal, in a context, once it has taken more than a second."""
    if not shown:
        return _NoBar()
    from tqdm import tqdm

    # `disable=None` hides the bar when stderr is not a terminal.
    return tqdm(total=total, desc="bake", unit=" vertices", delay=1, file=sys.stderr, disable=None)


def _in_order(gather: Gather, parts: list[slice]) -> Generator[tuple[slice, np.ndarray]]:
    """Yield each part with its rows. After an exception or interrupt later parts do not start."""
    # `with jax.enable_x64(True)` holds on its own thread alone.
    double = jnp.result_type(float) == jnp.float64

    def run(part: slice) -> np.ndarray:
        with jax.enable_x64(double):
            return gather(part)

    with ThreadPoolExecutor(cores()) as pool:
        futures = [pool.submit(run, part) for part in parts]
        try:
            for part, future in zip(parts, futures, strict=True):
                yield part, future.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
