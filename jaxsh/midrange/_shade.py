"""Shading with light that varies from vertex to vertex, without the light of each vertex."""

import functools
import math
from typing import get_args

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, check_choice, check_cosine, check_type
from .._core.linalg import shading_matmul
from ..transfer import Transfer
from ..transfer._glossy_kernels import checked_albedo
from ._expansion import Expansion, monomial_list
from ._interpolate import Rule, by_samples, check_weights, rule_terms, take_rows
from ._weights import Weights


def shade(
    expansions: Expansion,
    transfer: Transfer,
    albedo: Float[ArrayLike, "..."],
    *,
    weights: Weights | None = None,
    rule: Rule = "full",
) -> Float[Array, "v 3"]:
    """Compute the radiance that leaves V diffuse vertices near emitters (eqs. 3, 14 and 15).

    What `shade_diffuse` makes of `extrapolate` (one sample) or `interpolate` (many), in another
    order: the transfer is multiplied with all terms of the expansions first, T · [c, ∇c], and
    what is left, 3·M numbers per vertex and sample, with the offset's powers and the weights. The
    light of each vertex, K·3 numbers, is never stored on one CPU. An accelerator stores it where
    there are many samples, and so multiplies two large matrices instead of many small ones.

    **Arguments**

    - `expansions`: around one point, or those of S samples with `weights`. Their degree is the
      transfer's or below.
    - `transfer`: any: with or without shadows, with bounces. Its positions are in the space of
      the expansions' points. `transfer.bake(mesh, degree, shadows=False)` gives the irradiance
      of Ramamoorthi & Hanrahan 2001, λ_l Σ c_lm y_lm(n), exact up to its degree.
    - `albedo`: a number, RGB (3,), or per vertex (V, 1) or (V, 3).
    - `weights`: of the samples at the transfer's positions. Those of a `Grid` are fastest.
    - `rule`: as for `interpolate`; one sample takes "full" or "none".

    **Returns** (V, 3), in the dtype of the transfer. Linear in the expansions' terms, transfer,
    weights and albedo; differentiable in all and in positions and points, forward and reverse.

    Raises `ValueError` for shapes that do not fit and an unknown rule.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange, transfer
    >>> positions, normals = jnp.zeros((2, 3)), jnp.array([[0.0, 0, 1], [1, 0, 0]])
    >>> receivers = transfer.unshadowed(positions, normals, degree=1)
    >>> light = midrange.make_expansion(jnp.zeros(3), jnp.ones((3, 4)), jnp.ones((3, 4, 3)))
    >>> midrange.shade(light, receivers, 0.5).shape
    (2, 3)
    """
    check_choice("rule", rule, get_args(Rule))
    check_type("expansions", expansions, Expansion)
    check_type("transfer", transfer, Transfer)
    check_cosine(transfer)
    if weights is not None:
        check_type("weights", weights, Weights)
    count = len(transfer.coefficients)
    albedo = checked_albedo(albedo, count, transfer.dtype)
    if weights is None and (expansions.point.ndim != 1 or rule == "half"):
        raise ValueError(
            "without weights, expected the expansion around one point and the rule "
            f'"full" or "none", got points {expansions.point.shape} and {rule!r}'
        )
    if weights is not None:
        check_weights(expansions, weights, count)
    if expansions.degree > transfer.degree:
        raise ValueError(
            f"the light's degree {expansions.degree} is above the transfer's, {transfer.degree}; "
            f"cut its terms to [..., :{transfer.coefficients.shape[-1]}, :]"
        )
    return _shade(expansions, transfer.coefficients, transfer.positions, albedo, weights, rule)


@functools.partial(jax.jit, static_argnums=5)
def _shade(expansions, coefficients, positions, albedo, weights, rule):
    dtype = coefficients.dtype
    terms, order = rule_terms(expansions, rule), 0 if rule == "none" else expansions.order
    lacking = coefficients.shape[-1] - terms.shape[-2]
    terms = jnp.pad(terms.astype(dtype), [(0, 0)] * (terms.ndim - 2) + [(0, lacking), (0, 0)])
    points, cells = expansions.point.astype(dtype), None
    if weights is None:
        values, points, terms = jnp.ones((len(positions), 1), dtype), points[None], terms[None]
    else:
        values, cells = weights.values.astype(dtype), weights.cells
    positions = positions.astype(dtype)
    if cells is not None:
        coefficients = take_rows(coefficients, cells.rows)
        positions, values = take_rows(positions, cells.rows), take_rows(values, cells.rows)
        samples = cells.samples[cells.cell[cells.rows[:, 0]]]
        points, terms = points[samples], terms[samples]

    def add(total, values, points, terms):
        products = _products(coefficients, terms)
        # Written out: XLA's sums over rows this short are several times slower.
        for sample in range(values.shape[-1]):
            offset = [
                positions[..., axis : axis + 1] - points[..., None, sample, axis : axis + 1]
                for axis in range(3)
            ]
            powers = monomial_list((offset[0], offset[1], offset[2]), order)
            said = sum(p * next(products) for p in powers)
            total = total + values[..., sample : sample + 1] * said
        return total

    def reflect(light):
        light = light.reshape(*light.shape[:-1], 3, -1)
        return jnp.sum(light * coefficients[..., None, :], axis=-1)

    radiance = by_samples(add, positions, values, points, terms, order, reflect)
    if cells is not None:
        radiance = radiance.reshape(-1, 3)[cells.place]
    return jnp.multiply(*align(radiance, albedo / math.pi))


def _products(coefficients, terms):
    """T · each term, (..., V, 3) each, sample by sample; columns up to a multiple of eight.

    As in `shade_diffuse`: XLA's CPU kernel is faster with eight columns than with three.
    """
    columns = jnp.moveaxis(jnp.moveaxis(terms, -2, -4), -1, -2)  # (..., K, N, M, 3)
    columns = columns.reshape(*terms.shape[:-4], terms.shape[-2], -1)
    width = columns.shape[-1]
    columns = jnp.pad(columns, [(0, 0)] * (columns.ndim - 1) + [(0, -width % 8)])
    products = shading_matmul(coefficients, columns)
    return (products[..., start : start + 3] for start in range(0, width, 3))
