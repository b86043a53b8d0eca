"""Light near a point: its coefficients and their derivatives there."""

import itertools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, as_float, check_size, check_type, check_vectors
from .._core.linalg import einsum
from ..harmonics import degree_of

_ORDERS = {1: 0, 4: 1, 10: 2, 20: 3}  # by the number of monomials up to that order


class Expansion(eqx.Module):
    """Holds the Taylor expansion of a light's coefficients around a point, channel by channel.

    `terms` (..., 3, K, M) multiply the M monomials of the offset d = x - point: M = 1 (constant),
    4 (1, dx, dy, dz), 10 (and xx, xy, xz, yy, yz, zz) or 20 (and xxx, xxy, xxz, xyy, xyz, xzz,
    yyy, yyz, yzz, zzz). Factorials are in the terms: c(point + d) = terms . monomials(d). Leading
    axes, if any, count points.

    Raises `ValueError` for shapes that do not fit.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> expansion = midrange.Expansion(jnp.zeros(3), jnp.ones((3, 4, 10)))
    >>> expansion.order, expansion.degree, expansion.truncated(1).gradient.shape
    (2, 1, (3, 4, 3))
    """

    point: Float[Array, "*batch 3"] = eqx.field(converter=lambda v: as_float(v, "point"))
    terms: Float[Array, "*batch 3 k m"] = eqx.field(converter=lambda v: as_float(v, "terms"))

    def __check_init__(self):
        point, terms = self.point.shape, self.terms.shape
        if len(terms) < 3 or terms[-3] != 3 or terms[-1] not in _ORDERS:
            raise ValueError(f"expected terms (..., 3, K, 1, 4, 10 or 20), got shape {terms}")
        if point != (*terms[:-3], 3):
            raise ValueError(f"expected point {(*terms[:-3], 3)} for terms {terms}, got {point}")
        degree_of(terms[-2])

    @property
    def order(self) -> int:
        """The largest power of the offset: 0 to 3."""
        return _ORDERS[self.terms.shape[-1]]

    @property
    def degree(self) -> int:
        """The largest l of the harmonics."""
        return degree_of(self.terms.shape[-2])

    @property
    def coefficients(self) -> Float[Array, "*batch 3 k"]:
        """Coefficients at the point itself."""
        return self.terms[..., 0]

    @property
    def gradient(self) -> Float[Array, "*batch 3 k 3"]:
        """Gradient by the receiver's position, at the point itself.

        Raises `ValueError` where the expansion is of order 0.
        """
        if self.order == 0:
            raise ValueError("an expansion of order 0 has no gradient")
        return self.terms[..., 1:4]

    def truncated(self, order: int) -> "Expansion":
        """Cut the terms above `order`: the expansion that a lower order would have given.

        Raises `ValueError` unless `order` is an integer from 0 to the expansion's own.
        """
        order = check_size("order", order, 0)
        if order > self.order:
            raise ValueError(f"an expansion of order {self.order} has no terms of order {order}")
        return Expansion(self.point, self.terms[..., : len(term_orders(order))])


def make_expansion(
    point: Float[ArrayLike, "*batch 3"],
    coefficients: Float[ArrayLike, "*batch 3 k"],
    gradient: Float[ArrayLike, "*batch 3 k 3"] | None = None,
) -> Expansion:
    """Make the expansion of order 1 with these coefficients and gradient; of order 0 without one.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> midrange.make_expansion(jnp.zeros(3), jnp.ones((3, 4)), jnp.ones((3, 4, 3))).order
    1
    """
    coefficients = as_float(coefficients, "coefficients")[..., None]
    if gradient is None:
        return Expansion(point, coefficients)
    gradient = as_float(gradient, "gradient")
    if gradient.shape != (*coefficients.shape[:-1], 3):
        raise ValueError(
            f"expected gradient {(*coefficients.shape[:-1], 3)} for coefficients "
            f"{coefficients.shape[:-1]}, got shape {gradient.shape}"
        )
    return Expansion(point, jnp.concatenate([coefficients, gradient], axis=-1))


def monomials(offsets: Float[Array, "*batch 3"], order: int) -> Float[Array, "*batch m"]:
    """Compute 1, x, y, z, xx, xy, … up to an order, in the sequence of `Expansion.terms`.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> [round(float(m), 1) for m in midrange.monomials(jnp.array([1.0, 2.0, 3.0]), 1)]
    [1.0, 1.0, 2.0, 3.0]
    """
    offsets, order = as_float(offsets, "offsets"), check_size("order", order, 0)
    check_vectors("offsets", offsets)
    x, y, z = offsets[..., 0], offsets[..., 1], offsets[..., 2]
    return jnp.stack(monomial_list((x, y, z), order), axis=-1)


def monomial_list(offset: tuple[Array, Array, Array], order: int) -> list[Array]:
    """List the monomials, each made from one of the order below and one component."""
    made: dict[tuple[int, ...], Array] = {(): jnp.ones_like(offset[0])}
    for size in range(1, order + 1):
        for axes in itertools.combinations_with_replacement(range(3), size):
            made[axes] = made[axes[:-1]] * offset[axes[-1]] if size > 1 else offset[axes[0]]
    return list(made.values())


def term_orders(order: int) -> list[int]:
    """The order of each monomial: 0, 1, 1, 1, 2, ..."""
    return [size for size in range(order + 1) for _ in range(math.comb(size + 2, 2))]


def extrapolate(
    expansion: Expansion, positions: Float[ArrayLike, "*batch 3"]
) -> Float[Array, "*lights 3 k"]:
    """Extrapolate a light's coefficients to positions by its Taylor expansion (eq. 14).

    Equation 14 is the expansion of order 1; the other orders, 0 to 3, go the same way.

    **Arguments**

    - `expansion`: around one point, or around many, whose axes broadcast with those of
      `positions` (for all pairs: points (S,), positions (V, 1, 3)).
    - `positions`: (..., 3), in the space of the expansion's point.

    **Returns** (..., 3, K) in the dtype of the expansion. Linear in the terms, polynomial in
    positions and point, and differentiable in all, forward and reverse. How far it may be trusted
    is for the caller to know: the error grows as the next power of offset / distance to the light.

    Raises `ValueError` for shapes that do not fit.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> expansion = midrange.make_expansion(jnp.zeros(3), jnp.ones((3, 4)), jnp.ones((3, 4, 3)))
    >>> round(float(midrange.extrapolate(expansion, jnp.full(3, 0.5))[0, 0]), 1)
    2.5
    """
    check_type("expansion", expansion, Expansion)
    return _extrapolate(expansion, check_positions(positions).astype(expansion.terms.dtype))


@jax.jit
def _extrapolate(expansion: Expansion, positions: Float[Array, "*batch 3"]) -> Array:
    point, terms = expansion.point.astype(positions.dtype), expansion.terms
    powers = monomials(jnp.subtract(*align(positions, point)), expansion.order)
    if point.ndim == 1:
        return einsum("...m,ckm->...ck", powers, terms)
    powers, terms = align(powers[..., None, None, :], terms)
    return jnp.sum(powers * terms, axis=-1)


def check_positions(positions: Float[ArrayLike, "*batch 3"]) -> Float[Array, "*batch 3"]:
    """Convert to floating point; raises `ValueError` unless the last axis is x, y, z."""
    positions = as_float(positions, "positions")
    check_vectors("positions", positions)
    return positions
