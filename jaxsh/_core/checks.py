"""Argument checks: one sentence that says what was expected and what came."""

import math
import operator

import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float


def as_float(value: ArrayLike) -> Float[Array, "..."]:
    """Convert to a floating-point JAX array; integers become JAX's default float."""
    # What is a JAX array already is looked at in every frame.
    array = value if isinstance(value, Array) else jnp.asarray(value)
    if jnp.issubdtype(array.dtype, jnp.floating):
        return array
    if jnp.issubdtype(array.dtype, jnp.integer):
        return array.astype(jnp.result_type(float))
    raise ValueError(f"expected real numbers, got dtype {array.dtype}")


def is_concrete(value: Array) -> bool:
    """True outside of tracing, where a value can be looked at at no cost to compiled code."""
    return not isinstance(value, Tracer)


def align(*arrays: Array) -> tuple[Array, ...]:
    """Leading axes of length 1 for those of lower rank, so that batches broadcast.

    Said out loud, since under `jax_numpy_rank_promotion="raise"` JAX does not do it silently.
    """
    ndim = max(array.ndim for array in arrays)
    return tuple(array.reshape((1,) * (ndim - array.ndim) + array.shape) for array in arrays)


def check_batches(**shapes: tuple[int, ...]) -> None:
    """Raises `ValueError` unless the leading axes of all arrays, named for the user, broadcast."""
    try:
        np.broadcast_shapes(*(shape[:-1] for shape in shapes.values()))
    except ValueError:
        said = " and ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ValueError(f"leading axes must broadcast, got {said}") from None


def flatten_batch(array: Float[Array, "*batch n"]) -> Float[Array, "rows n"]:
    """All leading axes as one, an empty one too, whose size `reshape` could not infer."""
    return array.reshape(math.prod(array.shape[:-1]), array.shape[-1])


def check_degree(degree: int) -> int:
    """The degree as a Python int, or a `ValueError` that says what was expected."""
    try:
        value = operator.index(degree)
    except TypeError:
        value = -1
    if value < 0 or isinstance(degree, bool):
        raise ValueError(f"degree must be an integer >= 0 known at trace time, got {degree!r}")
    return value


def check_size(name: str, value: int, least: int = 1) -> int:
    """The size as a Python int; raises `ValueError` unless it is an integer >= `least`."""
    try:
        size = operator.index(value)
    except TypeError:
        size = least - 1
    if size < least:
        raise ValueError(f"{name} must be an integer >= {least}, got {value!r}")
    return size
