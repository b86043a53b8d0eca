"""Vertices in tiles, for loops whose work on a tile stays in cache."""

import jax.numpy as jnp
from jaxtyping import Array, Float

TILE = 1024


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
