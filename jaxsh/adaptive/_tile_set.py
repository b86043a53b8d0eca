"""A transfer in the order of a tiling, which shades frame after frame."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, Int, Int8

from .._core.checks import check_flag
from .._core.linalg import matmul
from .._core.xla import materialize
from ..harmonics import degree_of, phong
from ..transfer import AbstractTransfer, Material, shade_diffuse
from ..transfer._glossy_kernels import (
    block_sums,
    checked_eye,
    checked_material,
    checked_one_light,
    mirrored,
)
from ._method import check_whole_degree, one_exponent
from ._result import AdaptiveResult, full_cost, product_cost, sum_cost
from ._sharing import on_rows, own, sharing_of_groups
from ._tiling import Tiling


class TileSet(eqx.Module):
    """Holds a transfer in the order of a tiling, ready for frame after frame.

    Made by `make_tiles`, `arrange` or a `TileAtlas`; called with a frame, it shades. It serves any
    eye, and best the one it was made for. Sets of one mesh, number of tiles and block have the
    same shapes, so that code compiled for one serves all.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import adaptive, sphere, transfer
    >>> points = sphere.fibonacci(50).directions
    >>> made = transfer.unshadowed(points, points, degree=2)
    >>> eye, mirror = jnp.asarray([0.0, -3.0, 0.0]), transfer.Material(0.5, 0.5, 32.0)
    >>> tiles = adaptive.make_tiles(made, eye, num_tiles=3, block=8)
    >>> tiles(jnp.ones((3, 9)), eye, mirror).color.shape
    (50, 3)
    """

    tiling: Tiling
    place: Int[Array, " v"]  # where in the permutation each vertex is
    samples: Int8[Array, "blocks n b"] | Float[Array, "blocks n b"]
    scales: Float[Array, "blocks n"]  # a value, in a tile's directions, is sample times scale
    directions: Float[Array, "tiles n 3"]
    basis: Float[Array, "k tiles n"]  # there
    powers: Float[Array, "terms bands"]  # of the lobe around them, as `LocalRule` has it
    lowest: Float[Array, ""]
    positions: Float[Array, "3 places"]
    normals: Float[Array, "3 places"]  # at unit length
    diffuse: AbstractTransfer
    # So many vertices after another have tiles among themselves: those of a device.
    group: int = eqx.field(static=True)

    @property
    def num_points(self) -> int:
        return len(self.place)

    @property
    def degree(self) -> int:
        return degree_of(len(self.basis))

    def __call__(
        self,
        light: Float[ArrayLike, "3 k"],
        eye: Float[ArrayLike, " 3"],
        material: Material,
        *,
        distant: bool = False,
        normalized: bool = True,
    ) -> AdaptiveResult:
        """Shade a frame, with each tile's lobes summed in a few directions where they look.

        `transfer.shade_glossy` sums light times transfer times lobe over directions all around, as
        many as are exact: 350 at degree 10. The vertices of a tile mirror the eye to nearly the
        same direction B, and a lobe is small away from it. So a tile has a few directions of its
        own,

            S = ρ_s Σ_n L(ω_n) lobe(B·ω_n) (A O)_n,

        with weights A that make the most of them (`docs/adaptive_tiles.md`). No band of light,
        transfer or lobe is dropped, and each vertex has its own B. There is no threshold; the
        error changes at once only where another tile set takes over. The diffuse part is computed
        in full. Not in Lee & Kim 2014. Experiment `leekim2014.table1` prints what it gains.

        **Arguments**

        - `light`, `eye`, `material`, `distant`, `normalized`: as for `transfer.shade_glossy`; one
          light (3, K) of the transfer's degree, and one exponent. An eye or an exponent other than
          those that the set was made for costs accuracy and no more.

        **Returns** an `AdaptiveResult`; `active_fraction` is empty. Linear in light and albedos,
        and differentiable in them, in the eye and in the exponent, forward and reverse; the
        transfer's glossy part is a constant.

        Raises `ValueError` for shapes that do not fit, for an exponent per vertex, for a roughness,
        whose lobe changes with the angle of view, and for a set that is shared out over devices
        otherwise than the transfer was that it was made of.
        """
        count, dtype = self.num_points, self.basis.dtype
        light = checked_one_light(light, count, self.degree, dtype)
        check_whole_degree("tiles", light, self.degree)
        eye, material = checked_eye(eye, dtype), checked_material(material, count, dtype)
        one_exponent(material, count)
        shared = sharing_of_groups("a TileSet", self.place, self.group)
        distant, normalized = check_flag("distant", distant), check_flag("normalized", normalized)
        return _shade_tiles(light, eye, material, self, distant, normalized, shared)


@functools.partial(jax.jit, static_argnames=("distant", "normalized", "shared"))
def _shade_tiles(light, eye, material, tiles, distant, normalized, shared):
    width, count, directions = tiles.basis.shape
    zonal = phong(one_exponent(material, count), tiles.degree, normalized=normalized)
    lobe = matmul(tiles.powers, zonal)
    rows = tiles.tiling.tile, tiles.place, tiles.samples, tiles.scales, tiles.directions
    points = tiles.basis, tiles.positions, tiles.normals
    glossy = on_rows(
        functools.partial(_glossy, distant),
        shared,
        (None, None, None, None, 0, 1),
        0,
        *(light, eye, lobe, tiles.lowest, rows, points),
    )
    albedo = material.specular
    albedo = albedo if albedo.ndim == 2 else albedo.reshape(1, -1)
    color = glossy * albedo + shade_diffuse(light, tiles.diffuse, material.diffuse)
    degree, terms = tiles.degree, len(tiles.powers)
    cost = product_cost("diffuse", 0, degree, degree)
    cost += sum_cost(degree, degree, directions, terms)
    cost += count * directions * 3 * width / len(tiles.place) / full_cost(degree)  # of the light
    return AdaptiveResult(color, {}, jnp.asarray(cost, color.dtype))


def _glossy(distant, light, eye, lobe, lowest, rows, points):
    """Computes the glossy part of the rows at hand."""
    tile, place, samples, scales, at = rows
    basis, positions, normals = points
    (width, count, directions), (blocks, _, size) = basis.shape, samples.shape
    tile, place = own(tile, count), own(place, blocks * size)
    lights = matmul(light, basis.reshape(width, -1)).reshape(3, count, directions)
    weights = jnp.swapaxes(lights, 0, 1)[tile] * scales[:, None]

    axis = mirrored(eye, positions, normals, distant).reshape(3, blocks, 1, size)
    values = materialize(_lobed, axis, at[tile], lobe, lowest, samples)
    glossy = materialize(block_sums, weights, values)
    # Rows of four, since a gather of three takes one number at a time.
    glossy = jnp.pad(jnp.swapaxes(glossy, 1, 2), ((0, 0), (0, 0), (0, 1))).reshape(-1, 4)
    return glossy.at[place].get(mode="promise_in_bounds")[:, :3]


def _lobed(axis, directions, lobe, lowest, samples):
    x, y, z = (directions[..., i, None] for i in range(3))
    t = jnp.maximum(x * axis[0] + y * axis[1] + z * axis[2], lowest) - (1 + lowest) / 2
    return samples.astype(t.dtype) * functools.reduce(lambda value, c: value * t + c, lobe[::-1])
