"""Vectors whose x, y and z are rows along many receivers: (..., 3, n), and numbers (..., n)."""

import jax.numpy as jnp
from jaxtyping import Array


def dot(a: Array, b: Array) -> Array:
    """Written out: XLA's reductions over three rows are slow on the CPU."""
    return sum((a[..., i, :] * b[..., i, :] for i in (1, 2)), a[..., 0, :] * b[..., 0, :])


def cross(a: Array, b: Array) -> Array:
    (ax, ay, az), (bx, by, bz) = ([v[..., i, :] for i in range(3)] for v in (a, b))
    return jnp.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-2)


def scale(factor: Array, a: Array) -> Array:
    return factor[..., None, :] * a


def select(mask: Array, a: Array, b: Array) -> Array:
    return jnp.where(mask[..., None, :], a, b)


def reciprocal(value: Array) -> Array:
    """1/value, and zero (with zero slope) where that would not be finite."""
    fits = jnp.abs(value) > jnp.finfo(value.dtype).tiny
    return jnp.where(fits, 1 / jnp.where(fits, value, 1), 0)


def inverse_length(a: Array) -> Array:
    """1/|a|, and zero for zero."""
    squared = dot(a, a)
    fits = squared > jnp.finfo(squared.dtype).tiny
    return jnp.where(fits, jnp.sqrt(1 / jnp.where(fits, squared, 1)), 0)


def unit(a: Array) -> Array:
    """a/|a|, and zero for zero."""
    return scale(inverse_length(a), a)


Components = tuple[Array, Array, Array]


def component_dot(a: Components, b: Components) -> Array:
    """Multiply vectors given as three arrays x, y and z, of any shape."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
