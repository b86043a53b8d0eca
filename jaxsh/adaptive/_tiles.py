"""Glossy shading with a few quadrature directions around each tile's mirrored direction."""

import functools
import math
from collections.abc import Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int, Int8

from .._core.checks import check_cosine, check_flag, check_size, check_type
from .._core.linalg import matmul
from .._core.xla import equal_blocks, materialize
from ..harmonics import degree_of, phong
from ..transfer import AbstractTransfer, Material, Transfer, shade_diffuse
from ..transfer._glossy_kernels import (
    block_sums,
    checked_eye,
    checked_material,
    checked_one_light,
    mirrored,
)
from ._local_rule import LocalRule, check_rule, local_rule
from ._method import (
    AbstractMethod,
    check_known,
    check_set,
    check_whole_degree,
    one_exponent,
    plain_transfer,
)
from ._result import AdaptiveResult, full_cost, product_cost, sum_cost
from ._sharing import Shared, on_each_device, on_rows, own, sharing, sharing_of_groups
from ._staged import diffuse_part
from ._tile_samples import arrange_all, joined, outlined, places, slice_of
from ._tiling import BLOCK, NUM_TILES, Tiling, make_tiling

DIRECTIONS = 40
EXPONENT = 32.0


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


def make_tiles(
    transfer: Transfer,
    eye: Float[ArrayLike, " 3"],
    *,
    distant: bool = False,
    num_tiles: int = NUM_TILES,
    block: int = BLOCK,
    directions: int = DIRECTIONS,
    exponent: float = EXPONENT,
    quantized: bool = True,
    diffuse: AbstractTransfer | None = None,
) -> TileSet:
    """Regroup and sample the transfer by reflected direction, for the view from `eye`.

    **Arguments**

    - `transfer`: with known values. Where several devices share its vertices, each device's have
      tiles of their own, `num_tiles` on each.
    - `eye`: a point, or with `distant` the direction to an eye far away.
    - `num_tiles`: more are more exact.
    - `block`: the number of vertices that a tile's size is a multiple of. Devices that share the
      vertices share it too, down to 16, so that their tiles are as narrow as one device's.
    - `directions`: of each tile. More are more exact, and cost more per frame; as many as
      `transfer.sample` takes leave no error.
    - `exponent`: of the lobes to come. Others are less exact.
    - `quantized`: whether samples and the diffuse part are rounded to eight bits; the error of the
      samples' rounding does not show beside that of the directions.
    - `diffuse`: the diffuse part, where it is there already, in any form.

    **Returns** a `TileSet`, to be called with light, eye and material. It takes `directions`
    numbers a vertex, and the diffuse part. Neither traceable nor differentiable; raises
    `ValueError` for an eye that is no vector, for numbers below 1, and for an exponent that is not
    above -1.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import adaptive, sphere, transfer
    >>> points, eye = sphere.fibonacci(50).directions, jnp.asarray([0.0, -3.0, 0.0])
    >>> made = transfer.unshadowed(points, points, degree=2)
    >>> tiles = adaptive.make_tiles(made, eye, num_tiles=3, block=8)
    >>> tiles(jnp.ones((3, 9)), eye, transfer.Material(0.5, 0.5, 32.0)).color.shape
    (50, 3)
    """
    check_rule(directions, exponent)
    tiling = make_tiling(transfer, eye, distant=distant, num_tiles=num_tiles, block=block)
    return arrange(
        transfer,
        tiling,
        directions=directions,
        exponent=exponent,
        quantized=quantized,
        diffuse=diffuse,
    )


def arrange(
    transfer: Transfer,
    tiling: Tiling,
    *,
    directions: int = DIRECTIONS,
    exponent: float = EXPONENT,
    quantized: bool = True,
    diffuse: AbstractTransfer | None = None,
) -> TileSet:
    """Sample the transfer in the order of a tiling, in directions about each tile's own.

    Other arguments and errors as for `make_tiles`; raises `ValueError` for a tiling of another
    mesh, or of one that is shared out otherwise, too.

    **Example**

    >>> from jaxsh import adaptive, sphere, transfer
    >>> points = sphere.fibonacci(50).directions
    >>> made = transfer.unshadowed(points, points, degree=2)
    >>> tiling = adaptive.make_tiling(made, points[0], num_tiles=3, block=8)
    >>> adaptive.arrange(made, tiling, directions=9).samples.shape
    (7, 9, 8)
    """
    check_rule(directions, exponent)
    check_type("transfer", transfer, Transfer)
    check_cosine(transfer)
    check_type("tiling", tiling, Tiling)
    quantized = check_flag("quantized", quantized)
    check_known("arrange", transfer, tiling)
    shared = sharing(transfer.coefficients)
    place = places(tiling.permutation, transfer.num_points, shared)
    rule = _placed(local_rule(transfer.degree, directions, float(exponent)), transfer, shared)
    diffuse = diffuse_part(transfer, diffuse, quantized)
    arranged = arrange_all(transfer, tiling, rule[0], rule[1], quantized, shared)
    return _tile_set(tiling, place, rule, diffuse, arranged, shared)


def arranged_in_slices(
    transfer: Transfer,
    tiling: Tiling,
    place: Int[Array, " v"],
    rule: LocalRule,
    diffuse: AbstractTransfer,
    slices: int,
) -> Iterator[TileSet | None]:
    """Does what `arrange` does, in eight bits, in so many slices; yields None, and the set last.

    Looks at no values, so that it waits for nothing that is under way on the device.
    """
    shared = sharing(transfer.coefficients)
    parts = _placed(rule, transfer, shared)
    rows, *outline = outlined(transfer, tiling, parts[0], parts[1], shared)
    blocks = len(tiling.tile) // (shared.parts if shared else 1)
    size = equal_blocks(blocks, math.ceil(blocks / slices))
    done, starts = [], []
    for start in range(0, blocks, size):
        # The last slice begins early, so that all have one shape and take one program.
        first = min(start, blocks - size)
        done.append(slice_of(transfer, tiling, rows, np.int32(first), size, shared))
        starts.append(start - first)
        if start + size < blocks:
            yield None
    slices_ = zip(*done, strict=True)
    samples, scales = (joined(some, tuple(starts), shared) for some in slices_)
    yield _tile_set(tiling, place, parts, diffuse, (samples, scales, *outline), shared)


def _placed(rule: LocalRule, transfer: Transfer, shared: Shared | None) -> tuple[Array, ...]:
    dtype = transfer.positions.dtype
    return tuple(on_each_device(np.asarray(part, dtype), shared) for part in rule)


def _tile_set(tiling, place, rule, diffuse, arranged, shared) -> TileSet:
    samples, scales, at, basis, positions, normals = arranged
    return TileSet(
        tiling,
        place=place,
        samples=samples,
        scales=scales,
        directions=at,
        basis=basis,
        powers=rule[2],
        lowest=rule[3],
        positions=positions,
        normals=normals,
        diffuse=diffuse,
        group=len(place) // (shared.parts if shared else 1),
    )


class Tiles(AbstractMethod):
    """Shades glossily in a few directions around each tile's mirrored direction: see `TileSet`.

    **Options**

    - `tiles`: from `make_tiles` or a `TileAtlas`, of this transfer. Without them the others are
      `make_tiles`' arguments, with the material's exponent where none is said, and they are made
      anew in each call.
    - `distant`, `normalized`: as for a call of a `TileSet`.

    **Example**

    >>> from jaxsh import adaptive
    >>> adaptive.Tiles(directions=60).num_tiles
    128
    """

    tiles: TileSet | None = None
    num_tiles: int = eqx.field(static=True, default=NUM_TILES)
    block: int = eqx.field(static=True, default=BLOCK)
    directions: int = eqx.field(static=True, default=DIRECTIONS)
    exponent: float | None = eqx.field(static=True, default=None)
    quantized: bool = eqx.field(static=True, default=True)
    distant: bool = eqx.field(static=True, default=False)
    normalized: bool = eqx.field(static=True, default=True)

    def __check_init__(self):
        if self.tiles is not None:
            check_type("tiles", self.tiles, TileSet)
        check_size("num_tiles", self.num_tiles)
        check_size("block", self.block)
        check_rule(self.directions, 1.0 if self.exponent is None else self.exponent)
        for name in ("quantized", "distant", "normalized"):
            check_flag(name, getattr(self, name))

    def __call__(
        self,
        light: Float[ArrayLike, "3 k"],
        transfer: AbstractTransfer,
        eye: Float[ArrayLike, " 3"],
        material: Material,
    ) -> AdaptiveResult:
        tiles = self.tiles
        if tiles is None:
            check_type("transfer", transfer, AbstractTransfer)
            check_type("material", material, Material)
            given = one_exponent(material, transfer.num_points)
            check_known("Tiles without a tile set", transfer, eye, material)
            exponent = float(given) if self.exponent is None else self.exponent
            tiles = make_tiles(
                plain_transfer("tiles", transfer),
                eye,
                distant=self.distant,
                num_tiles=self.num_tiles,
                block=self.block,
                directions=self.directions,
                exponent=exponent,
                quantized=self.quantized,
            )
        check_set("tiles", tiles.num_points, tiles.degree, transfer)
        return tiles(light, eye, material, distant=self.distant, normalized=self.normalized)


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
