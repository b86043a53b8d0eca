"""Light at many positions, from the expansions around a few samples."""

import functools
import math
from collections.abc import Callable
from typing import Literal, get_args

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import check_choice, check_type
from .._core.linalg import matmul
from .._core.xla import on_mesh, rows_at_once, varying_as
from ._cube import RadianceCube
from ._expansion import Expansion, check_positions, monomials, term_orders
from ._visible_weights import visible_weights
from ._weights import Weights

Rule = Literal["none", "half", "full"]

# Terms at a time on one CPU: 32 · 3 columns are as fast as more, and compile sooner.
_COLUMNS = 32


def interpolate(
    expansions: Expansion,
    weights: Weights,
    positions: Float[ArrayLike, "v 3"],
    *,
    rule: Rule = "full",
    visibility: RadianceCube | None = None,
) -> Float[Array, "v 3 k"]:
    """Interpolate a light's coefficients to V positions, as weighted means of expansions.

    **Arguments**

    - `expansions`: of S samples, of any order.
    - `weights`: of the samples at the positions: `inverse_distance_weights` (eq. 16),
      `moving_least_squares_weights` or `Grid.weights`.
    - `rule`: what each sample says about a position at offset d.
      "none": its coefficients, as Sloan et al. 2002 interpolate.
      "full": its Taylor polynomial (eq. 15 at order 1), exact for what has no higher order.
      "half": its Taylor polynomial of order k with the terms of order q times 1 - q/(k+1). At
      order 1 that is half the gradient. With weights of linear precision, Σ w_j = 1 and
      Σ w_j d_j = 0, it is exact one order above "full", for k ≥ 1; with eq. 16, which has no
      such precision, it is worse. Not in the paper; `docs/near_light_samples.md` derives it.
    - `visibility`: the cubes captured at the samples' points, so that none speaks through a wall:
      the weights are then those of `visible_weights`, for the rule "full".

    **Returns** (V, 3, K) in the dtype of the expansions. Linear in the terms and in the weights,
    differentiable in all, forward and reverse. To shade with it, `shade` does both at once.

    Raises `ValueError` for shapes that do not fit and an unknown rule.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> points, positions = jnp.eye(3), jnp.full((5, 3), 0.4)
    >>> samples = midrange.make_expansion(points, jnp.ones((3, 3, 4)))
    >>> weights = midrange.inverse_distance_weights(positions, points)
    >>> midrange.interpolate(samples, weights, positions).shape
    (5, 3, 4)
    """
    check_choice("rule", rule, get_args(Rule))
    check_type("expansions", expansions, Expansion)
    check_type("weights", weights, Weights)
    positions = check_positions(positions).astype(expansions.terms.dtype)
    if positions.ndim != 2:
        raise ValueError(f"expected positions (V, 3), got shape {positions.shape}")
    check_weights(expansions, weights, len(positions))
    if visibility is not None:
        weights = visible_weights(weights, visibility, positions)
    return _interpolate(expansions, weights, positions, rule)


@functools.partial(jax.jit, static_argnums=3)
def _interpolate(expansions, weights, positions, rule):
    terms, order = rule_terms(expansions, rule), 0 if rule == "none" else expansions.order
    points, values = expansions.point.astype(terms.dtype), weights.values.astype(terms.dtype)
    cells, shape = weights.cells, (len(positions), *terms.shape[1:3])
    if cells is not None:
        positions, values = take_rows(positions, cells.rows), take_rows(values, cells.rows)
        samples = cells.samples[cells.cell[cells.rows[:, 0]]]
        points, terms = points[samples], terms[samples]

    light = by_samples(None, positions, values, points, terms, order)
    if cells is not None:
        light = light.reshape(-1, light.shape[-1])[cells.place]
    return light.reshape(shape)


def rule_terms(expansions: Expansion, rule: Rule) -> Float[Array, "*batch 3 k m"]:
    """Scale the expansions' terms as the rule counts them; `interpolate` says why."""
    order = expansions.order
    if rule == "full":
        return expansions.terms
    if rule == "none":
        return expansions.terms[..., :1]
    shares = [1 - q / (order + 1) for q in term_orders(order)]
    shares = jnp.asarray(shares, expansions.terms.dtype)
    return expansions.terms * shares.reshape((1,) * (expansions.terms.ndim - 1) + (-1,))


def check_weights(expansions: Expansion, weights: Weights, count: int) -> None:
    """Raises `ValueError` unless the weights are for these samples and `count` positions."""
    samples = expansions.point.shape[:-1]
    if samples != (weights.samples,) or len(weights.values) != count:
        raise ValueError(
            f"expected expansions of {weights.samples} samples and {len(weights.values)} "
            f"positions for these weights, got expansions {samples} and {count} positions"
        )


def take_rows(array: Float[Array, "v n"], rows: Array) -> Float[Array, "blocks size n"]:
    """Take the rows of each block, zeros where it is not full."""
    return array.at[rows].get(mode="fill", fill_value=0)


def by_samples(
    add: Callable[..., Array] | None,
    positions: Float[Array, "*blocks v 3"],
    values: Float[Array, "*blocks v n"],
    points: Float[Array, "*blocks n 3"],
    terms: Float[Array, "*blocks n 3 k m"],
    order: int,
    finish: Callable[[Array], Array] = lambda light: light,
) -> Array:
    """`finish` of the light (*blocks, v, 3K) that weighted expansions make at positions.

    On one CPU, and where samples are few, the same by `add` of a few samples to what there is,
    `total = add(total, values, points, terms)`, where that is faster (None: where it is not).
    """

    def blend(total, values, points, terms):
        offsets = positions[..., :, None, :] - points[..., None, :, :]
        factors = values[..., None] * monomials(offsets, order)
        factors = factors.reshape(*factors.shape[:-2], -1)
        rows = jnp.moveaxis(terms, -1, -3).reshape(*terms.shape[:-4], factors.shape[-1], -1)
        return total + matmul(factors, rows)

    def in_columns(*parts):
        if add is None:
            return finish(_over_samples(blend, light, parts, _COLUMNS))
        return _over_samples(add, jnp.zeros(positions.shape, terms.dtype), parts, _COLUMNS)

    def at_once(*parts):
        most = rows_at_once(math.prod(positions.shape[:-1]) * terms.dtype.itemsize)
        return finish(_over_samples(blend, light, parts, most))

    light = jnp.zeros((*positions.shape[:-1], math.prod(terms.shape[-3:-1])), terms.dtype)
    if terms.shape[-4] * terms.shape[-1] <= _COLUMNS:
        return in_columns(values, points, terms)
    if on_mesh(positions, values, points, terms):
        return at_once(values, points, terms)
    return lax.platform_dependent(values, points, terms, cpu=in_columns, default=at_once)


def _over_samples(
    add: Callable[..., Array], total: Array, parts: tuple[Array, Array, Array], columns: int
) -> Array:
    """total = add(total, values, points, terms), for a few of the n samples after the other."""
    values, points, terms = parts
    count, axis = values.shape[-1], points.ndim - 2
    size = min(count, max(1, columns // terms.shape[-1]))
    steps = -(-count // size)
    if steps == 1:
        return add(total, values, points, terms)

    def split(array, axis):
        widths = [(0, steps * size - count if i == axis else 0) for i in range(array.ndim)]
        shape = (*array.shape[:axis], steps, size, *array.shape[axis + 1 :])
        return jnp.moveaxis(jnp.pad(array, widths).reshape(shape), axis, 0)

    cut = split(values, values.ndim - 1), split(points, axis), split(terms, axis)
    start = varying_as(total, (total, cut))
    return lax.scan(lambda total, part: (add(total, *part), None), start, cut)[0]
