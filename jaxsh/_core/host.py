"""Facts about the machine that runs Python."""

import functools
import os

import jax
import numpy as np


def cores() -> int:
    """The cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def read_only_cache(maxsize: int | None = 32):
    """`functools.lru_cache` for host constants: the NumPy arrays of a result cannot be written to.

    A result is shared by all callers, so that writing into it would change every later one.
    """

    def decorate(function):
        @functools.lru_cache(maxsize=maxsize)
        @functools.wraps(function)
        def cached(*arguments, **keywords):
            result = function(*arguments, **keywords)
            for array in jax.tree.leaves(result):
                if isinstance(array, np.ndarray):
                    array.setflags(write=False)
            return result

        return cached

    return decorate
