"""Facts about values: known while tracing, at hand, or on the host."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array


def is_concrete(value: Any) -> bool:
    """True where a value can be looked at: not traced, and not held by other processes."""
    if isinstance(value, Tracer):
        return False
    return not isinstance(value, jax.Array) or value.is_fully_addressable


def at_hand(array: Array) -> bool:
    """True where an array can be looked at and is on a CPU."""
    return is_concrete(array) and next(iter(array.devices())).platform == "cpu"


def on_host(value: Any) -> np.ndarray | None:
    """The plain numbers of a NumPy array, or of a list or tuple of Python's, else None.

    Those may be checked where they are, and copied to a device by `put`.
    """
    if isinstance(value, list | tuple):
        if not all(type(leaf) in (int, float) for leaf in jax.tree.leaves(value)):
            return None
        value = np.asarray(value)  # raises `ValueError` for lists of several lengths
    elif type(value) is not np.ndarray:
        return None
    if value.dtype.kind not in "fiu" or value.dtype.itemsize > 8:
        return None
    # Of another byte order, as files of FITS have it, JAX takes none.
    return value.astype(value.dtype.newbyteorder("="), copy=False)


def host_known(*arrays: Array | np.ndarray | None) -> bool:
    """True where what little is to be computed of arrays may be in NumPy, without a program.

    That is of known values of NumPy's own types, on one CPU device; None counts as one.
    """
    return all(
        array is None
        or (
            array.dtype in (jnp.float32, jnp.float64, jnp.int32, bool)
            and (isinstance(array, np.ndarray) or (at_hand(array) and len(array.devices()) == 1))
        )
        for array in arrays
    )
