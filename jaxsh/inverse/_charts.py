"""Smooth maps from unconstrained to bounded parameters, with each bound at a finite place.

A solver of unbounded problems then meets none. Sines fold: beyond a bound the value comes back,
so that a value on the bound is reached, and is where the slope vanishes. (A sigmoid reaches its
bounds at infinity only, and clipping has no slope beyond them.) Close to a bound a fit converges
more slowly for it, no longer with twice the digits at each step.
"""

import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


def to_hemisphere(q: Float[Array, " 2"]) -> Float[Array, " 3"]:
    """Maps the plane onto the upper hemisphere: θ = π/2 · sin |q|, towards (q_x, q_y).

    Smooth, at the zenith (q = 0) too, where angles are not; the horizon is |q| = π/2.
    """
    squared = jnp.sum(q * q)
    near = squared < 1e-7  # the series' next term is below float64's rounding
    length = jnp.sqrt(jnp.where(near, 1, squared))
    theta = math.pi / 2 * jnp.sin(length)
    series = math.pi / 2 * (1 - squared * (1 + math.pi**2 / 4) / 6)
    aside = q * jnp.where(near, series, jnp.sin(theta) / length)
    up = jnp.where(near, 1 - math.pi**2 / 8 * squared, jnp.cos(theta))
    return jnp.append(aside, jnp.maximum(up, 0))  # π/2 has no exact cosine


def from_hemisphere(directions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
    """Inverts `to_hemisphere` for unit vectors."""
    radius = np.linalg.norm(directions[:, :2], axis=-1, keepdims=True)
    theta = np.arctan2(radius, directions[:, 2:])
    return directions[:, :2] / np.maximum(radius, 1e-300) * np.arcsin(2 / math.pi * theta)


def to_interval(p: Float[Array, "*p"], low: float, high: float) -> Float[Array, "*p"]:
    """Maps p into [low, high]: its middle and half its length times sin p."""
    return (low + high) / 2 + (high - low) / 2 * jnp.sin(p)


def tangents(direction: Float[Array, " 3"]) -> Float[Array, "2 3"]:
    """Finds two unit vectors square to a unit vector of the upper hemisphere, and to each other.

    Duff et al. 2017; smooth for z > -1.
    """
    x, y, z = direction
    a = 1 / (1 + z)
    b = -x * y * a
    return jnp.stack([jnp.stack([1 - x * x * a, b, -x]), jnp.stack([b, 1 - y * y * a, -y])])


def even_hemisphere(count: int) -> Float[np.ndarray, "n 3"]:
    """Directions along a spiral, from close to the zenith to close to the horizon."""
    n = np.arange(count)
    z, phi = 1 - (n + 0.5) / count, math.pi * (1 + math.sqrt(5)) * n
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(phi), radius * np.sin(phi), z], axis=-1)
