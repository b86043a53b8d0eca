"""Clusters on this machine, and what their processes use."""

import contextlib
import itertools
import math
import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from jaxsh import geometry


class Counting:
    """A ray scene that counts the rays of another, from any thread."""

    def __init__(self, scene: geometry.RayScene):
        self._scene, self._lock, self.rays = scene, threading.Lock(), 0

    def occluded(self, origins: Any, directions: Any, max_distance: Any = math.inf) -> Any:
        with self._lock:
            self.rays += len(origins)
        return self._scene.occluded(origins, directions, max_distance)

    def closest_hit(self, origins: Any, directions: Any) -> geometry.Hit:
        with self._lock:
            self.rays += len(origins)
        return self._scene.closest_hit(origins, directions)


@contextlib.contextmanager
def processes(count: int) -> Iterator[Any]:
    """A client of so many worker processes of one thread, without a limit of memory."""
    from distributed import Client, LocalCluster

    plain: dict[str, Any] = {"dashboard_address": ":0", "memory_limit": None}
    with (
        LocalCluster(n_workers=count, threads_per_worker=1, **plain) as cluster,
        Client(cluster) as client,
    ):
        yield client


def in_a_process(function: Callable[..., Any], *arguments: Any) -> Any:
    """What a function of a module gives in a new Python process, which ends with it."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as one:
        return one.submit(function, *arguments).result()


def cpu_seconds(client: Any = None) -> float:
    """The processor time of this process so far, and of a client's workers."""
    own = sum(os.times()[:2])
    return own + (0 if client is None else sum(client.run(cpu_seconds).values()))


def folder_bytes(path: Path) -> int:
    """The bytes of all files below."""
    return sum(file.stat().st_size for file in path.rglob("*") if file.is_file())


def read_seconds(path: Path) -> float:
    """Read all files below into one buffer, as fast as a thread does."""
    files = [file for file in path.rglob("*") if file.is_file()]
    buffer = bytearray(max(file.stat().st_size for file in files))
    start = time.perf_counter()
    for file in files:
        with file.open("rb", buffering=0) as opened:
            opened.readinto(buffer)
    return time.perf_counter() - start


def tasks_per_second(client: Any, count: int) -> float:
    """Run empty tasks, with as large arguments as a block's, as `bake_on` hands them out."""
    from distributed import as_completed

    about = {f"argument {i}": "0123456789abcdef" for i in range(11)}
    numbers = iter(range(count))
    finished = as_completed()

    def submit(most: int) -> None:
        for number in itertools.islice(numbers, most):
            finished.add(client.submit(_nothing, about, number, pure=False))

    start = time.perf_counter()
    submit(4096)
    for future in finished:
        future.result()
        submit(1)
    return count / (time.perf_counter() - start)


def _nothing(about: dict[str, str], number: int) -> None: ...
