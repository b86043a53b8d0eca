"""The baked thing."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..harmonics import degree_of


class Transfer(eqx.Module):
    """Transfer of a mesh with V vertices, made by `bake`: what shading needs, and no more.

    `coefficients` are ∫ V(ω) max(0, n·ω) y_i(ω) dω: visibility and cosine, without albedo and
    without 1/π, so that their product with the coefficients of a light is irradiance. Bounces, if
    baked, are in them. `neighbors` is the padded table of `geometry.neighbors`.

    Differentiable in coefficients, positions and normals; neighbours are constants.
    """

    coefficients: Float[Array, "v k"]
    positions: Float[Array, "v 3"]
    normals: Float[Array, "v 3"]
    neighbors: Int[Array, "v n"]

    @property
    def count(self) -> int:
        """V."""
        return self.coefficients.shape[0]

    @property
    def dtype(self) -> jnp.dtype:
        return self.coefficients.dtype

    @property
    def degree(self) -> int:
        return degree_of(self.coefficients.shape[-1])
