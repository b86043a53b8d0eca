"""Transfer as values in directions: the form in which glossy shading is fast."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..harmonics._indexing import check_degree
from ._nodes import product_nodes
from ._transfer import Transfer

# Vertices per pass: what they need stays in cache.
TILE = 1024


class SampledTransfer(eqx.Module):
    """Transfer of V vertices, cut to a degree, at N directions: made once by `sample`.

    The directions are an exact quadrature for products of three functions of that degree, so
    that nothing is lost. `samples` are in tiles of vertices, the last one filled up with zeros.
    At degree 10 there are 350 directions: three times the memory of the coefficients.
    """

    samples: Float[Array, "tiles n tile"]
    positions: Float[Array, "v 3"]
    normals: Float[Array, "v 3"]
    degree: int = eqx.field(static=True)


def sample(transfer: Transfer, degree: int | None = None) -> SampledTransfer:
    """The transfer, cut to `degree` (default: all of it), ready for frame after frame.

    `shade_glossy` does this on the way where it is given coefficients. Linear and differentiable.
    Raises `ValueError` for a degree that the transfer does not have.
    """
    degree = transfer.degree if degree is None else check_degree(degree)
    if degree > transfer.degree:
        raise ValueError(
            f"expected a degree of at most the transfer's, {transfer.degree}, got {degree}"
        )
    samples = _sample(transfer.coefficients, degree)
    return SampledTransfer(samples, transfer.positions, transfer.normals, degree)


def in_tiles(vertices: Float[Array, "*batch v"]) -> Float[Array, "tiles *batch tile"]:
    """The last axis in tiles, the last tile filled up with the last vertex."""
    *batch, count = vertices.shape
    padded = jnp.pad(vertices, [(0, 0)] * len(batch) + [(0, -count % TILE)], mode="edge")
    return jnp.moveaxis(padded.reshape(*batch, -1, TILE), -2, 0)


def rows_in_tiles(rows: Float[Array, "v k"]) -> Float[Array, "tiles tile k"]:
    return jnp.pad(rows, ((0, -len(rows) % TILE), (0, 0))).reshape(-1, TILE, rows.shape[1])


def out_of_tiles(tiles: Float[Array, "tiles rows tile"], count: int) -> Float[Array, "rows v"]:
    rows = jnp.moveaxis(tiles, 0, 1)
    return rows.reshape(rows.shape[0], -1)[:, :count]


@functools.partial(jax.jit, static_argnums=1)
def _sample(coefficients, degree):
    basis = jnp.asarray(product_nodes(degree).basis, coefficients.dtype)
    tiles = rows_in_tiles(coefficients[:, : basis.shape[1]])
    return jax.lax.map(lambda tile: jnp.matmul(basis, tile.T, precision="highest"), tiles)
