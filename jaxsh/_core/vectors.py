"""Unit vectors from vectors of any length, and matrices that turn them."""

import math

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .checks import as_float
from .known import is_concrete


def components_first(vectors: Float[Array, "*batch 3"]) -> Float[Array, "3 1 n"]:
    return vectors.reshape(-1, 3).T[:, None]


@jax.custom_jvp
def normalize(s: Float[Array, "3 a b"]) -> tuple[Float[Array, "3 a b"], Float[Array, "a b"]]:
    """Unit vectors and the reciprocals of the vectors' lengths, components first.

    Sums are written out and √(1/a) is not 1/√a: on the CPU, XLA's reductions over three rows and
    its reciprocal square root in float64 each cost more than all the rest.
    """
    # A length whose square would over- or underflow is none the less a length, so the largest
    # component is taken out; after a power of two, since the reciprocal of a very large one would
    # itself be flushed to zero.
    x, y, z = jnp.abs(s)
    largest = jnp.maximum(jnp.maximum(x, y), z)
    power = 2.0 ** (jnp.finfo(s.dtype).maxexp // 2)
    power = jnp.where(largest > 1, jnp.asarray(1 / power, s.dtype), jnp.asarray(power, s.dtype))
    scaled = (s * power[None]) / (largest * power)[None]
    inverse = jnp.sqrt(1 / _dot(scaled, scaled))
    return scaled * inverse[None], inverse / largest


@normalize.defjvp
def _normalize_jvp(primals, tangents):
    unit, inverse_length = normalize(*primals)
    (tangent,) = tangents
    along = _dot(unit, tangent)
    # Component by component, so that the transpose has no sums over three rows either.
    turned = [(t - u * along) * inverse_length for t, u in zip(tangent, unit, strict=True)]
    return (unit, inverse_length), (jnp.stack(turned), -(along * inverse_length) * inverse_length)


def _dot(a: Float[Array, "3 a b"], b: Float[Array, "3 a b"]) -> Float[Array, "a b"]:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def checked_rotation(rotation: ArrayLike) -> Float[Array, "*batch 3 3"]:
    """Convert to orthogonal matrices; raises `ValueError` for what is known to be none."""
    rotation = as_float(rotation, "rotation")
    if rotation.shape[-2:] != (3, 3):
        raise ValueError(f"expected rotation (..., 3, 3), matrices, got shape {rotation.shape}")
    if is_concrete(rotation):
        matrix = np.asarray(rotation, np.float64)
        error = math.nan
        if np.isfinite(matrix).all():
            error = np.max(np.abs(matrix @ np.swapaxes(matrix, -1, -2) - np.eye(3)), initial=0.0)
        if not error <= 1e-3:
            raise ValueError(
                f"expected rotation as orthogonal matrices, but R Rᵀ is off the identity by "
                f"{error:.1e}"
            )
    return rotation
