"""Passes over all vertices, block by block on every core, with a bar and a store."""

import contextlib
import dataclasses
import sys
from collections import deque
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from jaxtyping import Float

from ..._core.host import aligned, cores
from ._device import UNDER_WAY, DeviceJob, Jobs
from ._gather import TILE
from ._kept import BakeStore

Gather = Callable[[slice], np.ndarray]


@dataclasses.dataclass(frozen=True)
class Passes:
    """Fills arrays, one for each pass, on threads, in parts of whole tiles.

    Blocks that the store holds are not computed again, and new ones are added to it.
    """

    jobs: Jobs
    chunk: int
    store: BakeStore | None
    bar: Any

    def run(
        self,
        number: int,
        before: Float[np.ndarray, "m k"] | None = None,
        direct: Float[np.ndarray, "v k"] | None = None,
    ) -> Float[np.ndarray, "v k"]:
        """Compute the coefficients of pass `number`, for which see `Job.rows`."""
        job, store = self.jobs.of(number), self.store
        count = job.num_points
        rows = aligned((count, job.width), job.dtype)
        missing = [slice(0, count)] if store is None else store.fill(number, rows)
        self.bar.update(count - sum(part.stop - part.start for part in missing))

        def gather(part: slice) -> np.ndarray:
            own = None if direct is None else direct[part]
            return self.jobs.rows(number, part, before, own)

        size, threads = -(-self.chunk // TILE) * TILE, cores()
        if isinstance(job, DeviceJob):
            size, threads = job.chunk, UNDER_WAY
        parts = [
            slice(start, min(start + size, run.stop))
            for run in missing
            for start in range(run.start, run.stop, size)
        ]
        with contextlib.closing(_in_order(gather, parts, threads)) as blocks:
            for part, values in blocks:
                rows[part] = values
                if store is not None:
                    for block in store.ended_by(number, part):
                        store.write_pass(number, block, rows[store.rows_of_pass(number, block)])
                self.bar.update(len(values))
        return rows


class _NoBar(contextlib.nullcontext):
    def __enter__(self):
        return self

    def update(self, rows: int) -> None: ...


def progress_bar(total: int, shown: bool, doing: str = "bake"):
    """Count points on a terminal, in a context, once it has taken more than a second."""
    if not shown:
        return _NoBar()
    from tqdm import tqdm

    # `disable=None` hides the bar when stderr is not a terminal.
    return tqdm(total=total, desc=doing, unit=" points", delay=1, file=sys.stderr, disable=None)


def _in_order(
    gather: Gather, parts: list[slice], threads: int
) -> Generator[tuple[slice, np.ndarray]]:
    """Yield each part with its rows. After an exception or interrupt later parts do not start."""
    with ThreadPoolExecutor(threads) as pool:
        futures = deque(pool.submit(gather, part) for part in parts)
        try:
            for part in parts:
                yield part, futures.popleft().result()  # which is then kept nowhere
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
