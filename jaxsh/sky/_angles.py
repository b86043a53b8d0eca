"""Angles of sky and sun from directions, with derivatives that stay finite."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, as_finite, as_float, check_finite, check_vectors
from .._core.xla import in_blocks, keep_batch, on_mesh
from ..harmonics import degrees, orders
from ._polynomials import circular


class Angles(NamedTuple):
    """Angles θ of view and sun from +z and γ between the two; shapes broadcast."""

    cos_view: Float[Array, "..."]
    cos_sun: Float[Array, "..."]
    theta_sun: Float[Array, "..."]
    gamma: Float[Array, "..."]
    cos_gamma: Float[Array, "..."]


def angles(view: Float[Array, "*views 3"], sun: Float[Array, "*suns 3"]) -> Angles:
    """Angles between vectors of any nonzero length, and their cosines.

    Both angles come from atan2, right to the last digits near 0 and π where acos is not. As
    functions of direction they have cone points, θ of the sun at the zenith and γ at the sun and
    the antisolar point: the derivative there is set to zero.
    """
    view, sun = align(unit(view), unit(sun))
    x, y, z = (view[..., i] for i in range(3))
    p, q, r = (sun[..., i] for i in range(3))
    cos_gamma = x * p + y * q + z * r
    sin_gamma = length(y * r - z * q, z * p - x * r, x * q - y * p)
    return Angles(z, r, jnp.atan2(length(p, q), r), jnp.atan2(sin_gamma, cos_gamma), cos_gamma)


def directions(value: Float[ArrayLike, "*batch 3"], name: str) -> Float[Array, "*batch 3"]:
    """Converts to floating point; raises `ValueError` that names an input of wrong shape."""
    array = as_finite(value, name)
    check_vectors(name, array)
    return array


def parameter(value: Float[ArrayLike, "*batch"], dtype, name: str) -> Float[Array, "*batch"]:
    """Converts a model's number, one per sun, to the directions' dtype."""
    return as_float(value, name).astype(dtype)


def kept(value: Float[ArrayLike, "..."], name: str) -> Float[Array | np.ndarray, "..."]:
    """Converts as `as_finite` does, but leaves on the host what is there.

    A jitted function takes NumPy's arrays as they are, faster than they are put on a device before.
    """
    if isinstance(value, np.ndarray | np.floating | float):
        array = np.asarray(value)
        # Of another byte order, `jit` would take the bytes for those of other numbers.
        if array.dtype.kind == "f" and array.dtype.itemsize <= 8 and array.dtype.isnative:
            check_finite(name, array, dtype=jax.dtypes.canonicalize_dtype(array.dtype))
            return array.astype(jax.dtypes.canonicalize_dtype(array.dtype), copy=False)
    return as_finite(value, name)


def each_sun(
    function: Callable[..., Any],
    sun: Float[Array, "*suns 3"],
    *numbers: Float[Array, "..."],
    size: int,
    most: int,
) -> Any:
    """Calls `function(sun, *numbers)` for each sun (3,) of a batch, with a scalar of each number.

    Suns (..., 3) and numbers (...) broadcast. On the CPU `size` suns at a time, on an accelerator
    at most `most` of them.
    """

    def all_of_one_axis(*arrays):
        each = jax.vmap(function)
        if on_mesh(arrays):  # in reverse, all is computed again rather than held, as in blocks
            each = jax.checkpoint(each)
        return in_blocks(each, *arrays, size=size, most=most)

    return over_one_axis(all_of_one_axis, sun, *numbers)


def over_one_axis(
    function: Callable[..., Any], sun: Float[Array, "*suns 3"], *numbers: Float[Array, "..."]
) -> Any:
    """Calls `function(suns, *numbers)`, which takes one axis (n, 3) and (n,), on a batch."""
    batch = jnp.broadcast_shapes(sun.shape[:-1], *(n.shape for n in numbers))

    def whole(*arrays):
        first, *rest = arrays
        arrays = widened((*batch, 3), first), *(widened(batch, n) for n in rest)
        if on_mesh(arrays) and batch:
            # Axis by axis: to make one axis of two would gather a sharded one.
            by_axis = function
            for _ in batch[1:]:
                by_axis = jax.vmap(by_axis)
            return by_axis(*arrays)
        count = math.prod(batch)
        done = function(*(array.reshape(count, *array.shape[len(batch) :]) for array in arrays))
        return jax.tree.map(lambda a: a.reshape(*batch, *a.shape[1:]), done)

    return keep_batch(whole, sun, *numbers, ndims=(1, *[0] * len(numbers)))


def widened(shape: tuple[int, ...], array: Float[Array, "..."]) -> Float[Array, "..."]:
    """Broadcasts to a shape of the same or a higher rank."""
    missing = len(shape) - array.ndim
    return jnp.broadcast_to(array.reshape((1,) * missing + array.shape), shape)


def unit(vector: Float[Array, "*batch 3"]) -> Float[Array, "*batch 3"]:
    x, y, z = (vector[..., i] for i in range(3))
    return vector / jnp.sqrt(x * x + y * y + z * z)[..., None]


def length(*components: Float[Array, "..."]) -> Float[Array, "..."]:
    """√Σ c²; zero, with derivative zero, where all components are zero."""
    squared = sum(c * c for c in components)
    positive = squared > 0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, squared, 1)), 0)


def zenith_angle(
    x: Float[Array, " n"], y: Float[Array, " n"], z: Float[Array, " n"]
) -> Float[Array, " n"]:
    """Angle θ of a unit vector: a cone point at the zenith, where the derivative is set to zero."""
    return jnp.atan2(length(x, y), z)


def squared_zenith_angle(
    x: Float[Array, " n"], y: Float[Array, " n"], z: Float[Array, " n"]
) -> Float[Array, " n"]:
    """Square θ² of the angle of a unit vector: smooth at the zenith, where θ is not."""
    squared = x * x + y * y
    near = (squared < 1e-5) & (z > 0)
    # arcsin² r; the first term left out, 4r⁸/35, is below float64's rounding here.
    series = squared * (1 + squared * (1 / 3 + squared * (8 / 45)))
    theta = jnp.atan2(jnp.sqrt(jnp.where(near, 1, squared)), z)
    return jnp.where(near, series, theta * theta)


def waves(
    x: Float[Array, " n"], y: Float[Array, " n"], degree: int, *, smooth: bool
) -> Float[Array, "k n"]:
    """Factors that turn coefficients from azimuth 0 to the sun's: cos mφ for m ≥ 0, else sin |m|φ.

    Habel et al. 2008, eq. 4, for a sky that is its own mirror image in the sun's meridian, so
    that all weights with m < 0 are zero at azimuth 0. `smooth` leaves the factor sin^|m| θ in:
    then these are the real and imaginary parts of (x + iy)^|m|, polynomials. Without it they have
    no limit at the zenith, which is given the azimuth 0.
    """
    if not smooth:
        radius = length(x, y)
        aside = radius > 0
        safe = jnp.where(aside, radius, 1)
        x, y = jnp.where(aside, x / safe, 1), y / safe
    return circular(x, y, degree)[orders(degree) + degree]


def half_rows(degree: int) -> np.ndarray:
    """Indices l(l+1) + m of the coefficients with m ≥ 0, in their order."""
    return np.flatnonzero(orders(degree) >= 0).astype(np.int32)


def row_of_each(degree: int) -> np.ndarray:
    """Places of (l, |m|) among `half_rows`, one for each of the K coefficients."""
    l, m = degrees(degree), orders(degree)
    return l * (l + 1) // 2 + np.abs(m)
