"""Glossy shading with a few numbers a vertex, whose weights change smoothly across each tile."""

import math
from collections.abc import Iterator

import equinox as eqx
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from .._core.checks import check_cosine, check_flag, check_size, check_type
from .._core.xla import equal_blocks
from ..transfer import AbstractTransfer, Material, Transfer
from ._local_rule import REACH, LocalRule, check_rule, local_rule, num_tiles_for
from ._method import AbstractMethod, check_known, check_set, one_exponent, plain_transfer
from ._result import AdaptiveResult
from ._sharing import Shared, on_each_device, sharing
from ._staged import diffuse_part
from ._tile_samples import arrange_all, joined, outlined, places, slice_of
from ._tile_set import TileSet
from ._tiling import Tiling, make_tiling

EXPONENT = 32.0


def make_tiles(
    transfer: Transfer,
    eye: Float[ArrayLike, " 3"],
    *,
    distant: bool = False,
    num_tiles: int | None = None,
    block: int | None = None,
    components: int | None = None,
    exponent: float = EXPONENT,
    reach: float = REACH,
    quantized: bool = True,
    diffuse: AbstractTransfer | None = None,
) -> TileSet:
    """Regroup and sample the transfer by reflected direction, for the view from `eye`.

    **Arguments**

    - `transfer`: with known values. Where several devices share its vertices, each device's have
      tiles of their own, `num_tiles` on each.
    - `eye`: a point, or with `distant` the direction to an eye far away.
    - `num_tiles`: more are more exact. By default 400, and more for sharper lobes, to 1,200.
    - `block`: the number of vertices that a tile's size is a multiple of; by default 64, and a
      smaller power of two for a small mesh. Devices that share the vertices share it too, down to
      16, so that their tiles are as narrow as one device's.
    - `components`: numbers of a vertex that its glossy part is made of. More are more exact, and
      cost more per frame. By default as many as degree, exponent and reach take for an expected
      error of 2.4 %: 24 at degree 10 and exponent 32, 48 at exponent 1,000.
    - `exponent`: of the lobes to come. Others are less exact.
    - `reach`: how far, in radians about the mesh, the eye goes from here, at most 0.5. Further away
      the error grows slowly.
    - `quantized`: whether these numbers and the diffuse part are rounded to eight bits.
    - `diffuse`: the diffuse part, where it is there already, in any form.

    **Returns** a `TileSet`, to be called with light, eye and material. It holds `components`
    numbers a vertex, and the diffuse part. Neither traceable nor differentiable; raises
    `ValueError` for an eye that is no vector, for numbers below 1, for an exponent that is not
    above -1, and for a reach outside 0 to 0.5.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import adaptive, sphere, transfer
    >>> points, eye = sphere.fibonacci(50).directions, jnp.asarray([0.0, -3.0, 0.0])
    >>> made = transfer.unshadowed(points, points, degree=2)
    >>> tiles = adaptive.make_tiles(made, eye, num_tiles=3, block=8)
    >>> tiles(jnp.ones((3, 9)), eye, transfer.Material(0.5, 0.5, 32.0)).color.shape
    (50, 3)
    """
    check_rule(components, exponent, reach)
    check_type("transfer", transfer, Transfer)
    check_known("make_tiles", transfer, eye)
    if num_tiles is None:
        num_tiles = num_tiles_for(transfer.degree, exponent)
    tiling = make_tiling(transfer, eye, distant=distant, num_tiles=num_tiles, block=block)
    return arrange(
        transfer,
        tiling,
        components=components,
        exponent=exponent,
        reach=reach,
        quantized=quantized,
        diffuse=diffuse,
    )


def arrange(
    transfer: Transfer,
    tiling: Tiling,
    *,
    components: int | None = None,
    exponent: float = EXPONENT,
    reach: float = REACH,
    quantized: bool = True,
    diffuse: AbstractTransfer | None = None,
) -> TileSet:
    """Put the transfer in the order of a tiling, in few numbers a vertex.

    Other arguments and errors as for `make_tiles`; raises `ValueError` for a tiling of another
    mesh, or of one that is shared out otherwise, too.

    **Example**

    >>> from jaxsh import adaptive, sphere, transfer
    >>> points = sphere.fibonacci(50).directions
    >>> made = transfer.unshadowed(points, points, degree=2)
    >>> tiling = adaptive.make_tiling(made, points[0], num_tiles=3, block=8)
    >>> adaptive.arrange(made, tiling, components=5).samples.shape
    (7, 5, 8)
    """
    check_rule(components, exponent, reach)
    check_type("transfer", transfer, Transfer)
    check_cosine(transfer)
    check_type("tiling", tiling, Tiling)
    quantized = check_flag("quantized", quantized)
    check_known("arrange", transfer, tiling)
    shared = sharing(transfer.coefficients)
    place = places(tiling.permutation, transfer.num_points, shared)
    rule = local_rule(transfer.degree, components, float(exponent), float(reach))
    rule = _placed(rule, transfer, shared)
    diffuse = diffuse_part(transfer, diffuse, quantized)
    arranged = arrange_all(transfer, tiling, rule[1], rule[0], quantized, shared)
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
    rows, *outline = outlined(transfer, tiling, parts[1], parts[0], shared)
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
    samples, scales, lights, positions, normals = arranged
    return TileSet(
        tiling,
        place=place,
        samples=samples,
        scales=scales,
        lights=lights,
        core=rule[2],
        functions=rule[3],
        reach=rule[4],
        positions=positions,
        normals=normals,
        diffuse=diffuse,
        group=len(place) // (shared.parts if shared else 1),
    )


class Tiles(AbstractMethod):
    """Shades glossily with weights that change smoothly across each tile: see `TileSet`.

    **Options**

    - `tiles`: from `make_tiles` or a `TileAtlas`, of this transfer. Without them the others are
      `make_tiles`' arguments, with the material's exponent where none is said, and they are made
      anew in each call.
    - `distant`, `normalized`: as for a call of a `TileSet`.

    **Example**

    >>> from jaxsh import adaptive
    >>> adaptive.Tiles(components=40).reach
    0.25
    """

    tiles: TileSet | None = None
    num_tiles: int | None = eqx.field(static=True, default=None)
    block: int | None = eqx.field(static=True, default=None)
    components: int | None = eqx.field(static=True, default=None)
    exponent: float | None = eqx.field(static=True, default=None)
    reach: float = eqx.field(static=True, default=REACH)
    quantized: bool = eqx.field(static=True, default=True)
    distant: bool = eqx.field(static=True, default=False)
    normalized: bool = eqx.field(static=True, default=True)

    def __check_init__(self):
        if self.tiles is not None:
            check_type("tiles", self.tiles, TileSet)
        for name in ("num_tiles", "block"):
            if getattr(self, name) is not None:
                check_size(name, getattr(self, name))
        check_rule(self.components, 1.0 if self.exponent is None else self.exponent, self.reach)
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
                components=self.components,
                exponent=exponent,
                reach=self.reach,
                quantized=self.quantized,
            )
        check_set("tiles", tiles.num_points, tiles.degree, transfer)
        return tiles(light, eye, material, distant=self.distant, normalized=self.normalized)
