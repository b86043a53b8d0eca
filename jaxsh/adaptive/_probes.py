"""The glossy part in full at probes, carried over where it is smooth, and in full elsewhere."""

import functools

import jax
import jax.numpy as jnp
from jaxtyping import ArrayLike, Float

from .._core.checks import align
from .._core.xla import materialize
from ..harmonics import degree_of
from ..transfer import Material, QuantizedTransfer, Transfer, shade_diffuse
from ..transfer._glossy_kernels import lobe_polynomial, lobe_products, mirrored
from ._compact import compacted, everywhere
from ._costs import product_cost, sum_cost
from ._options import checked_frame, checked_scalar
from ._probe_sets import NEAREST, ProbeSet
from ._result import AdaptiveResult
from ._roi import seen_as_changed
from ._staged import row_products


def shade_probes(
    light: Float[ArrayLike, "3 k"],
    transfer: Transfer | QuantizedTransfer,
    eye: Float[ArrayLike, " 3"],
    material: Material,
    probes: ProbeSet,
    *,
    threshold: Float[ArrayLike, ""] = 0.06,
    exposure: Float[ArrayLike, ""] = 1.0,
    distant: bool = False,
    normalized: bool = True,
) -> AdaptiveResult:
    """What `transfer.shade_glossy` gives, in full only at probes and where these disagree.

    All vertices take the glossy part S at the probes' base degree. The rest, ΔS, is computed at
    the probes; a vertex takes the mean of its nearest four, weighed by 1/distance², where they
    differ by less than `threshold`, and is computed in full where they do not. Not in Lee & Kim
    2014, whose filter decides by ΔS itself. Whether it pays against `shade_glossy` of a sampled
    transfer hangs on how many that are; experiment `leekim2014.table1` prints both.

    **Arguments**

    - `light`, `eye`, `material`, `distant`, `normalized`: as for `shade_glossy`; one light (3, K)
      of the transfer's degree, and one exponent.
    - `probes`: from `make_probes`, of this transfer. Serve any light and eye.
    - `threshold`: of max - min over the four probes, the largest channel, after the albedo and
      times `exposure`. At 0 every vertex is computed in full, exactly.

    **Returns** an `AdaptiveResult`; `kept` has "probes" and "specular", the shares computed in
    full as a probe and as a vertex. Differentiable in light and albedos where the choice of
    vertices does not change, forward and reverse; the choice is a constant.

    Raises `ValueError` for shapes that do not fit, and for an exponent per vertex.
    """
    light, transfer, eye, material = checked_frame(light, transfer, eye, material)
    count = transfer.num_points
    if len(probes.nearest) != count or probes.degree != transfer.degree:
        raise ValueError(
            f"expected probes of {count} vertices and degree {transfer.degree}, got "
            f"{len(probes.nearest)} and {probes.degree}"
        )
    if degree_of(light.shape[-1]) != probes.degree:
        raise ValueError(
            f"expected a light of the probes' degree, {probes.degree}, got "
            f"{degree_of(light.shape[-1])}"
        )
    if material.exponent.ndim:
        raise ValueError(f"expected one exponent, got one for each of {count} vertices")
    limits = (
        checked_scalar("threshold", threshold, light.dtype),
        checked_scalar("exposure", exposure, light.dtype),
    )
    return _shade_probes(light, transfer, eye, material, probes, limits, distant, normalized)


@functools.partial(jax.jit, static_argnames=("distant", "normalized"))
def _shade_probes(light, transfer, eye, material, probes, limits, distant, normalized):
    threshold, exposure = limits
    axis = mirrored(eye, probes.base.positions, probes.base.normals, distant)
    polynomial = lobe_polynomial(material.exponent, probes.degree, normalized)

    def in_full(vertices):
        return row_products(light, probes.rows, axis, polynomial, vertices)

    base_polynomial = lobe_polynomial(material.exponent, probes.base.degree, normalized)
    width = (probes.base.degree + 1) ** 2
    base = lobe_products(light[:, :width], probes.base, axis, base_polynomial)
    at_probes = everywhere(lambda i: in_full(probes.probes[i]), len(probes.probes))
    rest = at_probes - base[:, probes.probes]
    spread, carried = materialize(_between, rest, probes.nearest, probes.weights, base)
    albedo = material.specular
    specular = albedo.T if albedo.ndim == 2 else albedo.reshape(-1, 1)
    active = materialize(seen_as_changed, spread, threshold, specular * exposure)
    glossy = jnp.where(active[None], compacted(in_full, active), carried).T

    diffuse = shade_diffuse(light, transfer, material.diffuse)
    color = diffuse + jnp.multiply(*align(glossy, material.specular))
    shares = {
        "probes": jnp.asarray(len(probes.probes) / len(active), light.dtype),
        "specular": jnp.mean(active.astype(light.dtype)),
    }
    target = probes.degree
    once = sum_cost(probes.base.degree, target) + product_cost("diffuse", 0, target, target)
    again = sum_cost(target, target)
    return AdaptiveResult(color, shares, once + again * (shares["probes"] + shares["specular"]))


def _between(rest, nearest, weights, base):
    """How much a vertex's probes differ, and what they say of it."""
    near = [rest.at[:, nearest[:, i]].get(mode="promise_in_bounds") for i in range(NEAREST)]
    spread = functools.reduce(jnp.maximum, near) - functools.reduce(jnp.minimum, near)
    return spread, base + sum(w[None] * n for w, n in zip(weights.T, near, strict=True))
