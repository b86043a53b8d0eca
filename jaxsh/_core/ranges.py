"""Stretches of indices, put in a row."""

import numpy as np
from jaxtyping import Int


def ranges(first: Int[np.ndarray, " n"], counts: Int[np.ndarray, " n"]) -> Int[np.ndarray, " m"]:
    """Put `first`, `first + 1`, …, so many as `counts` says, in a row for all."""
    begin = np.cumsum(counts) - counts
    return np.arange(int(counts.sum())) + np.repeat(first - begin, counts)
