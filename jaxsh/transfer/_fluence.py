"""Shading of points without normals: light from all around, and nothing of a surface."""

import math
from typing import overload

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, check_type
from ._material import checked_light
from ._stored import StoredTransfer
from ._streamed import streamed_fluence
from ._transfer import AbstractTransfer


@overload
def fluence(light, transfer: StoredTransfer) -> Float[np.ndarray, "... v 3"]: ...


@overload
def fluence(light, transfer: AbstractTransfer) -> Float[Array, "... v 3"]: ...


def fluence(
    light: Float[ArrayLike, "... 3 k"], transfer: AbstractTransfer | StoredTransfer
) -> Float[Array | np.ndarray, "... v 3"]:
    """Compute what reaches each of V points of a volume from all around: ∫ V(ω) L(ω) dω.

    The fluence rate, without cosine and phase function: for light of radiance 1 from everywhere
    and nothing in its way it is 4π. A medium that scatters alike in all directions sends on its
    scattering coefficient times this, over 4π.

    **Arguments**

    - `light`: coefficients (3, K) that all points share, or with more axes (..., V, 3, K), one
      light for each point. So in a batch of shared lights an axis of length 1 takes the points'
      place: (batch, 1, 3, K).
    - `transfer`: of the light's degree or above, baked at `geometry.Points` without normals. A
      `StoredTransfer` is read block by block, the next while one is multiplied.

    **Returns** (..., V, 3), in the dtype of the transfer. Linear in light and coefficients, and
    differentiable in both, forward and reverse. For a `StoredTransfer` a NumPy array, without
    derivatives and outside `jit`.

    Raises `ValueError` for the transfer of a surface, which `shade_diffuse` takes, for shapes that
    do not fit, and for a light that is at hand (`docs/conventions.md`) and not finite.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import transfer
    >>> place, all_around = jnp.zeros((1, 3)), jnp.full((1, 1), (4 * jnp.pi) ** 0.5)
    >>> free = transfer.Transfer(
    ...     all_around, place, place, jnp.zeros((1, 1), int), surface="points", cosine=False
    ... )
    >>> sky = jnp.full((3, 1), (4 * jnp.pi) ** 0.5)  # radiance 1 from everywhere
    >>> round(float(transfer.fluence(sky, free)[0, 0] / jnp.pi), 4)
    4.0
    """
    check_type("transfer", transfer, AbstractTransfer, StoredTransfer)
    if transfer.cosine:
        raise ValueError(
            "expected the transfer of points without normals, got one with the cosine of a "
            "surface, which shade_diffuse takes"
        )
    light = checked_light(light, transfer.num_points, transfer.degree, transfer.dtype)
    if isinstance(transfer, StoredTransfer):
        return streamed_fluence(_received, light, transfer)
    return _received(light, transfer)


def received(light: Float[Array, "... 3 k"], transfer: AbstractTransfer) -> Float[Array, "... v 3"]:
    """Multiplies the transfer with a light that its points share, or with lights of their own."""
    if light.ndim == 2 or light.shape[-3] == 1:
        batch = light.shape[:-3]
        products = transfer.irradiances(light.reshape(math.prod(batch) * 3, light.shape[-1]))
        return jnp.moveaxis(products.reshape(len(products), *batch, 3), 0, -2)
    coefficients = transfer.vectors(light.shape[-1])
    return jnp.sum(jnp.multiply(*align(light, coefficients[:, None])), axis=-1)


_received = jax.jit(received)
