"""Multi-level filtering (Lee & Kim 2014, §4 and appendix), whichever way its products are made."""

import functools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from .._core.linalg import tall_product
from ..harmonics import degree_of, num_coefficients, product_matrix
from ..transfer import Material, Transfer
from ..transfer._glossy_kernels import reflected
from ._compact import compacted, everywhere
from ._costs import product_cost
from ._products import base_product, increment, lobe_kernel
from ._refine import grow, smooth
from ._result import AdaptiveResult
from ._roi import Region, decide, seen_as_changed


class Filter(eqx.Module):
    """What decides, checked and in the transfer's dtype."""

    thresholds: dict[str, Float[Array, ""]]
    exposure: Float[Array, ""]
    leave: Float[Array, ""]
    base: int = eqx.field(static=True)
    rings: int = eqx.field(static=True)
    smoothing: bool = eqx.field(static=True)
    outside: str = eqx.field(static=True)
    distant: bool = eqx.field(static=True)
    normalized: bool = eqx.field(static=True)


class Products(eqx.Module):
    """What the levels of a frame are made of."""

    light: Float[Array, "3 k"]
    matrix: Float[Array, "3 k k"]
    transfer: Float[Array, "v k"]
    kernel: Float[Array, "v k"]

    def diffuse(self, start: int, end: int) -> Float[Array, "3 v"]:
        """Σ_i L_i O_i over harmonics `start` to `end`, of all vertices: algorithm 2."""
        return tall_product(self.transfer[:, start:end], self.light[:, start:end]).T

    def base(self, degree: int, rows: Int[Array, " n"]) -> Float[Array, "3 n"]:
        count = num_coefficients(degree)
        kernel, transfer = (_take(one, rows, count) for one in (self.kernel, self.transfer))
        return base_product(self.matrix, kernel, transfer, count)

    def change(self, start: int, end: int, rows: Int[Array, " n"]) -> Float[Array, "3 n"]:
        """From degree `start` to degree `end`."""
        old, new = num_coefficients(start), num_coefficients(end)
        kernel, transfer = (_take(one, rows, new) for one in (self.kernel, self.transfer))
        return increment(self.matrix, kernel, transfer, old, new)


def _take(table: Float[Array, "v k"], rows: Int[Array, " n"], count: int) -> Float[Array, "few n"]:
    return table.at[rows, :count].get(mode="promise_in_bounds").T


def _products(light, transfer: Transfer, eye, exponent, options: Filter) -> Products:
    degree = degree_of(light.shape[-1])
    axis = reflected(eye, transfer.positions, transfer.normals, options.distant)

    def kernel(rows):
        own = exponent[rows] if exponent.ndim else exponent
        return lobe_kernel(axis[:, rows], own, degree, options.normalized)

    kernels = everywhere(kernel, len(transfer.positions)).T
    return Products(light, product_matrix(light), transfer.coefficients, kernels)


@functools.partial(jax.jit, static_argnames="compact")
def filtered(
    light: Float[Array, "3 k"],
    transfer: Transfer,
    eye: Float[Array, " 3"],
    material: Material,
    options: Filter,
    previous: dict[str, Array] | None,
    compact: bool,
) -> AdaptiveResult:
    """Algorithm 1 for the diffuse and the specular part, refined and smoothed."""
    products = _products(light, transfer, eye, material.exponent, options)
    color, spent = jnp.zeros((3, len(transfer.positions)), light.dtype), 0.0
    kept, reached = {}, {}
    for kind, albedo in albedos(material, len(transfer.positions)).items():
        shown, region, work = _one(kind, albedo, products, transfer, options, previous, compact)
        color = color + albedo * shown
        kept[kind], reached[kind] = region.kept, region.reached
        spent = spent + work
    return AdaptiveResult(color.T, kept, jnp.asarray(spent, color.dtype), reached)


def _one(kind, albedo, products, transfer, options, previous, compact):
    count, target = len(transfer.positions), degree_of(products.light.shape[-1])
    seen = jax.lax.stop_gradient(options.exposure * albedo)

    # The diffuse part costs less than it does to pick those that need it.
    compact = compact and kind == "specular"

    def changes(start: int, end: int, active: Bool[Array, " v"]) -> Float[Array, "3 v"]:
        if kind == "diffuse":
            return products.diffuse(num_coefficients(start), num_coefficients(end))
        work = functools.partial(products.change, start, end)
        return compacted(work, active) if compact else everywhere(work, count)

    if kind == "diffuse":
        base = products.diffuse(0, num_coefficients(options.base))
    else:
        base = everywhere(functools.partial(products.base, options.base), count)
    region = Region.start(options.base, count, base.dtype)
    cost = functools.partial(product_cost, kind, target=target)
    spent = cost(0, options.base)
    for level in range(options.base + 1, target + 1):
        spent += cost(level - 1, level) * jnp.mean(region.active, dtype=base.dtype)
        change = changes(level - 1, level, region.active)
        region = decide(
            region,
            level,
            change,
            threshold(kind, level, options, previous, count),
            seen,
            options.outside,
        )
    if options.rings:
        limit = threshold(kind, target, options, None, count)
        whole = functools.partial(changes, options.base, target)

        def joins(fringe):
            return seen_as_changed(jax.lax.stop_gradient(whole(fringe)), limit, seen)

        grown = grow(region.active, transfer.neighbors, joins, options.rings)
        joined = grown & ~region.active
        region = region._replace(
            added=jnp.where(joined[None], whole(joined), region.added),
            reached=jnp.where(joined, jnp.asarray(target, jnp.int32), region.reached),
            active=grown,
        )
        spent += cost(options.base, target) * jnp.mean(joined, dtype=base.dtype)
    if options.smoothing:
        added = smooth(region.added, region.active, transfer.neighbors)
        region = region._replace(added=added)
    return base + region.added, region, spent if compact else cost(0, target)


def threshold(kind, level, options: Filter, previous, count) -> Float[Array, " v"]:
    """Lower for those that the previous frame held at this level."""
    limit = jnp.full(count, 1.0, options.exposure.dtype) * options.thresholds[kind]
    if previous is None:
        return limit
    return jnp.where(previous[kind] >= level, options.leave * limit, limit)


def albedos(material: Material, count: int) -> dict[str, Float[Array, "3 v"]]:
    def columns(albedo):
        rows = albedo if albedo.ndim == 2 else jnp.broadcast_to(albedo, (3,))[None]
        return jnp.broadcast_to(rows, (count, 3)).T

    return {
        "diffuse": columns(material.diffuse) / math.pi,
        "specular": columns(material.specular),
    }
