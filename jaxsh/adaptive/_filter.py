"""Multi-level filtering (Lee & Kim 2014, §4 and appendix), and the products that it adds up."""

import functools
import math
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from .._core.linalg import shading_tall_product, shading_tensordot
from .._core.xla import on_mesh
from ..harmonics import convolve, degree_of, evaluate, num_coefficients, product_matrix
from ..transfer import Material, Transfer
from ..transfer._glossy_kernels import reflected, reflection
from ._regions import Region, compacted, decide, everywhere, grow, seen_as_changed, smooth
from ._result import AdaptiveResult, product_cost


class Filter(eqx.Module):
    """Holds what decides, checked and in the transfer's dtype."""

    thresholds: dict[str, Float[Array, ""]]
    exposure: Float[Array, ""]
    hysteresis: Float[Array, ""]
    base: int = eqx.field(static=True)
    rings: int = eqx.field(static=True)
    smoothing: bool = eqx.field(static=True)
    fallback: str = eqx.field(static=True)
    distant: bool = eqx.field(static=True)
    normalized: bool = eqx.field(static=True)


class Products(eqx.Module):
    """Holds the factors of a frame's levels."""

    light: Float[Array, "3 k"]
    matrix: Float[Array, "3 k k"]
    transfer: Float[Array, "v k"]
    kernel: Float[Array, "v k"]

    def diffuse(self, start: int, end: int) -> Float[Array, "3 v"]:
        """Sum L_i O_i over harmonics `start` to `end`, of all vertices: algorithm 2."""
        return shading_tall_product(self.transfer[:, start:end], self.light[:, start:end]).T

    def base(self, degree: int, rows: Int[Array, " n"] | None) -> Float[Array, "3 n"]:
        """Multiply light, transfer and lobe up to a degree."""
        count = num_coefficients(degree)
        kernel, transfer = (_take(one, rows, count) for one in (self.kernel, self.transfer))
        return base_product(self.matrix, kernel, transfer, count)

    def change(self, start: int, end: int, rows: Int[Array, " n"] | None) -> Float[Array, "3 n"]:
        """Add the products from degree `start` to degree `end`."""
        old, new = num_coefficients(start), num_coefficients(end)
        kernel, transfer = (_take(one, rows, new) for one in (self.kernel, self.transfer))
        return increment(self.matrix, kernel, transfer, old, new)


def _take(table, rows, count: int) -> Float[Array, "few n"]:
    """Takes the first coefficients of some vertices, or with None of all."""
    if rows is None:
        return table[:, :count].T
    return table.at[rows, :count].get(mode="promise_in_bounds").T


def _products(light, transfer: Transfer, eye, material, options: Filter):
    degree = degree_of(light.shape[-1])
    axis = reflected(eye, transfer.positions, transfer.normals, options.distant)
    normals = transfer.normal_rows()
    zonal, specular = reflection(material, axis, normals, degree, options.normalized)

    def kernel(rows):
        if rows is None:
            return lobe_kernel(axis, zonal)
        return lobe_kernel(axis[:, rows], zonal[rows] if zonal.ndim == 2 else zonal)

    kernels = everywhere(kernel, transfer.num_points, whole=on_mesh(axis)).T
    return Products(light, product_matrix(light), transfer.coefficients, kernels), specular


@functools.partial(jax.jit, static_argnames=("compact", "names"))
def filtered(
    light: Float[Array, "3 k"],
    transfer: Transfer,
    eye: Float[Array, " 3"],
    material: Material,
    options: Filter,
    previous: dict[str, Array] | None,
    compact: bool,
    names: Any = None,
) -> AdaptiveResult:
    """Runs algorithm 1 for the diffuse and the specular part, refined and smoothed.

    `names` are of the axes of a mesh that share the vertices out, inside `shard_map`.
    """
    products, specular = _products(light, transfer, eye, material, options)
    color, cost = jnp.zeros((3, transfer.num_points), light.dtype), 0.0
    fractions, degrees = {}, {}
    for kind, albedo in albedos(material.diffuse, specular, transfer.num_points).items():
        shown, region, work = _one(
            kind, albedo, products, transfer, options, previous, compact, names
        )
        color = color + albedo * shown
        fractions[kind], degrees[kind] = region.fractions, region.degree
        cost = cost + work
    return AdaptiveResult(color.T, fractions, jnp.asarray(cost, color.dtype), degrees)


def _one(kind, albedo, products, transfer, options, previous, compact, names):
    count, target = transfer.num_points, degree_of(products.light.shape[-1])
    whole = on_mesh(products.transfer)
    seen = jax.lax.stop_gradient(options.exposure * albedo)

    # The diffuse part costs less than it does to pick those that need it.
    compact = compact and kind == "specular"

    def changes(start: int, end: int, active: Bool[Array, " v"]) -> Float[Array, "3 v"]:
        if kind == "diffuse":
            return products.diffuse(num_coefficients(start), num_coefficients(end))
        work = functools.partial(products.change, start, end)
        return compacted(work, active) if compact else everywhere(work, count, whole=whole)

    if kind == "diffuse":
        base = products.diffuse(0, num_coefficients(options.base))
    else:
        base = everywhere(functools.partial(products.base, options.base), count, whole=whole)
    region = Region.start(options.base, count, base.dtype)
    cost = functools.partial(product_cost, kind, target=target)
    total_cost = cost(0, options.base)
    for level in range(options.base + 1, target + 1):
        total_cost += cost(level - 1, level) * jnp.mean(region.active, dtype=base.dtype)
        change = changes(level - 1, level, region.active)
        region = decide(
            region,
            level,
            change,
            threshold(kind, level, options, previous, count),
            seen,
            options.fallback,
        )
    if options.rings:
        limit = threshold(kind, target, options, None, count)
        every_level = functools.partial(changes, options.base, target)

        def joins(fringe):
            return seen_as_changed(jax.lax.stop_gradient(every_level(fringe)), limit, seen)

        grown = grow(region.active, transfer.neighbors, joins, options.rings, names)
        joined = grown & ~region.active
        region = region._replace(
            added=jnp.where(joined[None], every_level(joined), region.added),
            degree=jnp.where(joined, jnp.asarray(target, jnp.int32), region.degree),
            active=grown,
        )
        total_cost += cost(options.base, target) * jnp.mean(joined, dtype=base.dtype)
    if options.smoothing:
        added = smooth(region.added, region.active, transfer.neighbors, names)
        region = region._replace(added=added)
    return base + region.added, region, total_cost if compact else cost(0, target)


def threshold(kind, level, options: Filter, previous, count) -> Float[Array, " v"]:
    """Lowers the threshold for those that the previous frame held at this level."""
    limit = jnp.full(count, 1.0, options.exposure.dtype) * options.thresholds[kind]
    if previous is None:
        return limit
    return jnp.where(previous[kind] >= level, options.hysteresis * limit, limit)


def albedos(
    diffuse: Float[Array, "..."], specular: Float[Array, "..."], count: int
) -> dict[str, Float[Array, "3 v"]]:
    def columns(albedo):
        rows = albedo if albedo.ndim == 2 else jnp.broadcast_to(albedo, (3,))[None]
        return jnp.broadcast_to(rows, (count, 3)).T

    return {"diffuse": columns(diffuse) / math.pi, "specular": columns(specular)}


def lobe_kernel(axis: Float[Array, "3 n"], zonal: Float[Array, "*n bands"]) -> Float[Array, "k n"]:
    """Computes α_i y_i(B)."""
    degree = zonal.shape[-1] - 1
    alpha = convolve(jnp.ones(num_coefficients(degree), axis.dtype), zonal)
    basis = evaluate(axis.T, degree, axis=0)
    return basis * (alpha[:, None] if alpha.ndim == 1 else alpha.T)


def base_product(
    matrix: Float[Array, "3 k k"],
    kernel: Float[Array, "kernel n"],
    transfer: Float[Array, "transfer n"],
    count: int,
) -> Float[Array, "3 n"]:
    """Computes S = Σ_ij α_i y_i(B) L̂_ij O_j over the first `count` harmonics."""
    rows = shading_tensordot(matrix[:, :count, :count], transfer[:count])
    return jnp.sum(rows * kernel[None, :count], axis=1)


def increment(
    matrix: Float[Array, "3 k k"],
    kernel: Float[Array, "kernel n"],
    transfer: Float[Array, "transfer n"],
    old: int,
    new: int,
) -> Float[Array, "3 n"]:
    """Computes what harmonics `old` to `new` add to S: algorithm 3, which repeats no product.

    Its first loop is over new rows i and all columns. Its second, over old rows and new columns,
    uses that L̂ is symmetric. The paper's adds R_i whole once more there; only the new columns'
    part is to be added.
    """
    block = matrix[:, old:new]
    by_row = shading_tensordot(block[..., :new], transfer[:new]) * kernel[None, old:new]
    by_column = shading_tensordot(block[..., :old], kernel[:old]) * transfer[None, old:new]
    return jnp.sum(by_row + by_column, axis=1)
