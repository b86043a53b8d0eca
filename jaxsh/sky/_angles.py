"""The angles that sky models speak of, from directions, with derivatives that stay finite."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, as_float


class Angles(NamedTuple):
    """θ of view and sun from +z, γ between the two; shapes broadcast."""

    cos_view: Float[Array, "..."]
    cos_sun: Float[Array, "..."]
    theta_sun: Float[Array, "..."]
    gamma: Float[Array, "..."]
    cos_gamma: Float[Array, "..."]


def angles(view: Float[Array, "*views 3"], sun: Float[Array, "*suns 3"]) -> Angles:
    """Of vectors of any nonzero length.

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
    """As a floating-point array, or a `ValueError` that says which input has the wrong shape."""
    array = as_float(value)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"expected {name} (..., 3) with x, y, z last, got shape {array.shape}")
    return array


def parameter(value: Float[ArrayLike, "*batch"], dtype) -> Float[Array, "*batch"]:
    """A model's number, one per sun, in the directions' dtype."""
    return as_float(value).astype(dtype)


def unit(vector: Float[Array, "*batch 3"]) -> Float[Array, "*batch 3"]:
    x, y, z = (vector[..., i] for i in range(3))
    return vector / jnp.sqrt(x * x + y * y + z * z)[..., None]


def length(*components: Float[Array, "..."]) -> Float[Array, "..."]:
    """√Σ c², zero with derivative zero where all are."""
    squared = sum(c * c for c in components)
    positive = squared > 0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, squared, 1)), 0)
