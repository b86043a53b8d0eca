"""The glossy lobe where it looks: sums over few directions, tile by tile of vertices."""

import functools

import jax
import jax.numpy as jnp
from jaxtyping import ArrayLike, Float

from .._core.linalg import matmul
from .._core.xla import materialize
from ..harmonics import degree_of, phong
from ..transfer import Material, QuantizedTransfer, Transfer, shade_diffuse
from ..transfer._glossy_kernels import (
    block_sums,
    checked_eye,
    checked_light,
    checked_material,
    mirrored,
)
from ._costs import full_cost, product_cost, sum_cost
from ._result import AdaptiveResult
from ._tile_sets import TileSet


def shade_tiles(
    light: Float[ArrayLike, "3 k"],
    transfer: Transfer | QuantizedTransfer,
    eye: Float[ArrayLike, " 3"],
    material: Material,
    tiles: TileSet,
    *,
    distant: bool = False,
    normalized: bool = True,
) -> AdaptiveResult:
    """What `transfer.shade_glossy` gives, with each tile's lobes summed where they look.

    `shade_glossy` sums light times transfer times lobe over directions all around, as many as
    are exact: 350 at degree 10. The vertices of a tile mirror the eye to nearly the same
    direction B, and a lobe is small away from it. So a tile has a few directions of its own,

        S = ρ_s Σ_n L(ω_n) lobe(B·ω_n) (A O)_n,

    with weights A that make the most of them (`docs/adaptive_tiles.md`). No band of light,
    transfer or lobe is dropped, and each vertex has its own B. There is no threshold; the
    error changes at once only where another tile set takes over. The diffuse part is computed in
    full. Not in Lee & Kim 2014. Experiment
    `leekim2014.table1` prints what it gains.

    **Arguments**

    - `light`, `eye`, `material`, `distant`, `normalized`: as for `shade_glossy`; one light (3, K)
      of the transfer's degree, and one exponent.
    - `transfer`: what `tiles` was made of, for the diffuse part; faster where `quantize` made
      eight bits of it.
    - `tiles`: from `make_tiles`, or `TileAtlas.nearest`. An eye or an exponent other than those it
      was made for costs accuracy and no more.

    **Returns** an `AdaptiveResult`; `kept` is empty. Linear in light and albedos, and
    differentiable in them, in the eye and in the exponent, forward and reverse; the transfer's
    glossy part is a constant.

    Raises `ValueError` for shapes that do not fit, and for an exponent per vertex.
    """
    count, dtype = transfer.num_points, tiles.basis.dtype
    if tiles.place.shape != (count,) or tiles.degree != transfer.degree:
        raise ValueError(
            f"expected tiles of {count} vertices and degree {transfer.degree}, got "
            f"{len(tiles.place)} and {tiles.degree}"
        )
    light = checked_light(light, count, transfer.degree, dtype)
    if light.ndim != 2:
        raise ValueError(f"expected one light (3, K) for all vertices, got shape {light.shape}")
    if degree_of(light.shape[-1]) != tiles.degree:
        raise ValueError(
            f"expected a light of the tiles' degree, {tiles.degree}, got "
            f"{degree_of(light.shape[-1])}"
        )
    eye, material = checked_eye(eye, dtype), checked_material(material, count, dtype)
    if material.exponent.ndim:
        raise ValueError(f"expected one exponent, got one for each of {count} vertices")
    return _shade_tiles(light, transfer, eye, material, tiles, distant, normalized)


@functools.partial(jax.jit, static_argnames=("distant", "normalized"))
def _shade_tiles(light, transfer, eye, material, tiles, distant, normalized):
    tile, (blocks, size) = tiles.tiling.tile, tiles.tiling.order.shape
    width, count, directions = tiles.basis.shape
    basis = tiles.basis.reshape(width, -1)
    lights = matmul(light, basis).reshape(3, count, directions)
    weights = jnp.swapaxes(lights, 0, 1)[tile] * tiles.steps[:, None]

    axis = mirrored(eye, tiles.positions, tiles.normals, distant).reshape(3, blocks, 1, size)
    zonal = phong(material.exponent, tiles.degree, normalized=normalized)
    lobe = matmul(tiles.powers, zonal)
    values = materialize(_lobed, axis, tiles.directions[tile], lobe, tiles.lowest, tiles.samples)
    glossy = materialize(block_sums, weights, values)
    # Rows of four, since a gather of three takes one number at a time.
    glossy = jnp.pad(jnp.swapaxes(glossy, 1, 2), ((0, 0), (0, 0), (0, 1))).reshape(-1, 4)
    glossy = glossy.at[tiles.place].get(mode="promise_in_bounds")[:, :3]

    albedo = material.specular
    albedo = albedo if albedo.ndim == 2 else albedo.reshape(1, -1)
    color = glossy * albedo + shade_diffuse(light, transfer, material.diffuse)
    degree, terms = tiles.degree, len(tiles.powers)
    spent = product_cost("diffuse", 0, degree, degree)
    spent += sum_cost(degree, degree, directions, terms)
    spent += count * directions * 3 * width / len(tiles.place) / full_cost(degree)  # of the light
    return AdaptiveResult(color, {}, jnp.asarray(spent, color.dtype))


def _lobed(axis, directions, lobe, lowest, samples):
    x, y, z = (directions[..., i, None] for i in range(3))
    t = jnp.maximum(x * axis[0] + y * axis[1] + z * axis[2], lowest) - (1 + lowest) / 2
    return samples.astype(t.dtype) * functools.reduce(lambda value, c: value * t + c, lobe[::-1])
