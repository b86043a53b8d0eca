"""Vectors whose x, y and z are rows along many receivers: (..., 3, n), and numbers (..., n)."""

import jax
import jax.numpy as jnp
from jaxtyping import Array


def dot(a: Array, b: Array) -> Array:
    """Written out: XLA's reductions over three rows are slow on the CPU."""
    return sum((a[..., i, :] * b[..., i, :] for i in (1, 2)), a[..., 0, :] * b[..., 0, :])


def cross(a: Array, b: Array) -> Array:
    (ax, ay, az), (bx, by, bz) = ([v[..., i, :] for i in range(3)] for v in (a, b))
    return jnp.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-2)


def close_cross(a: Array, b: Array) -> Array:
    """a × b of almost parallel vectors: in float32 to 2^-36 |a| |b|, where `cross` has 2^-24.

    Components in two halves of twelve bits, whose products are exact, fused with sums or not.
    """
    if a.dtype != jnp.float32:
        return cross(a, b)
    high, low = cross_high(a, b)
    return high + low


def cross_high(a: Array, b: Array) -> tuple[Array, Array]:
    """a × b in two parts: of the upper halves of the components, and what they leave."""
    (a_high, a_low), (b_high, b_low) = _halves(a), _halves(b)
    return cross(a_high, b_high), cross(a_high, b_low) + cross(a_low, b)


def _halves(a: Array) -> tuple[Array, Array]:
    bits = jax.lax.bitcast_convert_type(jax.lax.stop_gradient(a), jnp.uint32)
    high = jax.lax.bitcast_convert_type(bits & jnp.uint32(0xFFFFF000), jnp.float32)
    return high, a - high


def difference(a: Array, b: Array) -> tuple[Array, Array]:
    """a - b as a float, and what its rounding leaves (Knuth's sum of two numbers)."""
    rounded = a - b
    virtual = rounded - a
    rest = (a - (rounded - virtual)) - (b + virtual)
    return rounded, jax.lax.stop_gradient(rest)


def close_dot(a: Array, b: Array) -> Array:
    """a·b of almost square vectors, as `close_cross`; not differentiable."""
    if a.dtype != jnp.float32:
        return dot(a, b)
    (a_high, a_low), (b_high, b_low) = _halves(a), _halves(b)
    x, y, z = (a_high[..., i, :] * b_high[..., i, :] for i in range(3))
    both, rest = difference(x, -y)
    total, left = difference(both, -z)
    return total + (rest + left + dot(a_high, b_low) + dot(a_low, b))


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


def inverse_power(length: Array) -> Array:
    """A constant power of two close to 1/length: to change the unit of length, rounding nothing."""
    _, exponent = jnp.frexp(jax.lax.stop_gradient(length))
    most = jnp.finfo(length.dtype).maxexp - 2
    return jnp.ldexp(jnp.ones_like(length), -jnp.clip(exponent, -most, most))


def unit(a: Array) -> Array:
    """a/|a|, and zero for zero."""
    return scale(inverse_length(a), a)


Components = tuple[Array, Array, Array]


def component_dot(a: Components, b: Components) -> Array:
    """Multiply vectors given as three arrays x, y and z, of any shape."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
