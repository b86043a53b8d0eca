"""The least window that leaves a light without negative values."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from ._basis import evaluate
from ._checks import as_float
from ._indexing import degree_of, degrees, orders
from ._tables import legendre
from ._windows import damping

# Rounds of the search for the least strength, and halvings in each: past a float64's digits.
_CUTS, _HALVINGS = 16, 60


def dering(
    coefficients: Float[ArrayLike, "*batch k"],
) -> tuple[Float[Array, "*batch k"], Float[Array, "*batch"]]:
    """The least `damping` that leaves a function without negative values, and its strength.

    Each function of the batch, each colour channel too, gets a window of its own: for one window
    over the channels, use `damping` with the largest of their strengths.

    What is left below zero is under 1e-3 of the mean, and mostly far under. A function without
    negative values is returned as it is, with strength 0; one whose mean is not positive cannot be
    helped and keeps nothing but its mean, with strength infinity. Differentiable: the strength by
    the implicit function theorem, with a kink where it reaches zero or the darkest direction
    changes.
    """
    coefficients = as_float(coefficients)
    degree = degree_of(coefficients.shape[-1] if coefficients.ndim else 0)
    rows = coefficients.reshape(-1, coefficients.shape[-1])
    strength = jax.vmap(functools.partial(_least_strength, degree=degree))(rows)
    strength = strength.reshape(coefficients.shape[:-1])
    return coefficients * damping(strength, degree), strength


@functools.partial(jax.jit, static_argnames="degree")
def _least_strength(coefficients: Float[Array, " k"], degree: int) -> Float[Array, ""]:
    """Cutting planes: the least strength for the darkest direction, until none is dark."""

    def bands(coefficients, direction):
        return _band_sums(coefficients * evaluate(direction, degree), degree)

    def at(strength, bands):
        return jnp.dot(_band_window(strength, degree), bands)

    def cut(_, state):
        strength, _ = state
        direction = _darkest(constant * damping(strength, degree), degree)
        return _root(at, bands(constant, direction), strength), direction

    constant = jax.lax.stop_gradient(coefficients)
    zero, anywhere = jnp.zeros((), coefficients.dtype), jnp.zeros(3, coefficients.dtype)
    strength, direction = jax.lax.fori_loop(0, _CUTS, cut, (zero, anywhere))
    # Nothing of the search is differentiated. One Newton step, zero in value, carries the
    # derivative of the root: dλ = -dg / (∂g/∂λ).
    slope = jax.lax.stop_gradient(jax.grad(at)(strength, bands(constant, direction)))
    value = at(jax.lax.stop_gradient(strength), bands(coefficients, direction))
    step = (value - jax.lax.stop_gradient(value)) / jnp.where(slope > 0, slope, 1)
    regular = (strength > 0) & jnp.isfinite(strength) & (slope > 0)
    return jnp.where(regular, strength - step, strength)


def _root(at, bands: Float[Array, " bands"], low: Float[Array, ""]) -> Float[Array, ""]:
    """Least strength from `low` on at which the window leaves a direction's value not negative."""
    mean, swing = bands[0], jnp.sum(jnp.abs(bands[1:]))
    # On every band above the mean the window is at most 1/(4·strength): this much is enough.
    enough = jnp.where(mean > 0, swing / (4 * jnp.where(mean > 0, mean, 1)), jnp.inf)

    def halve(_, bounds):
        low, high = bounds
        middle = (low + high) / 2
        negative = at(middle, bands) < 0
        return jnp.where(negative, middle, low), jnp.where(negative, high, middle)

    _, high = jax.lax.fori_loop(0, _HALVINGS, halve, (low, jnp.maximum(enough, low)))
    return jnp.where(at(low, bands) < 0, high, low)


def _darkest(coefficients: Float[Array, " k"], degree: int) -> Float[Array, " 3"]:
    """Direction of the least value: on a grid, then on ever smaller patches around it."""
    rings = 6 * degree + 8
    theta = (np.arange(rings) + 0.5) * np.pi / rings
    phi = np.arange(2 * rings) * np.pi / rings
    m = np.arange(-degree, degree + 1)[:, None]
    azimuth = np.where(m < 0, np.sin(-m * phi), np.cos(m * phi)).astype(coefficients.dtype)
    meridians = legendre(np.cos(theta), degree).astype(coefficients.dtype)
    by_order = jax.ops.segment_sum(
        coefficients[:, None] * meridians, orders(degree) + degree, len(azimuth)
    )
    samples = jnp.matmul(by_order.T, azimuth, precision="highest")
    ring, step = jnp.unravel_index(jnp.argmin(samples), samples.shape)
    dtype = coefficients.dtype
    polar, around = jnp.asarray(theta, dtype)[ring], jnp.asarray(phi, dtype)[step]
    direction = jnp.stack(
        [jnp.sin(polar) * jnp.cos(around), jnp.sin(polar) * jnp.sin(around), jnp.cos(polar)]
    )
    u, v = np.meshgrid(*2 * [np.linspace(-1, 1, 9)])
    patch = np.stack([u.ravel(), v.ravel()], axis=-1)
    for scale in (theta[0], theta[0] / 4, theta[0] / 16):  # half a step of the grid, and finer
        # Any two directions that span the tangent plane will do.
        axis = jnp.eye(3, dtype=dtype)[jnp.argmin(jnp.abs(direction))]
        side = jnp.cross(direction, axis)
        tangents = jnp.stack([side, jnp.cross(direction, side)])
        tangents = tangents / jnp.linalg.norm(side)
        nearby = direction[None] + jnp.asarray(scale * patch, dtype) @ tangents
        nearby = nearby / jnp.linalg.norm(nearby, axis=-1, keepdims=True)
        values = jnp.matmul(coefficients, evaluate(nearby, degree, axis=0), precision="highest")
        direction = nearby[jnp.argmin(values)]
    return direction


def _band_window(strength: Float[Array, ""], degree: int) -> Float[Array, " bands"]:
    return damping(strength, degree)[np.arange(degree + 1, dtype=np.int32) ** 2]


def _band_sums(terms: Float[Array, " k"], degree: int) -> Float[Array, " bands"]:
    return jax.ops.segment_sum(terms, degrees(degree), degree + 1, indices_are_sorted=True)
