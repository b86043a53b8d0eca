"""Light and the colors of materials together, up to what both share."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from .._core.linalg import einsum, matmul
from .._core.xla import in_turn, rows_at_once
from ._light_solve import Solution, compress_rows
from ._solve import covariance, fixed_point, triangle

# No color becomes darker than this part of the mean: its logarithm is what is iterated.
_DARKEST = 1e-4


class Colored(NamedTuple):
    """Light and colors found together, and the end of the iteration."""

    found: Solution
    scale: Float[Array, ""]
    albedo: Float[Array, "m 3"]
    result: Any
    steps: Int[Array, ""]


def solve_colored(
    observed, rows, albedo, weights, materials, make, solve, *, count, tolerance, max_steps
) -> Colored:
    """Finds light and colors in turn, from gray materials on, until the colors rest.

    Each material's pixels are compressed once; `solve(operator, target, pixels, scale)` is the
    linear fit. The mean of the colors over the pixels, by their squared weights, is `albedo`.
    """
    dtype = observed.dtype
    unit = jnp.ones((), dtype)

    def of(material):
        small = compress_rows(
            observed, rows, unit, jnp.where(materials == material, weights, 0), make
        )
        return small.operator[0], small.target * small.scale

    numbers = jnp.arange(count, dtype=materials.dtype)
    width = jax.eval_shape(make, rows).shape[1]
    size = len(observed) * (width + 3) * dtype.itemsize
    operators, targets = in_turn(of, numbers, most=rows_at_once(size))
    norm = jnp.linalg.norm(targets)
    scale = jnp.where(norm > 0, norm, 1)
    operators, targets = operators / scale, targets / scale
    width = operators.shape[-1]
    squared = jax.ops.segment_sum(weights**2, materials, count)
    share = squared / jnp.sum(squared)
    pixels = jnp.sum(weights > 0).astype(dtype)
    mean = jnp.broadcast_to(albedo, (3,))

    def scaled(colors):
        return colors * (mean / einsum("m,mc->c", share, colors))[None]

    def lit(colors):
        """Rows of each channel, all materials one below the other."""
        return einsum("mc,mrk->cmrk", colors, operators).reshape(3, -1, width)

    def again(logs):
        colors = scaled(jnp.exp(logs))
        b = jnp.moveaxis(targets, 1, 0).reshape(3, -1, 1)
        small = in_turn(triangle, jnp.concatenate([lit(colors), b], axis=-1), lapack=True)
        found = solve(small[..., :width], small[..., width], pixels, scale)
        gray = einsum("mrk,ck->mcr", operators, found.light)
        own = jnp.sum(gray**2, axis=-1)
        fresh = jnp.sum(gray * targets, axis=-1) / jnp.where(own > 0, own, 1)
        fresh = jnp.maximum(scaled(jnp.where(own > 0, fresh, mean[None])), _DARKEST * mean[None])
        return jnp.log(scaled(fresh)), (found, colors)

    start = jnp.log(jnp.broadcast_to(mean[None], (count, 3)))
    ended = fixed_point(again, start, tolerance=tolerance, max_steps=max_steps)
    found, colors = ended.aux
    found = found._replace(inverse=_inverse(found, colors, share, lit(colors), count))
    return Colored(found, scale, colors, ended.result, ended.stats["num_steps"])


def _inverse(found, colors, share, operator, count) -> Float[Array, "3 k k"]:
    """The Hessian's inverse of the light, that the colors are unknown taken into account."""
    width = operator.shape[-1]

    def one(channel):
        matrix, light, pull, color = channel
        rows = len(matrix) // count
        shaded = matmul(matrix, light).reshape(count, rows)
        # Of logarithms q: log a = q - log Σ share·exp(q), with the first at rest.
        turned = jnp.eye(count, dtype=light.dtype) - (share * color / jnp.sum(share * color))[None]
        own = (shaded[:, :, None] * turned[:, None]).reshape(-1, count)[:, 1:]
        above = jnp.concatenate([matrix, own], axis=1)
        below = jnp.concatenate(
            [jnp.diag(pull), jnp.zeros((width, count - 1), light.dtype)], axis=1
        )
        whole = jnp.concatenate([above, below], axis=0)
        return covariance(whole, jnp.ones((), light.dtype))[:width, :width]

    return in_turn(one, (operator, found.light, found.pull, colors.T), lapack=True)
