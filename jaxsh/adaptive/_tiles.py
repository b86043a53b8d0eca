"""The glossy lobe interpolated in the reflected direction, tile by tile of vertices."""

import functools
import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from ..harmonics import convolve, degree_of, evaluate, phong, product_matrix
from ..transfer import Material, Transfer, shade_diffuse
from ..transfer._checks import checked_eye, checked_light, checked_material
from ..transfer._lobe import reflected
from ._costs import full_cost
from ._result import AdaptiveResult
from ._tile_frames import POWERS, Frames, constant, monomials, nodes, tile_frames
from ._tile_kernel import polynomial_products
from ._tile_sets import TileSet


def shade_tiles(
    light: Float[ArrayLike, "3 k"],
    transfer: Transfer,
    eye: Float[ArrayLike, " 3"],
    material: Material,
    tiles: TileSet,
    *,
    distant: bool = False,
    normalized: bool = True,
) -> AdaptiveResult:
    """What `transfer.shade_glossy` gives, with the lobe interpolated in the reflected direction.

    For a fixed vertex the glossy part is a smooth function of B, the eye's direction mirrored
    about the normal. In a tile of vertices with similar B the lobe's coefficients are fitted by
    the six quadratic monomials φ of B, so that

        S + D = Σ_t φ_t(B) (M_t · O),   M_t = L̂ Σ_s P_ts ρ_s (α ∘ y(B_s)) + [|B|²]_t ρ_d/π L,

    with seven nodes B_s about the tile's middle (`docs/adaptive_tiles.md`). All bands of light,
    transfer and lobe are kept; the one error is that of the fit. It is of third order in a tile's
    width, and zero (to rounding) where all of a tile's vertices have one B, and where the lobe
    has bands 0 and 2 alone. There is no threshold, so nothing pops. Not in Lee & Kim 2014. It pays
    against `shade_glossy` of a sampled transfer; experiment `leekim2014.table1` prints by how much.

    **Arguments**

    - `light`, `eye`, `material`, `distant`, `normalized`: as for `shade_glossy`; one light (3, K)
      and one exponent. Albedos per vertex take the diffuse part apart, at its cost.
    - `transfer`: what `tiles` was made of.
    - `tiles`: from `make_tiles`, or `TileAtlas.nearest`. Its middle directions and widths are of
      this `eye`, frame by frame, so that an eye other than its own costs accuracy and no more.

    **Returns** an `AdaptiveResult`; `kept` is empty. Linear in light and albedos, and
    differentiable in them and in the exponent, forward and reverse; eye and tiles are constants.

    Raises `ValueError` for shapes that do not fit, and for an exponent per vertex.
    """
    count, dtype = len(transfer.positions), transfer.positions.dtype
    if tiles.place.shape != (count,) or tiles.degree != transfer.degree:
        raise ValueError(
            f"expected tiles of {count} vertices and degree {transfer.degree}, got "
            f"{len(tiles.place)} and {tiles.degree}"
        )
    light = checked_light(light, count, transfer.degree, dtype)
    if light.ndim != 2:
        raise ValueError(f"expected one light (3, K) for all vertices, got shape {light.shape}")
    eye, material = checked_eye(eye, dtype), checked_material(material, count, dtype)
    if material.exponent.ndim:
        raise ValueError(f"expected one exponent, got one for each of {count} vertices")
    return _shade_tiles(light, transfer, eye, material, tiles, distant, normalized)


@functools.partial(jax.jit, static_argnames=("distant", "normalized"))
def _shade_tiles(light, transfer, eye, material, tiles, distant, normalized):
    width, even = light.shape[-1], max(material.specular.ndim, material.diffuse.ndim) < 2
    specular = material.specular if even else jnp.ones((), light.dtype)
    diffuse = material.diffuse if even else jnp.zeros((), light.dtype)

    blocks, size = tiles.tiling.order.shape
    axis, normals = (
        jax.lax.stop_gradient(rows).reshape(3, blocks, size)
        for rows in (reflected(eye, tiles.positions, tiles.normals, distant), tiles.normals.T)
    )
    tile, count = tiles.tiling.tile, tiles.tiling.count
    frames = jax.lax.stop_gradient(tile_frames(axis, normals, tiles.areas, tile, count))
    lobe = phong(material.exponent, degree_of(width), normalized=normalized)
    terms = _terms(light, frames, lobe, specular, diffuse)
    columns = tiles.coefficients[:, :width]
    color = polynomial_products(terms[tile], columns, monomials(axis, frames, tile))
    color = jnp.swapaxes(color, 1, 2).reshape(-1, 3)
    color = color.at[tiles.place].get(mode="promise_in_bounds")
    if not even:
        flat = (
            jnp.broadcast_to(material.specular, color.shape)
            if material.specular.ndim == 2
            else (material.specular.reshape((1, -1)))
        )
        color = color * flat + shade_diffuse(light, transfer, material.diffuse)
    per_vertex = 1 + count * width / len(transfer.positions)
    spent = len(POWERS) * 3 * width * per_vertex / full_cost(degree_of(width))
    return AdaptiveResult(color, {}, jnp.asarray(spent, color.dtype))


def _terms(
    light: Float[Array, "3 k"],
    frames: Frames,
    lobe: Float[Array, " bands"],
    specular: Float[Array, "..."],
    diffuse: Float[Array, "..."],
) -> Float[Array, "tiles 6 3 k"]:
    """M: L̂ Σ_s P_ts ρ_s (α ∘ y(B_s)) + [|B|²]_t ρ_d/π L, as one matrix product.

    Nothing comes after the product, since XLA would compute that anew for every vertex.
    """
    width = light.shape[-1]
    directions, fit = nodes(frames)
    lobes = convolve(evaluate(directions, degree_of(width)), lobe.astype(light.dtype))
    glossy = jnp.matmul(fit, lobes, precision="highest")
    rows = jnp.concatenate([glossy, constant(frames)[..., None]], axis=-1)
    product = product_matrix(light) * specular.reshape(-1, 1, 1)  # symmetric in its last two axes
    irradiance = light * (diffuse / math.pi).reshape(-1, 1)
    columns = jnp.concatenate([product, irradiance[..., None]], axis=-1)
    terms = jnp.matmul(
        rows.reshape(-1, width + 1), columns.reshape(-1, width + 1).T, precision="highest"
    )
    return terms.reshape(*rows.shape[:2], *light.shape)
