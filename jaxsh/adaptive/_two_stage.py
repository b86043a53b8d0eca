"""One decision at a middle degree, then all or nothing."""

from typing import Unpack

import jax
import jax.numpy as jnp
from jaxtyping import ArrayLike, Float

from .._core.xla import materialize
from ..harmonics import degree_of, num_coefficients
from ..transfer import Material, SampledTransfer, Transfer
from ..transfer._glossy_kernels import lobe_polynomial, lobe_products, mirrored
from ._compact import compacted
from ._costs import product_cost, sum_cost
from ._filter import Filter, albedos, threshold
from ._options import FilterOptions, checked
from ._refine import grow, smooth
from ._result import AdaptiveResult
from ._roi import seen_as_changed
from ._staged import StagedTransfer, row_products, stage


def shade_two_stage(
    light: Float[ArrayLike, "3 k"],
    transfer: Transfer | StagedTransfer,
    eye: Float[ArrayLike, " 3"],
    material: Material,
    *,
    middle: int | None = None,
    **options: Unpack[FilterOptions],
) -> AdaptiveResult:
    """Everyone at a middle degree; where that changed the base, the full degree.

    Not in the paper, whose levels it replaces by one. Each degree is computed as
    `transfer.shade_glossy` does it, with light, transfer and lobe cut to that degree.

    **Arguments** are those of `shade_masks`, and

    - `transfer`: for frame after frame, what `stage` made of it, for the same degrees.
    - `middle`: degree of the first stage, from `base` to the light's (default: what was staged,
      or three fifths of the light's).

    The decision is on the glossy part alone: the diffuse part is computed in full for all, which
    costs less than to pick, so that `diffuse_threshold` is not looked at. `outside="base"` leaves
    those that are not recomputed at the base, else they are left at the middle degree. `kept` has
    one share, under "specular". The first stage knows the change of everyone, so with `rings`
    whole rings join, without a test.

    **Returns** an `AdaptiveResult`. Differentiable as `shade_masks` is. Pays against products
    with the light's matrix; against `shade_glossy` of a sampled transfer only where very few
    vertices are recomputed, which is not so at the paper's threshold. Experiment
    `leekim2014.table1` prints both.

    Raises `ValueError` for shapes and options that do not fit, and for degrees that were not
    staged.
    """
    staged = transfer if isinstance(transfer, StagedTransfer) else None
    plain = staged.transfer if staged else transfer
    light, plain, eye, material, settings, previous = checked(
        light, plain, eye, material, **options
    )
    target = degree_of(light.shape[-1])
    if staged is None:
        staged = stage(plain, target, middle=middle, base=settings.base, quantized=False)
    middle = staged.middle.degree if middle is None else middle
    wanted = settings.base, middle, target
    if wanted != staged.degrees:
        raise ValueError(
            f"expected the degrees that were staged as base, middle and the light's, "
            f"{staged.degrees}, got {wanted}"
        )
    return _two_stage(light, staged, eye, material, settings, previous)


@jax.jit
def _two_stage(light, staged, eye, material, settings: Filter, previous):
    transfer, (base, middle, target) = staged.transfer, staged.degrees
    count = len(transfer.positions)
    axis = mirrored(eye, staged.base.positions, staged.base.normals, settings.distant)
    albedo = albedos(material, count)

    def lobes(degree):
        return lobe_polynomial(material.exponent, degree, settings.normalized)

    def everyone(sampled: SampledTransfer):
        lights = light[:, : num_coefficients(sampled.degree)]
        return lobe_products(lights, sampled, axis, lobes(sampled.degree))

    def second(rows):
        return row_products(light, staged.rows, axis, lobes(target), rows)

    basic, first = everyone(staged.base), everyone(staged.middle)
    region = materialize(
        seen_as_changed,
        jax.lax.stop_gradient(first - basic),
        threshold("specular", target, settings, previous, count),
        jax.lax.stop_gradient(settings.exposure * albedo["specular"]),
    )
    kept = jnp.mean(region, dtype=basic.dtype)
    if settings.rings:
        # All changes are known, and those that are seen are inside already: whole rings join.
        region = grow(region, transfer.neighbors, lambda fringe: fringe, settings.rings)
    outside, shown = (first, middle) if settings.outside == "level" else (basic, base)
    glossy = jnp.where(region[None], compacted(second, region), outside)
    if settings.smoothing:
        glossy = basic + smooth(glossy - basic, region, transfer.neighbors)
    irradiance = staged.diffuse.irradiances(light).T
    color = albedo["specular"] * glossy + albedo["diffuse"] * irradiance

    reached = jnp.where(region, jnp.asarray(target, jnp.int32), jnp.asarray(shown, jnp.int32))
    stages = [sum_cost(one.degree, target) for one in (staged.base, staged.middle)]
    return AdaptiveResult(
        color=color.T,
        kept={"specular": kept},
        spent=sum(stages)
        + product_cost("diffuse", 0, target, target)
        + sum_cost(target, target) * jnp.mean(region, dtype=basic.dtype),
        reached={"specular": reached, "diffuse": jnp.full(count, target, jnp.int32)},
    )
