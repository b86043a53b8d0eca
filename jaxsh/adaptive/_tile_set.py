"""A transfer in the order of a tiling, which shades frame after frame."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, Int, Int8

from .._core.checks import check_flag
from .._core.linalg import matmul, tensordot
from .._core.xla import materialize
from ..harmonics import degree_of, phong
from ..transfer import AbstractTransfer, Material, shade_diffuse
from ..transfer._glossy_kernels import (
    checked_eye,
    checked_material,
    checked_one_light,
    mirrored,
)
from ._method import check_whole_degree, one_exponent
from ._result import AdaptiveResult, full_cost, product_cost
from ._sharing import on_rows, own, sharing_of_groups
from ._tile_samples import turns
from ._tile_sums import ORDERS, lobe_sums
from ._tile_weights import placed, tile_weights
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
    scales: Float[Array, "blocks n"]  # a number of a vertex is sample times scale
    lights: Float[Array, "k tiles m"]  # the rule's, around each tile's axis
    core: Float[Array, "bands m g n"]  # of the rule
    functions: Float[Array, "g monomials"]
    reach: Float[Array, ""]
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
        return degree_of(len(self.lights))

    def __call__(
        self,
        light: Float[ArrayLike, "3 k"],
        eye: Float[ArrayLike, " 3"],
        material: Material,
        *,
        distant: bool = False,
        normalized: bool = True,
    ) -> AdaptiveResult:
        """Shade a frame, with weights that change smoothly across each tile.

        The vertices of a tile mirror the eye to nearly the same direction B. Around it glossy light

            S = ρ_s ∫ L(ω) O(ω) lobe(B·ω) dω

        is made of a few numbers of the light, M L, and of the transfer, A O, and smooth in B:

            S ≈ ρ_s Σ_n w_n(B) (A O)_n,    w_n(B) = Σ_m (M L)_m c_mn(B),

        with M, A and c the best for lights and transfers to come (`docs/adaptive_tiles.md`). In
        each frame w is computed for each tile, with first and second derivatives in B, where its
        vertices mirror this eye on average; each vertex has the sum for its own B. There is no
        threshold; the error changes at once only where another tile set takes over. The diffuse
        part is computed in full. Not in Lee & Kim 2014. Experiment `leekim2014.table1` prints what
        it gains.

        **Arguments**

        - `light`, `eye`, `material`, `distant`, `normalized`: as for `transfer.shade_glossy`; one
          light (3, K) of the transfer's degree, and one exponent. An eye or an exponent far from
          those that the set was made for costs accuracy and no more.

        **Returns** an `AdaptiveResult`; `active_fraction` is empty. Linear in light and albedos,
        and differentiable in them, in the eye and in the exponent, forward and reverse; the
        transfer's glossy part is a constant.

        Raises `ValueError` for shapes that do not fit, for an exponent per vertex, for a roughness,
        whose lobe changes with the angle of view, and for a set that is shared out over devices
        otherwise than the transfer was that it was made of.
        """
        count, dtype = self.num_points, self.lights.dtype
        light = checked_one_light(light, count, self.degree, dtype)
        check_whole_degree("tiles", light, self.degree)
        eye, material = checked_eye(eye, dtype), checked_material(material, count, dtype)
        one_exponent(material, count)
        shared = sharing_of_groups("a TileSet", self.place, self.group)
        distant, normalized = check_flag("distant", distant), check_flag("normalized", normalized)
        return _shade_tiles(light, eye, material, self, distant, normalized, shared)


@functools.partial(jax.jit, static_argnames=("distant", "normalized", "shared"))
def _shade_tiles(light, eye, material, tiles, distant, normalized, shared):
    zonal = phong(one_exponent(material, tiles.num_points), tiles.degree, normalized=normalized)
    core = tensordot(zonal, tiles.core)
    rows = tiles.tiling.tile, tiles.tiling.axes, tiles.place, tiles.samples, tiles.scales
    points = tiles.lights, tiles.positions, tiles.normals
    glossy = on_rows(
        functools.partial(_glossy, distant),
        shared,
        (None, None, None, None, 0, 1),
        0,
        *(light, eye, core, (tiles.functions, tiles.reach), rows, points),
    )
    albedo = material.specular
    albedo = albedo if albedo.ndim == 2 else albedo.reshape(1, -1)
    color = glossy * albedo + shade_diffuse(light, tiles.diffuse, material.diffuse)
    degree, (numbers, powers, components) = tiles.degree, core.shape
    cost = product_cost("diffuse", 0, degree, degree)
    cost += 3 * len(ORDERS) * components / full_cost(degree)
    of_tile = 3 * numbers * len(tiles.lights) + 3 * components * powers * (numbers + len(ORDERS))
    cost += len(tiles.tiling.axes) * of_tile / len(tiles.place) / full_cost(degree)
    return AdaptiveResult(color, {}, jnp.asarray(cost, color.dtype))


def _glossy(distant, light, eye, core, within, rows, points):
    """Computes the glossy part of the rows at hand."""
    tile, axes, place, samples, scales = rows
    (functions, reach), (of_tiles, positions, normals) = within, points
    (width, count, numbers), (blocks, _, size) = of_tiles.shape, samples.shape
    tile, place = own(tile, count), own(place, blocks * size)

    def seen(eye, positions, normals):
        axis = mirrored(eye, positions, normals, distant)
        return tuple(part.reshape(3, blocks, size) for part in (axis, normals))

    axis, normals = materialize(seen, eye, positions, normals)
    middle, wide, changes = placed(axis, normals, tile, turns(axes))
    lights = matmul(light, of_tiles.reshape(width, -1)).reshape(3, count, numbers)
    weights = tile_weights(jnp.swapaxes(lights, 0, 1), core, functions, middle, wide, reach)
    weights = weights[tile] * jnp.tile(scales, (1, len(ORDERS)))[:, None]
    glossy = materialize(lobe_sums, weights, samples, changes)
    # Rows of four, since a gather of three takes one number at a time.
    glossy = jnp.pad(jnp.swapaxes(glossy, 1, 2), ((0, 0), (0, 0), (0, 1))).reshape(-1, 4)
    return glossy.at[place].get(mode="promise_in_bounds")[:, :3]
