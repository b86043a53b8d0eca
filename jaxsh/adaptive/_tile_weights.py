"""Weights of the numbers of a tile's vertices, under a light and seen from an eye."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._core.linalg import matmul
from .._core.xla import materialize
from ._local_rule import degree_of_monomials, disc, monomials

# Beside the cosine of facing the eye, what a vertex counts for in its tile's middle.
_AWAY = 0.05
# The least squared width of a tile.
_NARROW = 1e-6
# Points of a tile at which its weights are fitted.
_POINTS = 9


def placed(
    axis: Float[Array, "3 blocks b"],
    normals: Float[Array, "3 blocks b"],
    tile: Int[Array, " blocks"],
    turns: Float[Array, "tiles 3 3"],
) -> tuple[Float[Array, "tiles 2"], Float[Array, " tiles"], Float[Array, "blocks 5 b"]]:
    """Finds where in its tile each vertex mirrors the eye.

    Returns the middle of each tile across its axis, its width, that of a disc of the same mean
    square about the middle, and of each vertex u, w, u², u w and w², from the middle in widths.
    """

    def across(axis, normals, turns):
        x, y = (sum(axis[i] * turns[:, i, j, None] for i in range(3)) for j in range(2))
        # Written out, as x and y are: a reduction over three rows costs more than all the rest.
        facing = sum(normals[i] * axis[i] for i in range(3))
        return x, y, jnp.maximum(facing, 0) + _AWAY

    x, y, facing = materialize(across, axis, normals, turns[tile])
    moments = [facing, facing * x, facing * y, facing * (x * x + y * y)]
    totals = jax.ops.segment_sum(
        jnp.stack([jnp.sum(one, axis=1) for one in moments], axis=1),
        tile,
        len(turns),
        indices_are_sorted=True,
    )
    means = totals[:, 1:] / totals[:, :1]
    middle = means[:, :2]
    square = 2 * (means[:, 2] - means[:, 0] ** 2 - means[:, 1] ** 2)
    width = jnp.sqrt(jnp.maximum(square, _NARROW))
    scale = (1 / width)[tile, None]
    u, w = ((one - middle[tile, i, None]) * scale for i, one in enumerate((x, y)))
    return middle, width, jnp.stack([u, w, u * u, u * w, w * w], axis=1)


def tile_weights(
    lights: Float[Array, "tiles 3 m"],
    core: Float[Array, "m g n"],
    functions: Float[Array, "g monomials"],
    middle: Float[Array, "tiles 2"],
    width: Float[Array, " tiles"],
    reach: Float[Array, ""],
) -> Float[Array, "tiles 3 rows"]:
    """Computes the weights of 1, u, w, u², u w and w², those of all n for one after the other.

    The rule's functions of B about a tile's axis become quadratic ones about its middle, by
    least squares over its width; beyond the rule's reach they stay as they are on its border.
    """
    points, degree = disc(_POINTS), degree_of_monomials(functions.shape[1])
    fit = np.linalg.pinv(np.stack(monomials(points[:, 0], points[:, 1], 2), axis=-1))

    def changing(middle, width):
        x, y = (
            middle[:, i, None] + width[:, None] * jnp.asarray(points[None, :, i], middle.dtype)
            for i in range(2)
        )
        within = 1 / jnp.sqrt(jnp.maximum(x * x + y * y, reach**2))
        at = jnp.stack(monomials(x * within, y * within, degree), axis=1)
        fitted = matmul(at.reshape(-1, _POINTS), jnp.asarray(fit.T, at.dtype))
        return matmul(functions, fitted.reshape(*at.shape[:2], -1))

    changes, (tiles, channels, _) = changing(middle, width), lights.shape
    whole = matmul(lights.reshape(tiles * channels, -1), core.reshape(len(core), -1))

    def combine(changes, whole):
        whole = whole.reshape(tiles, channels, *core.shape[1:])

        def one(j):
            terms = (changes[:, None, g, j, None] * whole[:, :, g] for g in range(core.shape[1]))
            return functools.reduce(jnp.add, terms)

        # Written out: XLA's CPU backend does so many small products of matrices one by one.
        return jnp.concatenate([one(j) for j in range(changes.shape[-1])], axis=-1)

    return materialize(combine, changes, whole)
