"""What the runner hands to an experiment."""

import contextlib
import functools
import statistics
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

from .data import Data
from .report import plain, to_json, write

T = TypeVar("T")


class Measurement(NamedTuple, Generic[T]):
    """The value of a function and what it cost, in seconds."""

    value: T
    compile_seconds: float
    run_seconds: float


class Context:
    """One run: where its rows, pictures and times go, and where its data and chance come from."""

    def __init__(self, folder: Path, data: Data, *, seed: int = 0, progress: bool = False):
        self.folder = folder
        self.data = data
        self.seed = seed
        self.rows: list[dict[str, Any]] = []
        self.pictures: dict[str, str] = {}
        self.times: dict[str, dict[str, float]] = {}
        self._progress = progress

    @functools.cached_property
    def key(self):
        """The JAX random key of the run's seed."""
        import jax

        return jax.random.key(self.seed)

    def record(self, row: dict[str, Any]) -> None:
        """Add one row of metrics. It is on disk before this returns."""
        self.rows.append(plain(row))
        write(self.folder / "metrics.json", to_json(self.rows))

    def path(self, name: str, caption: str | None = None) -> Path:
        """Where to write a file of the run; a picture with a caption is shown in the report."""
        if caption is not None:
            self.pictures[name] = caption
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def progress(self, iterable: Iterable[T], description: str = "") -> Iterable[T]:
        """The iterable with a progress bar on stderr: none with --no-progress or off a terminal."""
        from tqdm import tqdm

        shown = self._progress and sys.stderr.isatty()
        return tqdm(iterable, description, disable=not shown, file=sys.stderr)

    @contextlib.contextmanager
    def time(self, label: str) -> Iterator[None]:
        """Record the seconds of a block, summed over blocks of the same label.

        JAX works ahead of Python: let the block end with ``jax.block_until_ready``.
        """
        start = time.perf_counter()
        try:
            yield
        finally:
            seconds = time.perf_counter() - start
            times = self.times.setdefault(label, {"seconds": 0.0})
            times["seconds"] += seconds

    def measure(
        self, label: str, function: Callable[..., T], *arguments: Any, repeats: int = 5
    ) -> Measurement[T]:
        """Compile the function, run it `repeats` times, and record both costs under `label`.

        The run's cost is the median. The function is jitted if it is not already; its arguments
        are arrays or trees of them (bind what is static beforehand).
        """
        import jax

        jitted: Any = function if hasattr(function, "lower") else jax.jit(function)
        start = time.perf_counter()
        compiled = jitted.lower(*arguments).compile()
        compile_seconds = time.perf_counter() - start
        value = jax.block_until_ready(compiled(*arguments))  # a first run warms the caches
        seconds = []
        for _ in range(repeats):
            start = time.perf_counter()
            value = jax.block_until_ready(compiled(*arguments))
            seconds.append(time.perf_counter() - start)
        run_seconds = statistics.median(seconds)
        self.times[label] = {
            "compile_seconds": compile_seconds,
            "run_seconds": run_seconds,
            "repeats": repeats,
        }
        return Measurement(value, compile_seconds, run_seconds)
