"""Linear least squares for a light under a prior, and the level of its noise.

All in units in which the weighted data have length 1, on the few rows that hold all of them.
"""

import functools
import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import lineax as lx
from jaxtyping import Array, Float

from .._core.linalg import einsum
from .._core.xla import in_turn, on_mesh, rows_at_once
from ._shading import Shading, compress
from ._solve import covariance, triangle

# Rows that are made small at once: more do not fit a cache, and 10⁶ at once not the memory.
_BLOCK = 2**14
# How often the scale of the prior follows the mean light: each time it changes tenfold less.
_PASSES = 8
# Levels of noise that are tried, evenly in their logarithm, then more finely around the best.
_LEVELS, _FINER = 193, 33
# A channel's prior is no narrower than this part of the widest.
_LEAST = 1e-3


class Solution(NamedTuple):
    """Light of each channel, and what is known of it."""

    light: Float[Array, "3 k"]
    inverse: Float[Array, "3 k k"]  # of the Hessian: covariance in the noise's variance
    pull: Float[Array, "3 k"]  # square roots of what the prior adds to the Hessian's diagonal
    determined: Float[Array, "3 k"]
    noise: Float[Array, ""]
    residual: Float[Array, ""]


def compress_rows(observed, rows, albedo, weights, make) -> Shading:
    """Compresses as `compress` does, for transfer `make(rows)`, in blocks that fit the memory."""
    count = len(observed)
    if count <= _BLOCK or on_mesh(observed, rows):
        return compress(observed, make(rows), albedo, weights)

    def cut(array):
        padding = [(0, -count % _BLOCK)] + [(0, 0)] * (array.ndim - 1)
        return jnp.pad(array, padding, mode="edge").reshape(-1, _BLOCK, *array.shape[1:])

    each = albedo.ndim == 2
    filled = jnp.pad(weights, (0, -count % _BLOCK)).reshape(-1, _BLOCK)
    blocks = cut(observed), cut(rows), cut(albedo) if each else filled, filled

    def one(block):
        seen, part, reflected, trust = block
        small = compress(seen, make(part), reflected if each else albedo, trust)
        return small.operator, small.target * small.scale

    width = jax.eval_shape(make, rows).shape[1]
    size = (3 if each else 1) * _BLOCK * (width + 3) * observed.dtype.itemsize
    operators, targets = in_turn(one, blocks, most=rows_at_once(size))
    norm = jnp.linalg.norm(targets)
    scale = jnp.where(norm > 0, norm, 1)
    width, channels = operators.shape[-1], operators.shape[1]
    operators = jnp.moveaxis(operators, 1, 0).reshape(channels, -1, width)
    targets = jnp.moveaxis(targets, 1, 0).reshape(3, -1) / scale
    columns = targets.T[None] if channels == 1 else targets[..., None]
    small = in_turn(triangle, jnp.concatenate([operators, columns], axis=-1), lapack=True)
    target = jnp.moveaxis(small[..., width:], -1, 0 if channels == 1 else 1).reshape(3, -1)
    return Shading(target, small[..., :width], scale)


def solve_plain(
    operator: Float[Array, "3 r k"],
    target: Float[Array, "3 r"],
    count: Float[Array, ""],
    noise: Float[Array, ""] | None,
) -> Solution:
    """Least squares without a prior; what the data do not tell stays zero, its deviation infinite.

    `count` is the number of pixels with a weight.
    """
    rcond = 10 * float(jnp.finfo(target.dtype).eps) * operator.shape[-1]
    solver = lx.SVD(rcond=rcond)

    def one(pair):
        matrix, b = pair
        return lx.linear_solve(lx.MatrixLinearOperator(matrix), b, solver, throw=False).value

    light = in_turn(one, (operator, target), lapack=True)
    residual = jnp.linalg.norm(target - einsum("crk,ck->cr", operator, light))
    if noise is None:
        rank_of = functools.partial(jnp.linalg.matrix_rank, rtol=rcond)
        rank = in_turn(rank_of, operator, lapack=True)
        free = 3 * count - jnp.sum(rank).astype(count.dtype)
        # As many unknowns as pixels fit any data: these then do not tell how noisy they are.
        noise = jnp.where(free > 0.5, residual / jnp.sqrt(jnp.maximum(free, 1)), jnp.inf)
    unit = jnp.ones((), target.dtype)
    inverse = in_turn(lambda matrix: covariance(matrix, unit), operator, lapack=True)
    known = jnp.isfinite(jnp.diagonal(inverse, axis1=1, axis2=2)).astype(target.dtype)
    return Solution(light, inverse, jnp.zeros_like(light), known, noise, residual)


def width_of(mean: Float[Array, " 3"]) -> Float[Array, " 3"]:
    """The mean light of each channel as its prior takes it."""
    return jnp.maximum(jnp.abs(mean), _LEAST * jnp.max(jnp.abs(mean)))


def solve_with_prior(
    operator: Float[Array, "3 r k"],
    target: Float[Array, "3 r"],
    variances: Float[Array, " k"],
    count: Float[Array, ""],
    noise: Float[Array, ""] | None,
) -> Solution:
    """Most probable light under a Gaussian prior, of `variances` in the square of the mean light.

    The constant coefficient, the first, has no prior; those of the others are relative to it. The
    level of the noise, unless known, is that under which what was observed is most probable, all
    lights taken together (marginal likelihood; restricted, since the mean is free).
    """
    dtype = target.dtype
    count_of = operator.shape[2]
    lacking = max(count_of - operator.shape[1], 0)  # of rows, for the SVD to be complete
    operator = jnp.pad(operator, ((0, 0), (0, lacking), (0, 0)))
    target = jnp.pad(target, ((0, 0), (0, lacking)))
    widths = jnp.sqrt(variances[1:])
    # The operator is a triangle: its first row alone holds the first coefficient.
    first, rest = operator[:, 0], operator[:, 1:, 1:] * widths[None, None]
    svd = functools.partial(jnp.linalg.svd, full_matrices=False)
    u, d, vt = in_turn(svd, rest, lapack=True)
    y = einsum("cri,cr->ci", u, target[:, 1:])
    across = jnp.sum((target[:, 1:] - einsum("cri,ci->cr", u, y)) ** 2)
    # Fewer pixels than unknowns leave directions that nothing is seen of: taken off here again.
    free = 3 * (count - count_of)
    head = jnp.where(first[:, 0] == 0, 1, first[:, 0])
    typical = 1 / jnp.sqrt(3 * jnp.maximum(count, 1))  # root mean square of what was observed

    def improbability(level, scale):
        """-2 log of the marginal likelihood, for levels (n,)."""
        variance = level[:, None, None] ** 2
        total = variance + (scale[:, None] * d)[None] ** 2
        seen = jnp.sum(jnp.log(total) + y[None] ** 2 / total, axis=(1, 2))
        return seen + free * 2 * jnp.log(level) + across / level**2

    def most_probable(scale):
        if noise is not None:
            return noise
        low = math.log(10 * float(jnp.finfo(dtype).eps))
        logs = jnp.linspace(low, 0.7, _LEVELS, dtype=dtype)
        step = (0.7 - low) / (_LEVELS - 1)
        best = logs[jnp.argmin(improbability(typical * jnp.exp(logs), scale))]
        logs = best + jnp.linspace(-step, step, _FINER, dtype=dtype)
        best = logs[jnp.argmin(improbability(typical * jnp.exp(logs), scale))]
        return typical * jnp.exp(best)

    def follow(_, state):
        scale, _ = state
        level = most_probable(scale)
        gain = scale[:, None] * d
        pulled = gain / (gain**2 + level**2) * y
        others = scale[:, None] * widths[None] * einsum("cik,ci->ck", vt, pulled)
        return width_of((target[:, 0] - jnp.sum(first[:, 1:] * others, axis=1)) / head), level

    start = width_of(target[:, 0] / head), jnp.zeros((), dtype)
    scale, level = jax.lax.fori_loop(0, _PASSES, follow, start)
    spreads = (scale[:, None] * widths[None]) ** 2
    spreads = jnp.where(spreads > 0, spreads, 1)
    pull = level / jnp.sqrt(spreads)
    # A channel of which nothing is seen: zero, and not what a singular matrix gives.
    dark = first[:, :1] == 0
    pull = jnp.concatenate([dark.astype(dtype), pull], axis=1)
    stacked = jnp.concatenate([operator, jax.vmap(jnp.diag)(pull)], axis=1)

    def one(pair):
        matrix, b = pair
        filled = jnp.concatenate([b, jnp.zeros(matrix.shape[1], dtype)])
        return lx.linear_solve(lx.MatrixLinearOperator(matrix), filled, lx.QR(), throw=False).value

    light = in_turn(one, (stacked, target), lapack=True)
    residual = jnp.linalg.norm(target - einsum("crk,ck->cr", operator, light))
    # The Hessian's inverse by the singular values: each is added to σ², so that none is too small.
    along = einsum("cik,ci->cik", vt, 1 / jnp.sqrt((scale[:, None] * d) ** 2 + level**2))
    along = along * (scale[:, None] * widths[None])[:, None]
    inner = einsum("cik,cij->ckj", along, along)
    lever = -einsum("ck,ckj->cj", first[:, 1:], inner) / head[:, None]
    corner = 1 / head**2 - jnp.sum(lever * first[:, 1:], axis=1) / head
    top = jnp.concatenate([corner[:, None], lever], axis=1)
    inverse = jnp.concatenate([lever[..., None], inner], axis=2)
    inverse = jnp.concatenate([top[:, None], inverse], axis=1)
    inverse = jnp.where(dark[..., None], jnp.inf, inverse)
    own = level**2 * jnp.diagonal(inner, axis1=1, axis2=2) / spreads
    known = jnp.concatenate([jnp.ones((3, 1), dtype), jnp.clip(1 - own, 0, 1)], axis=1)
    known = jnp.where(dark, 0, known)
    return Solution(light, inverse, pull, known, level, residual)
