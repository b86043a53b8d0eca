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
from ._method import check_neighbors, checked_frame, plain_transfer
from ._regions import compacted, grow, seen_as_changed, smooth
from ._result import AdaptiveResult, product_cost, sum_cost
from ._sharing import axes_of, material_axes, on_rows, sharing
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

    Where several devices share the vertices, each recomputes its own. Raises `ValueError` for
    shapes and options that do not fit, and for degrees that were not staged.

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
        if self.rings or self.smoothing:
            check_neighbors("TwoStage", plain)
        shared = sharing(staged.rows.samples)
        return _two_stage(light, staged, eye, material, settings, previous, shared)


@functools.partial(jax.jit, static_argnames="shared")
def _two_stage(light, staged, eye, material, settings: Filter, previous, shared):
    base, middle, target = staged.degrees
    count, dtype = staged.num_points, light.dtype
    sampled = (2, 0, 1, 1)
    glossy, recomputed, region = on_rows(
        functools.partial(_glossy, shared.names if shared else None),
        shared,
        (
            *(None, None, None, material_axes(material), 0, 0),
            *(axes_of(staged.base, *sampled), axes_of(staged.middle, *sampled)),
            axes_of(staged.rows, 0, None),
        ),
        (1, 0, 0),
        *(light, eye, settings, material, previous),
        *(staged.transfer.neighbors, staged.base, staged.middle, staged.rows),
    )
    albedo = albedos(material.diffuse, material.specular, count)["diffuse"]
    color = glossy + albedo * staged.diffuse.irradiances(light).T

    shown = middle if settings.fallback == "level" else base
    degrees = jnp.where(region, jnp.asarray(target, jnp.int32), jnp.asarray(shown, jnp.int32))
    stages = [sum_cost(degree, target) for degree in (base, middle)]
    return AdaptiveResult(
        color=color.T,
        active_fraction={"specular": jnp.mean(recomputed, dtype=dtype)},
        relative_cost=sum(stages)
        + product_cost("diffuse", 0, target, target)
        + sum_cost(target, target) * jnp.mean(region, dtype=dtype),
        shown_degree={"specular": degrees, "diffuse": jnp.full(count, target, jnp.int32)},
    )


def _glossy(names, light, eye, settings, material, previous, neighbors, base, middle, rows):
    """Computes the glossy part of the rows at hand, who is recomputed, and who with the rings."""
    count, target = len(neighbors), degree_of(light.shape[-1])
    axis = mirrored(eye, base.positions, base.normals, settings.distant)
    normals = base.normal_rows()
    see = functools.partial(reflection, material, axis, normals, normalized=settings.normalized)
    specular = albedos(material.diffuse, see(target)[1], count)["specular"]

    def lobes(degree):
        return lobe_polynomial(see(degree)[0])

    def everyone(sampled: SampledTransfer):
        lights = light[:, : num_coefficients(sampled.degree)]
        return lobe_products(lights, sampled, axis, lobes(sampled.degree))

    full = lobes(target)

    def in_full(vertices):
        return row_products(light, rows, axis, full, vertices)

    basic, first = everyone(base), everyone(middle)
    chosen = region = materialize(
        seen_as_changed,
        jax.lax.stop_gradient(first - basic),
        threshold("specular", target, settings, previous, count),
        jax.lax.stop_gradient(settings.exposure * specular),
    )
    if settings.rings:
        # All changes are known, and those that are seen are inside already: whole rings join.
        region = grow(region, neighbors, lambda fringe: fringe, settings.rings, names)
    rest = first if settings.fallback == "level" else basic
    glossy = jnp.where(region[None], compacted(in_full, region), rest)
    if settings.smoothing:
        glossy = basic + smooth(glossy - basic, region, neighbors, names)
    return specular * glossy, chosen, region
