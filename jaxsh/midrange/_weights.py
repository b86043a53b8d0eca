"""Weights of S samples at V positions."""

import functools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from .._core.checks import as_float, check_number
from .._core.linalg import matmul
from ._expansion import check_positions

Rows = tuple[Array, Array, Array]


class Cells(eqx.Module):
    """Sorts V positions by the cell in which they lie, where all of a cell share N samples.

    `samples` are those of each of C cells, out of `count`. For work block by block, `rows` lists
    positions of one cell per block and V where a block is not full, and `place` is where each
    position went in the flattened rows.
    """

    samples: Int[Array, "c n"]
    cell: Int[Array, " v"]
    rows: Int[Array, "blocks size"]
    place: Int[Array, " v"]
    count: int = eqx.field(static=True)


class Weights(eqx.Module):
    """Holds weights of samples at V positions: all of them, or those of the N of a cell.

    `values` (V, S) where `cells` is `None`, else (V, N). Differentiable in `values`.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> midrange.Weights(jnp.full((5, 2), 0.5)).samples
    2
    """

    values: Float[Array, "v n"]
    cells: Cells | None = None

    @property
    def samples(self) -> int:
        """Number of samples that they weigh: S."""
        return self.values.shape[1] if self.cells is None else self.cells.count

    @property
    def indices(self) -> Int[Array, "v n"] | None:
        """The samples that each of the `values` is for; `None` where it is all of them."""
        return None if self.cells is None else self.cells.samples[self.cells.cell]


def inverse_distance_weights(
    positions: Float[ArrayLike, "v 3"],
    points: Float[ArrayLike, "s 3"],
    *,
    exponent: float = 4.0,
) -> Weights:
    """Compute Shepard's weights: distance to the power -b, divided by their sum (eq. 16).

    **Arguments**

    - `positions` (V, 3), and the samples' `points` (S, 3).
    - `exponent`: b > 0. With gradients larger ones are better (the light near a sample is best
      known there), without them smaller ones.

    **Returns** dense `Weights` (V, S) in the dtype of `positions`; they are positive and sum to
    one. Equation 16 is 0/0 at a sample's point; here a position there has that sample alone.
    Differentiable in positions and points, forward and reverse; at a sample's point the gradient
    is given as zero, which for b ≤ 1 it is not (there is a kink).

    No power is taken of a number above one, so float32 holds any exponent.

    Raises `ValueError` for shapes that do not fit and an exponent that is not positive.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> points = jnp.array([[0.0, 0, 0], [3, 0, 0]])
    >>> weights = midrange.inverse_distance_weights(jnp.array([[1.0, 0, 0]]), points, exponent=2)
    >>> [round(float(w), 2) for w in weights.values[0]]
    [0.8, 0.2]
    """
    positions, points = _check_places(positions, points)
    return Weights(_shepard(positions, points, _check_exponent(exponent) / 2))


@functools.partial(jax.jit, static_argnums=2)
def _shepard(
    positions: Float[Array, "v 3"], points: Float[Array, "s 3"], half: float
) -> Float[Array, "v s"]:
    squared = _squared_length(_offsets(positions, points))
    nearest = _nearest(squared)
    # The nearest sample's power is the constant one. As a quotient of distances its derivative
    # would be what rounding leaves of two that cancel and grow without bound towards the sample.
    powers = jnp.where(nearest, 1, _powers(squared, nearest, half))
    return (powers / _total(powers)[None]).T


def moving_least_squares_weights(
    positions: Float[ArrayLike, "v 3"],
    points: Float[ArrayLike, "s 3"],
    *,
    exponent: float = 2.0,
) -> Weights:
    """Compute Shepard's weights, corrected so that they reproduce linear functions.

    Σ w_j = 1 and Σ w_j (x - p_j) = 0, as the rule "half" of `interpolate` asks for. They are the
    weights nearest to Shepard's u that have this: Σ (w_j - u_j)²/u_j is least. The plane fitted
    by moving least squares (Lancaster & Salkauskas 1981) is the same thing. With e_j = p_j - x,
    their mean m = Σ u_j e_j and C = Σ u_j (e_j - m)(e_j - m)ᵀ,

        w_j = u_j (1 - (e_j - m) · C⁺ m).

    Samples in a plane or on a line, or fewer than four, say nothing about what leads away from
    them. There C⁺ is the pseudo-inverse (the correction of least norm), and linear functions are
    reproduced along the samples only. A single sample has weight one.

    Arguments, dtype and errors as for `inverse_distance_weights`; a larger exponent conditions C
    worse, and beyond 4 float32 shows it. Weights may be negative, and grow with the distance
    outside the samples' hull. Differentiable in positions and points, forward and reverse, at a
    sample's point too; whether points lie in a plane is taken as given.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> points = jnp.array([[0.0, 0, 0], [3, 0, 0]])
    >>> weights = midrange.moving_least_squares_weights(jnp.array([[1.0, 0, 0]]), points)
    >>> [round(float(w), 2) for w in weights.values[0]]
    [0.67, 0.33]
    """
    positions, points = _check_places(positions, points)
    return Weights(_least_squares(positions, points, _check_exponent(exponent) / 2))


@functools.partial(jax.jit, static_argnums=2)
def _least_squares(
    positions: Float[Array, "v 3"], points: Float[Array, "s 3"], half: float
) -> Float[Array, "v s"]:
    offsets = _offsets(positions, points)
    squared = _squared_length(offsets)
    nearest = _nearest(squared)
    # Around the nearest sample, f_j = p_j - p_near and e_j = f_j + e_near, nothing cancels: its
    # neighbors have shares v of their common weight s, which vanishes towards the sample, and
    # C = s Ĉ. So w_j = v_j (s - (f_j - s f̄) · Ĉ⁺ m), m = s f̄ + e_near, and Ĉ stays as it is.
    others = _powers(squared, nearest, half)
    s = _total(others) / (1 + _total(others))
    far = jnp.where(nearest, jnp.inf, squared)
    v = jnp.where(nearest, 0, jnp.where(_nearest(far), 1, _powers(far, _nearest(far), half)))
    v = v / jnp.maximum(_total(v), 1)[None]

    along = _span(points)
    d_near = [jnp.sum(row, axis=0, where=nearest) for row in offsets]
    e_near = _along(along, [-row for row in d_near])
    f = _along(along, [near[None] - row for near, row in zip(d_near, offsets, strict=True)])
    mean = [_total(v * row) for row in f]
    spread = [row - average[None] for row, average in zip(f, mean, strict=True)]
    c = [
        [_total(v * spread[i] * spread[j]) + (1 - s) * mean[i] * mean[j] for j in range(3)]
        for i in range(3)
    ]
    m = [s * average + e for average, e in zip(mean, e_near, strict=True)]
    product = _solve(c, m, along)
    tilt = sum((row - (s * a)[None]) * x[None] for row, a, x in zip(f, mean, product, strict=True))
    weights = v * (s[None] - tilt)
    return jnp.where(nearest, 1 - _total(weights)[None], weights).T


def _check_places(positions, points) -> tuple[Float[Array, "v 3"], Float[Array, "s 3"]]:
    """Check both, and cast them to the dtype of the positions."""
    positions, points = check_positions(positions), as_float(points, "points")
    if positions.ndim != 2 or points.ndim != 2 or points.shape[1] != 3 or len(points) == 0:
        raise ValueError(
            f"expected positions (V, 3) and at least one point (S, 3), got shapes "
            f"{positions.shape} and {points.shape}"
        )
    return positions, points.astype(positions.dtype)


def _offsets(positions: Float[Array, "v 3"], points: Float[Array, "s 3"]) -> Rows:
    """x, y, z of each position minus each point; the positions, of which there are many, last."""
    x, y, z = (positions[:, axis][None] - points[:, axis][:, None] for axis in range(3))
    return x, y, z


def _nearest(squared: Float[Array, "s v"]) -> Bool[Array, "s v"]:
    """Mark the least distance, one for each position."""
    which = jnp.arange(len(squared), dtype=jnp.int32)[:, None]
    return which == jnp.argmin(squared, axis=0).astype(jnp.int32)[None]


def _powers(
    squared: Float[Array, "s v"], nearest: Bool[Array, "s v"], half: float
) -> Float[Array, "s v"]:
    """(d_near / d_j)^b of the others, and zero for the nearest: at most one, at any b."""
    least = jnp.sum(squared, axis=0, where=nearest)[None]
    plain = ~nearest & (least > 0) & (squared < jnp.inf)
    ratio = jnp.where(plain, least, 1) / jnp.where(plain, squared, 1)
    power = ratio ** (int(half) if half.is_integer() else half)
    return jnp.where(plain, power, jnp.where(~nearest & (squared == 0), 1, 0))


def _span(points: Float[Array, "s 3"]) -> Float[Array, "3 3"]:
    """The projection onto the directions that lead from sample to sample, to half the digits."""
    _, size, axes = jnp.linalg.svd(points - jnp.mean(points, axis=0)[None], full_matrices=False)
    spanned = size > size[:1] * math.sqrt(jnp.finfo(points.dtype).eps)
    return lax.stop_gradient(matmul(axes.T * spanned.astype(axes.dtype)[None], axes))


def _along(projection: Float[Array, "3 3"], rows: list[Array]) -> list[Array]:
    x, y, z = rows
    return [row[0] * x + row[1] * y + row[2] * z for row in projection]


def _solve(c: list[list[Array]], m: list[Array], along: Float[Array, "3 3"]) -> list[Array]:
    """C⁺ m, by Cholesky's factors of C, completed by what the samples do not span."""
    scale = c[0][0] + c[1][1] + c[2][2]
    scale = jnp.where(scale > 0, scale, 1)
    least = float(jnp.finfo(scale.dtype).eps)
    rest = jnp.eye(3, dtype=along.dtype) - along
    c = [[c[i][j] / scale + rest[i, j] for j in range(3)] for i in range(3)]
    l11 = jnp.sqrt(jnp.maximum(c[0][0], least))
    l21, l31 = c[1][0] / l11, c[2][0] / l11
    l22 = jnp.sqrt(jnp.maximum(c[1][1] - l21 * l21, least))
    l32 = (c[2][1] - l31 * l21) / l22
    d33 = jnp.maximum(c[2][2] - l31 * l31 - l32 * l32, least)
    y1 = m[0] / scale / l11
    y2 = (m[1] / scale - l21 * y1) / l22
    z = (m[2] / scale - l31 * y1 - l32 * y2) / d33
    y = (y2 - l32 * z) / l22
    return [(y1 - l21 * y - l31 * z) / l11, y, z]


def _total(rows: Float[Array, "s v"]) -> Float[Array, " v"]:
    return jnp.sum(rows, axis=0)


def _check_exponent(exponent: float) -> float:
    return check_number("exponent", exponent, above=0.0)


def _squared_length(offsets: Rows) -> Float[Array, "..."]:
    x, y, z = offsets
    return x * x + y * y + z * z
