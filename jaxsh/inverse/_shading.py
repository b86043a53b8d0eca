"""Diffuse shading of a transfer, made small for one light, and of a near light."""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._core.linalg import einsum
from .._core.xla import in_turn
from ..midrange import Polygon, polygon_harmonics
from ..transfer import Transfer
from ._solve import triangle


class Shading(eqx.Module):
    """Residuals w (observed - albedo/π · T L) of all vertices, turned until few rows hold them.

    Shading is linear in the light. With [w albedo/π T | w observed] = Q [R | b] in each channel,
    ‖w (observed - albedo/π · T L)‖ = ‖b - R L‖ exactly, so that what a fit does in each step does
    not depend on the number of vertices. Q is never formed. In units of ‖w observed‖.
    """

    target: Float[Array, "3 r"]
    operator: Float[Array, "c r k"]  # c is 1 where all channels have one albedo
    scale: Float[Array, ""]

    def residual(self, light: Float[Array, "3 k"]) -> Float[Array, "3 r"]:
        """Residual of a light of the operator's degree or below."""
        return self.shaded(light) - self.target

    def shaded(self, light: Float[Array, "3 k"]) -> Float[Array, "3 r"]:
        """Shade by a light; from the residual, it would be lost beside the target."""
        operator = self.operator[..., : light.shape[-1]]
        operator = jnp.broadcast_to(operator, (3, *operator.shape[1:]))
        return einsum("crk,ck->cr", operator, light) / self.scale


def compress(
    observed: Float[Array, "v 3"],
    coefficients: Float[Array, "v k"],
    albedo: Float[Array, "..."],
    weights: Float[Array, " v"],
) -> Shading:
    """Compresses the shading of V vertices; `albedo` is a number, (3,), (V, 1) or (V, 3)."""
    # Where nothing weighs, nothing need be known.
    seen = jnp.where(weights[:, None] > 0, weights[:, None] * observed, 0)
    norm = jnp.linalg.norm(seen)
    scale = jnp.where(norm > 0, norm, 1)
    shared = albedo.ndim == 0 or albedo.shape[-1] == 1
    albedo = albedo.reshape((1,) * (2 - albedo.ndim) + albedo.shape)
    albedo = jnp.broadcast_to(albedo, (len(seen), 1 if shared else 3))
    count = coefficients.shape[-1]

    def of_channel(row):
        reflected, b = row
        shading = (weights * reflected / math.pi)[:, None] * coefficients
        return triangle(jnp.concatenate([shading, b], axis=1))

    columns = (seen / scale)[None] if shared else (seen / scale).T[..., None]
    triangles = in_turn(of_channel, (albedo.T, columns), lapack=True)
    operator, target = triangles[..., :count], triangles[..., count:]
    return Shading(jnp.moveaxis(target, -1, 0 if shared else 1).reshape(3, -1), operator, scale)


def irradiance(polygon: Polygon, transfer: Transfer) -> Float[Array, " v"]:
    """Irradiance from a polygon at each vertex, in the first channel."""
    c = polygon_harmonics(polygon, transfer.positions, transfer.degree)[:, 0]
    return jnp.sum(transfer.coefficients * c, axis=-1)
