"""The workers of a bake on a cluster: blocks into a store that all else is read from."""

import contextlib
import ctypes
import os
import socket
import threading
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from .._store import DamagedError
from ._gather import TILE
from ._job import DIRECT
from ._kept import BakeStore, differing


class Task(NamedTuple):
    """Bakes a block on a worker, and tells which of its points see nothing."""

    path: str
    identity: dict[str, Any]
    number: int  # of the pass
    chunk: int

    def __call__(self, block: int) -> bytes | None:
        held = _hold(self.path, self.identity)
        kept, part = held.kept, held.kept.rows_of_pass(self.number, block)
        try:
            rows = kept.read_pass(self.number, block)
        except DamagedError:
            rows = held.bake(self.number, block, self.chunk)
            kept.write_pass(self.number, block, rows)
        if kept.steps[self.number] != DIRECT:
            return None
        blind = ~rows.any(axis=1) & held.jobs.points.prepared.normals[part].any(axis=1)
        return np.packbits(blind).tobytes() if blind.any() else None


class _Held:
    """Keeps in a worker process what all blocks of a bake need."""

    def __init__(self, path: str, identity: dict[str, Any]):
        if not os.path.isdir(path):
            raise ValueError(
                f"{path}: not there for the worker on {socket.gethostname()}: the store must be a "
                "folder that this process and all workers see under one path"
            )
        self.kept = BakeStore(Path(path))
        if differing(self.kept.attributes["arguments"], identity):
            raise ValueError(f"{path}: another bake took the place of this one's store")
        self.jobs = self.kept.jobs(threads=1)
        # The coefficients of pass `_number`, of all vertices that light bounces off.
        self._before, self._number = np.empty((0, 0)), -1
        self._lock = threading.Lock()
        _keep_freed_memory()

    def bake(self, number: int, block: int, chunk: int) -> Float[np.ndarray, "rows k"]:
        """Compute a block of a pass, `chunk` vertices at a time."""
        before, direct, step, job = None, None, self.kept.steps[number], self.jobs.of(number)
        if step.before is not None and step.direct is not None:
            before, direct = self._all_of(step.before), self.kept.read_pass(step.direct, block)
        part = self.kept.rows_of_pass(number, block)
        rows = np.empty((part.stop - part.start, job.width), job.dtype)
        # A device has chunks of its own.
        size = max(len(rows), 1) if job.arguments.device else -(-chunk // TILE) * TILE
        for start in range(0, len(rows), size):
            at = slice(start, min(start + size, len(rows)))
            whole = slice(part.start + at.start, part.start + at.stop)
            own = None if direct is None else direct[at]
            rows[at] = self.jobs.rows(number, whole, before, own)
        return rows

    def _all_of(self, number: int) -> Float[np.ndarray, "v k"]:
        """Read a pass, once for all threads."""
        with self._lock:
            if self._number != number:
                self._before = self._before[:0].copy()  # its memory first
                self._before, self._number = self.kept.whole_pass(number), number
            return self._before


# Of glibc's malloc.h.
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
# One bake at a time in a process: its tree may take most of the memory.
_held: dict[str, Any] = {}
_building = threading.Lock()


def _hold(path: str, identity: dict[str, Any]) -> _Held:
    """Give what this process keeps of a bake, read and built by the first thread that asks."""
    with _building:
        if _held.get("key") != (path, identity):
            _held.clear()
            _held.update(held=_Held(path, identity), key=(path, identity))
        return _held["held"]


def _keep_freed_memory() -> None:
    """Let glibc keep memory that is freed, for the next block.

    Dask's nanny tells it to give all back at once: each array of a block then comes from the system
    anew, page by page, and much of a bake's processor time goes there.
    """
    if "MALLOC_TRIM_THRESHOLD_" in os.environ:
        with contextlib.suppress(AttributeError, OSError):  # another C library
            change = ctypes.CDLL(None).mallopt
            change(_MMAP_THRESHOLD, 2**25)
            change(_TRIM_THRESHOLD, 2**28)


def let_go() -> None:
    """Free what this process keeps of a bake.

    But what is being built, as is where a bake is stopped at its start: the next bake frees that.
    To wait for it would keep the worker from answering its scheduler.
    """
    if _building.acquire(blocking=False):
        _held.clear()
        _building.release()
