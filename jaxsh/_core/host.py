"""Facts about the machine that runs Python."""

import functools
import math
import os

import jax
import numpy as np
from jaxtyping import DTypeLike

_ALIGNMENT = 64  # bytes, of XLA's arrays on a CPU


def cores() -> int:
    """The cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def aligned(shape: tuple[int, ...], dtype: DTypeLike) -> np.ndarray:
    """Make room for an array where JAX takes it over on a CPU without a copy.

    By `jax.device_put`, that is, and as long as nobody writes into it.
    """
    size = math.prod(shape) * np.dtype(dtype).itemsize
    room = np.empty(size + _ALIGNMENT, np.uint8)
    start = -room.ctypes.data % _ALIGNMENT
    return room[start : start + size].view(dtype).reshape(shape)


def put(array: np.ndarray, dtype: DTypeLike | None = None) -> jax.Array:
    """Copy to JAX's default device, in JAX's kind of this dtype, without a program.

    `jnp.asarray` does the same by a program of its own for each shape and dtype, which takes 6 to
    9 ms to compile.
    """
    kind = jax.dtypes.canonicalize_dtype(array.dtype if dtype is None else dtype)
    room = aligned(array.shape, kind)
    if room.dtype == array.dtype:
        room[...] = array
    else:
        with np.errstate(over="ignore", invalid="ignore"):  # as XLA converts
            np.copyto(room, array, casting="unsafe")
    return jax.device_put(room)


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
