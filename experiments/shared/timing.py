"""Timing that survives a busy machine: calls take turns, and ratios are taken round by round."""

import itertools
import statistics
import time
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple, TypeVar

import jax

_SLICE = 2e-3  # seconds: shorter calls are repeated up to this length, so that the clock can tell

T = TypeVar("T")


class Timing(NamedTuple):
    """The cost of one function: its first call (trace, compile and run) and calls after that."""

    first_seconds: float
    seconds: list[float]  # one per round

    @property
    def median_ms(self) -> float:
        return 1e3 * statistics.median(self.seconds)


def timed(call: Callable[..., T], *arguments: Any) -> tuple[T, float]:
    """Call, wait for the value, and return it with the seconds that it took."""
    start = time.perf_counter()
    value = jax.block_until_ready(call(*arguments))
    return value, time.perf_counter() - start


def bursts(
    calls: Mapping[str, Callable[..., Any]], arguments: Iterable[tuple], *, length: int
) -> dict[str, list[list[float]]]:
    """Time each call on `length` of the arguments before the next takes its turn on the same ones.

    Returns the seconds of each, a list per turn.
    """
    taken: dict[str, list[list[float]]] = {name: [] for name in calls}
    arguments = iter(arguments)
    while burst := list(itertools.islice(arguments, length)):
        jax.block_until_ready(burst)
        for name, call in calls.items():
            taken[name].append([timed(call, *some)[1] for some in burst])
    return taken


def interleaved(calls: Mapping[str, Callable[[], Any]], *, rounds: int) -> dict[str, Timing]:
    """Time the calls in turn, `rounds` times over.

    A round takes the fastest of three calls in a row, so that a function does not pay for memory
    that another one has just given back to the system.
    """
    first = {name: timed(call)[1] for name, call in calls.items()}
    taken = bursts(calls, [()] * (3 * rounds), length=3)
    return {name: Timing(first[name], [min(turn) for turn in taken[name]]) for name in calls}


def ratio(slower: Timing, faster: Timing) -> float:
    """Median over the rounds of slower / faster: drift of the machine cancels."""
    pairs = zip(slower.seconds, faster.seconds, strict=True)
    return statistics.median(a / b for a, b in pairs)


def fastest(calls: Mapping[str, Callable[[], Any]], *, rounds: int) -> dict[str, float]:
    """Seconds per call, the fastest round of each: other work on the machine can only add."""
    repeats = {}
    for name, call in calls.items():
        jax.block_until_ready(call())
        repeats[name] = max(1, int(_SLICE / timed(call)[1]))

    def repeated(call: Callable[[], Any], count: int) -> Callable[[], None]:
        def several() -> None:
            for _ in range(count):
                jax.block_until_ready(call())

        return several

    slices = {name: repeated(call, repeats[name]) for name, call in calls.items()}
    taken = bursts(slices, [()] * rounds, length=1)
    return {name: min(itertools.chain(*turns)) / repeats[name] for name, turns in taken.items()}
