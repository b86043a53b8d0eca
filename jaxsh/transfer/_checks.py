"""What shading is given, looked at before it is traced."""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_float
from ..harmonics import degree_of
from ._material import Material


def checked_light(
    light: Float[ArrayLike, "..."], count: int, degree: int, dtype: jnp.dtype
) -> Float[Array, "..."]:
    """A light that all of `count` vertices share, or one for each, of at most this degree."""
    light = as_float(light)
    lights = light.shape[:-2][-1:]  # () where all vertices share one
    if light.ndim < 2 or light.shape[-2] != 3 or lights not in ((), (1,), (count,)):
        raise ValueError(
            f"expected light (3, K), or (..., {count}, 3, K) with one for each vertex, or "
            f"(..., 1, 3, K) for a batch of shared ones, got shape {light.shape}"
        )
    if degree_of(light.shape[-1]) > degree:
        raise ValueError(
            f"the light's degree {degree_of(light.shape[-1])} is above the transfer's, {degree}; "
            f"cut it to light[..., :{(degree + 1) ** 2}]"
        )
    return _cast(light, dtype)


def checked_material(material: Material, count: int, dtype: jnp.dtype) -> Material:
    """A material whose arrays per vertex are of `count` vertices."""
    for name, ndim in (("diffuse", 2), ("specular", 2), ("exponent", 1)):
        array = getattr(material, name)
        if array.ndim == ndim and len(array) != count:
            raise ValueError(
                f"expected a material of {count} vertices, but its {name} is of {len(array)}"
            )
    arrays = (material.diffuse, material.specular, material.exponent)
    if all(array.dtype == dtype for array in arrays):
        return material
    return Material(*(array.astype(dtype) for array in arrays))


def checked_eye(eye: Float[ArrayLike, "..."], dtype: jnp.dtype) -> Float[Array, " 3"]:
    eye = as_float(eye)
    if eye.shape != (3,):
        raise ValueError(f"expected eye (3,), got shape {eye.shape}")
    return _cast(eye, dtype)


def _cast(array: Array, dtype: jnp.dtype) -> Array:
    # To cast to the same type does nothing, but takes time of every frame.
    return array if array.dtype == dtype else array.astype(dtype)
