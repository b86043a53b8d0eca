"""Argument checks: one sentence that says what was expected and what came."""

import math
import operator
import os
import weakref
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float, Int

from .host import put
from .known import at_hand, is_concrete, on_host
from .words import article, described, nearest, said_dtype

# A light, an eye, a few thousand albedos: looking at more would take time of every call.
_FEW = 2**16
_SHORT = 256
_ON_HOST = "this runs on the host, before jit, vmap and grad"
# What floats of any size hold.
_HELD = 65504.0
_LARGEST = float(np.finfo(np.float32).max)
# The JAX array that was last found right for a name, a dtype and a bound: arrays do not change.
_right: dict[tuple[Any, ...], weakref.ref[Any]] = {}


def as_float(value: Any, name: str = "") -> Float[Array, "..."]:
    """Convert to a floating-point JAX array; integers become JAX's default float.

    Raises `ValueError` for what is no array of real numbers, and for integers of 8 and 16 bits:
    those are the codes of a picture, which mean nothing as they are.
    """
    if type(value) is int:  # JAX's integers may be too short for it
        value = np.asarray(as_double(name or "a number", value), jnp.result_type(float))
    # What is a JAX array already is looked at in every frame.
    array = value if isinstance(value, Array) else _as_array(value, name)
    if jnp.issubdtype(array.dtype, jnp.floating):
        return array if isinstance(array, Array) else put(array)
    if not jnp.issubdtype(array.dtype, jnp.integer):
        raise ValueError(f"expected real numbers{_for(name)}, got dtype {array.dtype}")
    if array.dtype.itemsize < 4:
        raise ValueError(f"expected real numbers{_for(name)}, got dtype {said_dtype(array.dtype)}")
    if isinstance(array, Array):
        return array.astype(jnp.result_type(float))
    return put(array, jnp.result_type(float))


def as_integer(value: Any, name: str) -> Int[Array, "..."]:
    """Convert to an array of integers; raises `ValueError` for anything else."""
    array = value if isinstance(value, Array) else _as_array(value, name)
    if jnp.issubdtype(array.dtype, jnp.integer):
        return array if isinstance(array, Array) else put(array)
    raise ValueError(f"expected integers for {name}, got dtype {array.dtype}")


def as_path(value: Any, name: str = "path") -> Path:
    """Convert to a path; raises `TypeError` for what is none, `ValueError` for what no file has."""
    if isinstance(value, str | os.PathLike) and value != "":
        if "\0" in str(value):
            raise ValueError(f"expected {name} without a zero byte, got {value!r}")
        return Path(value)
    raise TypeError(f"expected {name} as a string or a path, got {described(value)}")


def as_host_float(value: Any, name: str) -> Float[np.ndarray, "..."]:
    """Convert to floating point on the host, integers to float64.

    Raises `ValueError` for what is traced or no real numbers.
    """
    array = _as_host_array(value, name, "real numbers")
    if array.dtype.kind in "iu" and array.dtype.itemsize < 4:
        raise ValueError(f"expected real numbers for {name}, got dtype {said_dtype(array.dtype)}")
    if jnp.issubdtype(array.dtype, jnp.floating):
        return array
    if array.dtype.kind in "iu":
        return array.astype(np.float64)
    raise ValueError(f"expected real numbers for {name}, got {described(value)}")


def as_host_integer(value: Any, name: str) -> Int[np.ndarray, "..."]:
    """Convert to integers on the host; raises `ValueError` for what is traced or none."""
    array = _as_host_array(value, name, "integers")
    if array.dtype.kind not in "iu":
        raise ValueError(f"expected integers for {name}, got {described(value)}")
    return array


def _as_host_array(value: Any, name: str, wanted: str) -> np.ndarray:
    check_known(name, value)
    try:
        return np.asarray(value)
    except (TypeError, ValueError, OverflowError):  # lists of several lengths
        raise ValueError(f"expected {wanted} for {name}, got {described(value)}") from None


def check_known(name: str, value: Any) -> None:
    """Raises `ValueError` where the value, or a leaf of it, is traced."""
    if any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(value)):
        raise ValueError(f"expected known values for {name}, got traced ones: {_ON_HOST}")


def as_finite(
    value: Any, name: str, *, dtype: Any = None, least: float | None = None, wait: bool = False
) -> Float[Array, "..."]:
    """Convert as `as_float` does, or to a dtype, and check as `check_finite` does for that."""
    if type(value) in (int, float):  # of which JAX would make infinity with a warning
        value = as_double(name, value)
        check_finite(name, value, dtype=jnp.result_type(float) if dtype is None else dtype)
    array = as_float(value, name)
    dtype = array.dtype if dtype is None else dtype
    # What was given on the host is looked at there, wherever its copy goes.
    on_host = not isinstance(value, Array) and (
        isinstance(value, np.ndarray | float)
        or not any(isinstance(leaf, jax.Array) for leaf in jax.tree.leaves(value))
    )
    check_finite(name, value if on_host else array, dtype=dtype, least=least, wait=wait)
    # To cast to the same type does nothing, but takes time of every frame.
    return array if array.dtype == dtype else array.astype(dtype)


def check_finite(
    name: str, value: Any, *, dtype: Any = None, least: float | None = None, wait: bool = False
) -> None:
    """Raises `ValueError` where a value that is at hand is NaN, infinite or below `least`.

    So does one that is infinite in the `dtype` which it is to be converted to.

    At hand are arrays of up to 65,536 numbers on the host or on CPU devices of this process. With
    `wait`, for what is made once, also larger ones and those on an accelerator, which has to finish
    them first. What is traced is not looked at, nor a JAX array that came for this name the last
    time. `tools/measure_checks.py` prints what that costs a call.
    """
    if isinstance(value, float) and abs(value) <= _HELD and (least is None or value >= least):
        return
    if isinstance(value, Array):
        last = _right.get((name, dtype, least))
        if last is not None and last() is value:
            return
        if not (is_concrete(value) if wait else at_hand(value)):
            return
    array = given = np.asarray(value)
    if array.size > _FEW and not wait:
        return
    if dtype is not None and array.dtype != dtype:
        with np.errstate(over="ignore", invalid="ignore"):
            array = array.astype(dtype)
    if not _fine(array, least):
        places = ~(np.isfinite(array) & (True if least is None else array >= least))
        wrong = given[places]
        became = np.isfinite(wrong[0]) and not np.isfinite(array[places][0])
        bound = f" in {array.dtype}" if became else ""
        bound += "" if least is None else f" and >= {least:g}"
        where = f" in {wrong.size} of {array.size} places" if array.ndim else ""
        raise ValueError(f"{name} must be finite{bound}, got {wrong.flat[0]:g}{where}")
    if isinstance(value, Array):
        _right[name, dtype, least] = weakref.ref(value)


def _fine(array: np.ndarray, least: float | None) -> bool:
    if array.size <= _SHORT:  # Python's own sum is faster there; NaN and infinity stay in it
        numbers = array.ravel().tolist()
        if math.isfinite(sum(numbers)):
            return least is None or min(numbers, default=least) >= least
    if least is None:
        return bool(np.isfinite(array).all())
    # Two reductions are faster than three; comparisons with NaN are false.
    return bool(array.min() >= least and array.max() < math.inf)


def _as_array(value: Any, name: str) -> Array | np.ndarray:
    try:
        plain = on_host(value)
        return jnp.asarray(value) if plain is None else plain
    except (TypeError, ValueError, OverflowError) as error:
        if isinstance(error, jax.errors.JAXTypeError):  # of tracing
            raise
        raise ValueError(f"expected real numbers{_for(name)}, got {described(value)}") from None


def check_type(name: str, value: Any, *classes: type) -> None:
    """Raises `TypeError` unless a value is of one of the classes."""
    if not isinstance(value, classes):
        wanted = " or ".join(f"{article(c.__name__)} {c.__name__}" for c in classes)
        raise TypeError(f"expected {name} as {wanted}, got {described(value)}")


def check_all(name: str, values: Any, *classes: type, least: int = 1) -> None:
    """Raises unless values are a list or a tuple of at least `least` of one of the classes."""
    wanted = " or ".join(c.__name__ for c in classes)
    if not isinstance(values, list | tuple):
        raise TypeError(f"expected {name} as a list or tuple of {wanted}, got {described(values)}")
    if len(values) < least:
        raise ValueError(f"expected {name} as at least {least} of {wanted}, got {len(values)}")
    for value in values:
        if not isinstance(value, classes):
            raise TypeError(f"expected {name} as all of {wanted}, got {described(value)}")


def check_faces(whose: str, faces: np.ndarray, count: int) -> None:
    """Raises `ValueError` where faces name other vertices than 0 to `count` - 1."""
    if faces.size and not 0 <= faces.min() <= faces.max() < count:
        raise ValueError(
            f"faces of {whose} name vertices {faces.min()} to {faces.max()}, but it has 0 to "
            f"{count - 1}"
        )


def check_function(name: str, value: Any) -> None:
    """Raises `TypeError` unless a value can be called."""
    if not callable(value):
        raise TypeError(f"expected {name} as a function, got {described(value)}")


def check_choice(name: str, value: Any, options: Iterable[Any]) -> None:
    """Raises `ValueError` that names the nearest option unless a value is one of them."""
    options = tuple(options)
    # A string, first: an array is neither equal to one nor unequal.
    if isinstance(value, str) and value in options:
        return
    said = ", ".join(map(str, options))
    raise ValueError(
        f"{name} must be one of {said}, got {described(value)}{nearest(value, options)}"
    )


def check_options(name: str, options: Iterable[str], known: Iterable[str]) -> None:
    """Raises `TypeError` that names the nearest option for one that a function does not have."""
    known = tuple(known)
    for option in options:
        if option not in known:
            near = nearest(option, known) or f"; it has {', '.join(known)}"
            raise TypeError(f"{name} has no option {option!r}{near}")


def check_flag(name: str, value: Any) -> bool:
    """The flag as a Python bool; raises `ValueError` unless it is True or False."""
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise ValueError(f"{name} must be True or False, got {described(value)}")


def check_number(
    name: str,
    value: Any,
    *,
    least: float = -math.inf,
    most: float = math.inf,
    above: float = -math.inf,
    infinite: bool = False,
) -> float:
    """A Python number known at trace time; raises `ValueError` where it is none or out of range.

    Finite is what float32 holds, since most numbers meet arrays of float32.
    """
    number = None
    if isinstance(value, int | float | np.number) and not isinstance(
        value, bool | np.complexfloating
    ):
        number = as_double(name, value)
    elif isinstance(value, np.ndarray | jax.Array) and is_concrete(value):
        number = float(value) if value.ndim == 0 and value.dtype.kind in "fiu" else None
    if number is None or not (least <= number <= most and number > above):
        bounds = [f">= {least:g}"] if least > -math.inf else []
        bounds += [f"> {above:g}"] if above > -math.inf else []
        bounds += [f"<= {most:g}"] if most < math.inf else []
        range_ = f" {' and '.join(bounds)}" if bounds else ""
        raise ValueError(f"{name} must be a number{range_}, got {described(value)}")
    if not infinite and abs(number) > _LARGEST:
        kind = "" if math.isinf(number) else " in float32"
        raise ValueError(f"{name} must be finite{kind}, got {described(value)}")
    return number


def as_double(name: str, value: Any) -> float:
    """The number in float64; raises `ValueError` for an integer beyond it."""
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{name} must be finite in float64, got {described(value)}") from None


def check_cosine(transfer: Any) -> None:
    """Raises `ValueError` for the transfer of points without normals, which no surface shades."""
    if not transfer.cosine:
        raise ValueError(
            "expected a transfer with the cosine of a surface, got that of points without normals, "
            "which transfer.fluence takes"
        )


def align(*arrays: Array) -> tuple[Array, ...]:
    """Leading axes of length 1 for those of lower rank, so that batches broadcast.

    Said out loud, since under `jax_numpy_rank_promotion="raise"` JAX does not do it silently.
    """
    ndim = max(array.ndim for array in arrays)
    return tuple(array.reshape((1,) * (ndim - array.ndim) + array.shape) for array in arrays)


def check_batches(**shapes: tuple[int, ...]) -> None:
    """Raises `ValueError` unless the leading axes of all arrays, named for the user, broadcast."""
    if sum(len(shape) > 1 for shape in shapes.values()) < 2:
        return
    try:
        np.broadcast_shapes(*(shape[:-1] for shape in shapes.values()))
    except ValueError:
        said = " and ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ValueError(f"leading axes must broadcast, got {said}") from None


def check_vectors(name: str, array: Array | np.ndarray) -> None:
    """Raises `ValueError` unless the last axis holds x, y and z."""
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"expected {name} (..., 3) with x, y, z last, got shape {array.shape}")


def check_coefficients(name: str, array: Array | np.ndarray) -> int:
    """The degree of functions (..., K); raises `ValueError` where K is not a square."""
    count = array.shape[-1] if array.ndim else 0
    bands = math.isqrt(count)
    if bands == 0 or bands**2 != count:
        raise ValueError(
            f"expected {name} (..., K) with K = (degree + 1)² = 1, 4, 9, 16, … coefficients on the "
            f"last axis, got shape {array.shape}"
        )
    return bands - 1


def flatten_batch(array: Float[Array, "*batch n"]) -> Float[Array, "rows n"]:
    """All leading axes as one, an empty one too, whose size `reshape` could not infer."""
    return array.reshape(math.prod(array.shape[:-1]), array.shape[-1])


def check_degree(degree: int, name: str = "degree") -> int:
    """The degree as a Python int, or a `ValueError` that says what was expected."""
    return _integer(name, degree, 0, " known at trace time")


def check_size(name: str, value: int, least: int = 1) -> int:
    """The size as a Python int; raises `ValueError` unless it is an integer >= `least`."""
    return _integer(name, value, least, "")


def _integer(name: str, value: Any, least: int, more: str) -> int:
    try:
        number = operator.index(value)
    except TypeError:
        number = least - 1
    if number < least or isinstance(value, bool):
        raise ValueError(f"{name} must be an integer >= {least}{more}, got {described(value)}")
    return number


def _for(name: str) -> str:
    return f" for {name}" if name else ""
