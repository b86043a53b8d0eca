"""The product of one light and the transfer: what stays while only the camera moves."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from .._core.linalg import matmul
from ..harmonics import convolve, degree_of, evaluate, num_coefficients, phong, product_matrix
from ._checks import checked_light
from ._layout import in_tiles, out_of_tiles, rows_in_tiles
from ._lobe import rows_of
from ._transfer import Transfer


class LightProduct(eqx.Module):
    """Light times transfer, R = L̂ O of equation 2, for V vertices: made by `light_product`.

    `radiance` is in tiles of vertices, the last one filled up with zeros.
    """

    radiance: Float[Array, "tiles 3 k tile"]
    irradiance: Float[Array, "v 3"]
    positions: Float[Array, "3 v"]
    normals: Float[Array, "3 v"]  # at unit length


def light_product(light: Float[ArrayLike, "3 k"], transfer: Transfer) -> LightProduct:
    """The product of a light (3, K) that all vertices share and the transfer, at its degree.

    `shade_glossy` takes it in place of both, for any eye and material. It holds three times what
    the transfer does. Bilinear and differentiable. Raises `ValueError` for shapes that do not fit.
    """
    count, dtype = transfer.positions.shape[0], transfer.positions.dtype
    light = checked_light(light, count, transfer.degree, dtype)
    if light.ndim > 2:
        raise ValueError(f"expected one light (3, K) for all vertices, got shape {light.shape}")
    return _light_product(light, transfer)


@jax.jit
def _light_product(light, transfer):
    width = light.shape[-1]
    matrix = product_matrix(light).reshape(3 * width, width)
    rows = jnp.concatenate([matrix, light])

    def tile(coefficients):
        products = matmul(rows, coefficients.T)
        return products[:-3].reshape(3, width, -1), products[-3:]

    radiance, irradiance = jax.lax.map(tile, rows_in_tiles(transfer.coefficients[:, :width]))
    irradiance = out_of_tiles(irradiance, len(transfer.positions)).T
    positions, normals = rows_of(transfer.positions, transfer.normals)
    return LightProduct(radiance, irradiance, positions, normals)


def seen(
    product: LightProduct, axis: Float[Array, "3 v"], exponent: Float[Array, "*v"], normalized: bool
) -> tuple[Float[Array, "v 3"], Float[Array, "v 3"]]:
    """Σ_i α_i y_i(B) R_i and the irradiance."""
    degree = degree_of(product.radiance.shape[-2])
    lobes = convolve(
        jnp.ones(num_coefficients(degree), axis.dtype),
        phong(exponent, degree, normalized=normalized),
    )

    @jax.checkpoint
    def tile(part):
        radiance, axis, lobes = part
        kernel = evaluate(axis.T, degree, axis=0) * lobes
        return jnp.stack([jnp.sum(kernel * channel, axis=0) for channel in radiance])

    axes = in_tiles(axis)
    if lobes.ndim == 1:
        tiles = jax.lax.map(lambda part: tile((*part, lobes[:, None])), (product.radiance, axes))
    else:
        tiles = jax.lax.map(tile, (product.radiance, axes, in_tiles(lobes.T)))
    return out_of_tiles(tiles, axis.shape[-1]).T, product.irradiance
