"""What interpolation and shading share: the rule, and sums over samples a few at a time."""

from collections.abc import Callable
from typing import Literal

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from ._expansion import Expansion, term_orders
from ._weights import Weights

Rule = Literal["none", "half", "full"]

_COLUMNS = 32  # terms at a time: 32 · 3 columns are as fast as more, and compile sooner


def rule_terms(expansions: Expansion, rule: Rule) -> Float[Array, "*batch 3 k m"]:
    """The expansions' terms as the rule counts them; `interpolate` says why."""
    order = expansions.order
    if rule == "full":
        return expansions.terms
    if rule == "none":
        return expansions.terms[..., :1]
    if rule == "half":
        shares = [1 - q / (order + 1) for q in term_orders(order)]
        shares = jnp.asarray(shares, expansions.terms.dtype)
        return expansions.terms * shares.reshape((1,) * (expansions.terms.ndim - 1) + (-1,))
    raise ValueError(f'expected rule "none", "half" or "full", got {rule!r}')


def check_weights(expansions: Expansion, weights: Weights, count: int) -> None:
    """Raises `ValueError` unless the weights are for these samples and `count` positions."""
    samples = expansions.point.shape[:-1]
    if samples != (weights.samples,) or len(weights.values) != count:
        raise ValueError(
            f"expected expansions of {weights.samples} samples and {len(weights.values)} "
            f"positions for these weights, got expansions {samples} and {count} positions"
        )


def take_rows(array: Float[Array, "v n"], rows: Array) -> Float[Array, "blocks size n"]:
    """The rows of each block, zeros where it is not full."""
    return array.at[rows].get(mode="fill", fill_value=0)


def over_samples(
    add: Callable[..., Array],
    total: Array,
    values: Float[Array, "*blocks v n"],
    points: Float[Array, "*blocks n 3"],
    terms: Float[Array, "*blocks n 3 k m"],
) -> Array:
    """total = add(total, values, points, terms), for a few of the n samples after the other."""
    count, axis = values.shape[-1], points.ndim - 2
    size = min(count, max(1, _COLUMNS // terms.shape[-1]))
    steps = -(-count // size)
    if steps == 1:
        return add(total, values, points, terms)

    def split(array, axis):
        widths = [(0, steps * size - count if i == axis else 0) for i in range(array.ndim)]
        shape = (*array.shape[:axis], steps, size, *array.shape[axis + 1 :])
        return jnp.moveaxis(jnp.pad(array, widths).reshape(shape), axis, 0)

    parts = split(values, values.ndim - 1), split(points, axis), split(terms, axis)
    return lax.scan(lambda total, part: (add(total, *part), None), total, parts)[0]
