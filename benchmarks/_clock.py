"""Timing that survives a noisy machine: interleaved rounds, ratios round by round."""

import statistics
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax


class Timing(NamedTuple):
    """What one function cost: its first call (trace, compile and run) and a call after that."""

    first_seconds: float
    seconds: list[float]  # one per round

    @property
    def median_ms(self) -> float:
        return 1e3 * statistics.median(self.seconds)


def interleave(calls: Mapping[str, Callable[[], Any]], *, rounds: int) -> dict[str, Timing]:
    """Time the calls in turn, `rounds` times over.

    A round takes the fastest of three calls in a row, so that a function does not pay for memory
    that another one has just given back to the system.
    """
    first = {name: _seconds(call) for name, call in calls.items()}
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            seconds[name].append(min(_seconds(call) for _ in range(3)))
    return {name: Timing(first[name], seconds[name]) for name in calls}


def ratio(slower: Timing, faster: Timing) -> float:
    """Median over the rounds of slower / faster: drift of the machine cancels."""
    pairs = zip(slower.seconds, faster.seconds, strict=True)
    return statistics.median(a / b for a, b in pairs)


def _seconds(call: Callable[[], Any]) -> float:
    start = time.perf_counter()
    jax.block_until_ready(call())
    return time.perf_counter() - start
