"""Transfer without shadows, in closed form and differentiable in the normals."""

import functools

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, Int

from .._core.checks import as_float, check_degree
from ..harmonics import convolve, evaluate, phong
from ._transfer import Transfer


def unshadowed(
    positions: Float[ArrayLike, "v 3"],
    normals: Float[ArrayLike, "v 3"],
    degree: int,
    *,
    neighbors: Int[ArrayLike, "v n"] | None = None,
) -> Transfer:
    """Make the transfer of V points that see all of the sphere above their own horizon.

    The coefficients are ∫ max(0, n·ω) y_lm(ω) dω = λ_l y_lm(n), exact at any degree (Ramamoorthi
    & Hanrahan 2001, "An efficient representation for irradiance environment maps", equations 4 to
    8; their A_l is λ_l here).

    **Arguments**

    - `positions`: where the points are; glossy shading asks for it, diffuse shading does not.
    - `normals`: of any length. Where one is zero or not finite, the coefficients are zero.
    - `degree`: of the coefficients.
    - `neighbors`: padded table as `geometry.neighbors` makes it, for the methods of `adaptive` that
      grow or smooth regions (default: no point has any).

    Differentiable in the normals, to any order, forward and reverse: unlike a bake's, these
    coefficients follow the normals, and so does all shading with them. Raises `ValueError` for
    shapes that do not fit.

    **Example**

    >>> import jax, jax.numpy as jnp
    >>> from jaxsh import transfer
    >>> up = jnp.asarray([[0.0, 0.0, 1.0]])
    >>> light = jnp.zeros((3, 4)).at[:, 2].set(1.0)  # brighter above
    >>> def leaving(normals):
    ...     return transfer.shade_diffuse(light, transfer.unshadowed(up, normals, 1), 0.5)[0, 0]
    >>> round(float(leaving(up)), 4)
    0.1629
    >>> [round(float(x), 4) for x in jax.grad(leaving)(up + jnp.asarray([[1.0, 0.0, 0.0]]))[0]]
    [-0.0576, 0.0, 0.0576]
    """
    positions, normals = as_float(positions, "positions"), as_float(normals, "normals")
    degree = check_degree(degree)
    if normals.ndim != 2 or normals.shape[1] != 3 or positions.shape != normals.shape:
        raise ValueError(
            f"expected positions and normals (V, 3), got shapes {positions.shape} and "
            f"{normals.shape}"
        )
    if neighbors is None:
        # Each point beside itself alone, which is how the table is filled up.
        neighbors = jnp.arange(len(normals), dtype=jnp.int32)[:, None]
    positions = positions.astype(normals.dtype)
    return Transfer(_coefficients(normals, degree), positions, normals, neighbors)


@functools.partial(jax.jit, static_argnums=1)
def _coefficients(normals: Float[Array, "v 3"], degree: int) -> Float[Array, "v k"]:
    defined = jnp.all(jnp.isfinite(normals), axis=1) & jnp.any(normals != 0, axis=1)
    # Replaced before the basis too, so that no derivative is 0 · NaN.
    up = jnp.asarray([[0.0, 0.0, 1.0]], normals.dtype)
    basis = evaluate(jnp.where(defined[:, None], normals, up), degree)
    cosine = phong(jnp.ones((), normals.dtype), degree)  # the clamped cosine, in this dtype
    return jnp.where(defined[:, None], convolve(basis, cosine), 0.0)
