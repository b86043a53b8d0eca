"""One decision at a middle degree, then all or nothing."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import ArrayLike, Float

from .._core.checks import check_degree
from .._core.xla import materialize
from ..harmonics import degree_of, num_coefficients
from ..transfer import AbstractTransfer, Material, SampledTransfer
from ..transfer._glossy_kernels import lobe_polynomial, lobe_products, mirrored, reflection
from ._filter import Filter, albedos, threshold
from ._levels import AbstractFilter
from ._method import check_one_device, checked_frame, plain_transfer
from ._regions import compacted, grow, seen_as_changed, smooth
from ._result import AdaptiveResult, product_cost, sum_cost
from ._staged import StagedTransfer, row_products, stage


class TwoStage(AbstractFilter):
    """Shades everyone at a middle degree; where that changed the base, at the full degree.

    Not in the paper, whose levels it replaces by one. Each degree is computed as
    `transfer.shade_glossy` does it, with light, transfer and lobe cut to that degree.

    **Options** are those of `Masks` but for `diffuse_threshold`, and

    - `middle`: degree of the first stage, from `base` to the light's (default: the one that was
      staged, or three fifths of the light's).

    Called with a frame as `shade` is; for frame after frame, give it the result of `stage` in
    place of the transfer, for the same degrees, or it stages on the way.

    The decision is on the glossy part alone: the diffuse part is computed in full for all, which
    costs less than to pick. `fallback="base"` leaves those that are not recomputed at the base,
    else they are left at the middle degree. `active_fraction` has one share, under "specular". The
    first stage knows the change of everyone, so with `rings` whole rings join, without a test.

    **Returns** an `AdaptiveResult`. Differentiable as `Masks` is. Pays against products with the
    light's matrix; against `shade_glossy` of a sampled transfer only where very few vertices are
    recomputed, which is not so at the paper's threshold. Experiment `leekim2014.table1` prints
    both.

    Raises `ValueError` for shapes and options that do not fit, for degrees that were not staged,
    and for arrays on several devices, since it gathers vertices from all over the mesh.

    **Example**

    >>> from jaxsh import adaptive
    >>> adaptive.TwoStage(middle=4).threshold
    0.02
    """

    middle: int | None = eqx.field(static=True, default=None)

    def __check_init__(self):
        if self.middle is not None:
            check_degree(self.middle, "middle")

    def __call__(
        self,
        light: Float[ArrayLike, "3 k"],
        transfer: AbstractTransfer,
        eye: Float[ArrayLike, " 3"],
        material: Material,
    ) -> AdaptiveResult:
        check_one_device("TwoStage", transfer)
        plain = plain_transfer("two_stage", transfer)
        light, eye, material = checked_frame(light, plain, eye, material)
        settings = self.settings(light, 0.0)
        target = degree_of(light.shape[-1])
        if isinstance(transfer, StagedTransfer):
            staged = transfer
        else:
            staged = stage(plain, target, middle=self.middle, base=self.base, quantized=False)
        middle = staged.middle.degree if self.middle is None else self.middle
        wanted = self.base, middle, target
        if wanted != staged.degrees:
            raise ValueError(
                f"expected the degrees that were staged as base, middle and the light's, "
                f"{staged.degrees}, got {wanted}"
            )
        previous = self.remembered(plain.num_points)
        return _two_stage(light, staged, eye, material, settings, previous)


@jax.jit
def _two_stage(light, staged, eye, material, settings: Filter, previous):
    transfer, (base, middle, target) = staged.transfer, staged.degrees
    count = staged.num_points
    axis = mirrored(eye, staged.base.positions, staged.base.normals, settings.distant)
    normals = staged.base.normal_rows()
    see = functools.partial(reflection, material, axis, normals, normalized=settings.normalized)
    albedo = albedos(material.diffuse, see(target)[1], count)

    def lobes(degree):
        return lobe_polynomial(see(degree)[0])

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
    recomputed = jnp.mean(region, dtype=basic.dtype)
    if settings.rings:
        # All changes are known, and those that are seen are inside already: whole rings join.
        region = grow(region, transfer.neighbors, lambda fringe: fringe, settings.rings)
    rest, shown = (first, middle) if settings.fallback == "level" else (basic, base)
    glossy = jnp.where(region[None], compacted(second, region), rest)
    if settings.smoothing:
        glossy = basic + smooth(glossy - basic, region, transfer.neighbors)
    irradiance = staged.diffuse.irradiances(light).T
    color = albedo["specular"] * glossy + albedo["diffuse"] * irradiance

    degrees = jnp.where(region, jnp.asarray(target, jnp.int32), jnp.asarray(shown, jnp.int32))
    stages = [sum_cost(one.degree, target) for one in (staged.base, staged.middle)]
    return AdaptiveResult(
        color=color.T,
        active_fraction={"specular": recomputed},
        relative_cost=sum(stages)
        + product_cost("diffuse", 0, target, target)
        + sum_cost(target, target) * jnp.mean(region, dtype=basic.dtype),
        shown_degree={"specular": degrees, "diffuse": jnp.full(count, target, jnp.int32)},
    )
