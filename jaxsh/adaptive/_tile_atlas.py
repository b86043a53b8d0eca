"""Tile sets for a camera that moves: split beforehand for many views, the nearest taken."""

import math
from collections.abc import Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from .._core.checks import check_number, check_size, check_type
from ..sphere import fibonacci
from ..transfer import AbstractTransfer, Transfer, quantize
from ..transfer._glossy_kernels import checked_eye
from ._local_rule import FARTHEST, check_rule, local_rule, num_tiles_for
from ._method import check_known
from ._sharing import sharing
from ._tile_samples import places
from ._tile_set import TileSet
from ._tiles import EXPONENT, arrange, arranged_in_slices
from ._tiling import Tiling, make_tiling, vertex_areas

# Slices of a set on an accelerator: at 50,000 vertices and degree 10 one is some 3,000 vertices.
_SLICES = 16
# How far from the nearest of n directions of `fibonacci` any is at most, times √n.
_APART = 2.7


class TileAtlas(eqx.Module):
    """Holds tilings of one mesh for eyes all around it. Made by `make_tile_atlas`.

    It holds indices and each tile's axis, 4 bytes a vertex and view; the transfer is put in a
    view's order, and sampled, when needed.

    **Example**

    >>> from jaxsh import adaptive, sphere, transfer
    >>> points = sphere.fibonacci(50).directions
    >>> made = transfer.unshadowed(points, points, degree=2)
    >>> atlas = adaptive.make_tile_atlas(made, views=3, num_tiles=2, block=16)
    >>> atlas.view(atlas.eyes[2]), atlas.permutation.shape
    (2, (3, 4, 16))
    """

    permutation: Int[Array, "views blocks b"]
    tile: Int[Array, "views blocks"]
    axes: Float[Array, "views tiles 3"]
    eyes: Float[Array, "views 3"]  # directions from the center to each eye
    center: Float[Array, " 3"]  # of the mesh's box; zero where the eyes are far away
    components: int | None = eqx.field(static=True)
    exponent: float = eqx.field(static=True)
    reach: float = eqx.field(static=True)

    def view(self, eye: Float[ArrayLike, " 3"]) -> int:
        """Return the number of the view whose direction is nearest to that of `eye`."""
        towards = np.asarray(checked_eye(eye, self.center.dtype)) - np.asarray(self.center)
        return int(np.argmax(np.asarray(self.eyes) @ towards))

    def tiling(self, view: int) -> Tiling:
        """Return the tiling of a view, by its number."""
        if check_size("view", view, least=0) >= len(self.eyes):
            raise ValueError(f"expected a view from 0 to {len(self.eyes) - 1}, got {view}")
        return Tiling(self.permutation[view], self.tile[view], self.axes[view])

    def nearest(
        self,
        transfer: Transfer,
        eye: Float[ArrayLike, " 3"],
        *,
        diffuse: AbstractTransfer | None = None,
    ) -> TileSet:
        """Make the tile set of the nearest view. All sets of an atlas have the same shapes.

        `diffuse` is the diffuse part, where it is there already (default: eight bits, made anew).
        """
        return self.arranged(transfer, self.view(eye), diffuse=diffuse)

    def arranged(
        self, transfer: Transfer, view: int, *, diffuse: AbstractTransfer | None = None
    ) -> TileSet:
        """Make the tile set of a view, by its number."""
        return arrange(
            transfer,
            self.tiling(view),
            components=self.components,
            exponent=self.exponent,
            reach=self.reach,
            diffuse=diffuse,
        )


def make_tile_atlas(
    transfer: Transfer,
    *,
    distance: float | None = None,
    views: int = 128,
    num_tiles: int | None = None,
    block: int | None = None,
    components: int | None = None,
    exponent: float = EXPONENT,
    reach: float | None = None,
) -> TileAtlas:
    """Make tilings for `views` directions, spread evenly over the sphere.

    The eyes stand at `distance` from the center of the mesh's box, or far away (default). Of 128
    views the nearest to an eye is 0.12 radians away on average and 0.24 at most, of 32 twice as
    far; `reach` is that most by default, up to 0.5. Other arguments and errors as for
    `make_tiles`; raises `ValueError` for fewer than one view too.

    **Example**

    >>> from jaxsh import adaptive, sphere, transfer
    >>> points = sphere.fibonacci(50).directions
    >>> made = transfer.unshadowed(points, points, degree=2)
    >>> atlas = adaptive.make_tile_atlas(made, views=3, num_tiles=2, block=16)
    >>> atlas.nearest(made, atlas.eyes[1]).samples.shape
    (4, 9, 16)
    """
    views = check_size("views", views)
    reach = min(_APART / math.sqrt(views), FARTHEST) if reach is None else reach
    check_rule(components, exponent, reach)
    check_type("transfer", transfer, Transfer)
    check_known("make_tile_atlas", transfer)
    if num_tiles is None:
        num_tiles = num_tiles_for(transfer.degree, exponent)
    if distance is not None:
        distance = check_number("distance", distance, above=0.0)
    towards = fibonacci(views).directions.astype(transfer.positions.dtype)
    distant, center = distance is None, jnp.zeros((3,), transfer.positions.dtype)
    eyes = towards
    if distance is not None:
        middle = (transfer.positions.max(axis=0) + transfer.positions.min(axis=0)) / 2
        center = jnp.asarray(np.asarray(middle))  # of the vertices of all devices
        eyes = center[None] + distance * towards
    areas = vertex_areas(transfer)
    tilings = [
        make_tiling(transfer, eye, distant=distant, num_tiles=num_tiles, block=block, areas=areas)
        for eye in eyes
    ]
    permutation, tile, axes = (
        jnp.stack([getattr(one, name) for one in tilings])
        for name in ("permutation", "tile", "axes")
    )
    return TileAtlas(permutation, tile, axes, towards, center, components, exponent, reach)


class TileFollower:
    """Follows an eye with the sets of an atlas, without waiting until the next one is ready.

    The set of the nearest view is arranged while frames go on with the one before, whose accuracy
    falls off slowly with the angle between the views: in `slices`, one in each call, so that no
    frame waits for more than one of them. By default that is all in one on a CPU, whose other
    threads do it in the background, and 16 on an accelerator, which does one thing after the
    other. Frames meanwhile share the machine with that and are slower, and starting it takes a
    moment of its own. The `keep` sets last used are kept, for an eye that comes back; where the
    eye will go is known, `prepare` spares the frames all of it. Raises `ValueError` for a `keep`
    below 2 and for no slice.

    **Example**

    >>> from jaxsh import adaptive, sphere, transfer
    >>> points = sphere.fibonacci(50).directions
    >>> made = transfer.unshadowed(points, points, degree=2)
    >>> atlas = adaptive.make_tile_atlas(made, views=3, num_tiles=2, block=16)
    >>> follow = adaptive.TileFollower(atlas, made, atlas.eyes[0])
    >>> follow.prepare(atlas.eyes)
    3
    >>> follow(atlas.eyes[1]).num_points
    50
    """

    def __init__(
        self,
        atlas: TileAtlas,
        transfer: Transfer,
        eye: Float[ArrayLike, " 3"],
        *,
        keep: int = 4,
        slices: int | None = None,
    ):
        check_type("atlas", atlas, TileAtlas)
        check_type("transfer", transfer, Transfer)
        if check_size("keep", keep) < 2:
            raise ValueError(f"expected keep of at least 2, this set and the next, got {keep}")
        check_known("TileFollower", atlas, transfer)
        if slices is None:
            devices = transfer.coefficients.devices()
            slices = 1 if all(device.platform == "cpu" for device in devices) else _SLICES
        self._slices = check_size("slices", slices)
        self._atlas, self._transfer, self._keep = atlas, transfer, keep
        # Looked at once, since that waits for the device.
        shared, count = sharing(transfer.coefficients), transfer.num_points
        self._permutation = np.asarray(atlas.permutation) if shared is None else None
        some = [] if shared is None else atlas.permutation
        self._places = [places(one, count, shared) for one in some]
        self._begun: tuple[int, Iterator[TileSet | None]] | None = None
        self._diffuse = quantize(transfer)  # which all sets share
        self._sets: dict[int, TileSet] = {}  # the one last used at the end
        self._view = atlas.view(eye)
        self._use(self._view)

    def __call__(self, eye: Float[ArrayLike, " 3"]) -> TileSet:
        """Return the set of the nearest view, or the one before until that is ready."""
        view = self._atlas.view(eye)
        if self._begun is not None:
            self._go_on(*self._begun)
        elif all(map(_is_ready, self._sets.values())):  # one at a time is under way
            if view in self._sets or self._slices == 1:
                self._use(view)
            else:
                self._go_on(view, self._in_slices(view))
        if view in self._sets and _is_ready(self._sets[view]):
            self._view = view
        return self._sets[self._view]

    def prepare(self, eyes: Float[ArrayLike, "n 3"]) -> int:
        """Arrange the sets for these eyes now, keep them, and return their number."""
        views = list(dict.fromkeys(self._atlas.view(eye) for eye in np.asarray(eyes)))
        self._keep = max(self._keep, len(views) + 1)
        for view in views:
            jax.block_until_ready(self._use(view))
        return len(views)

    def _in_slices(self, view: int) -> Iterator[TileSet | None]:
        atlas, made = self._atlas, self._transfer
        if self._permutation is not None:
            place = places(self._permutation[view], made.num_points, None)
        else:
            place = self._places[view]
        rule = local_rule(made.degree, atlas.components, atlas.exponent, atlas.reach)
        return arranged_in_slices(
            made, atlas.tiling(view), place, rule, self._diffuse, self._slices
        )

    def _go_on(self, view: int, slices: Iterator[TileSet | None]) -> None:
        done = next(slices)
        self._begun = (view, slices) if done is None else None
        if done is not None:
            self._use(view, done)

    def _use(self, view: int, made: TileSet | None = None) -> TileSet:
        found = self._sets.pop(view, made)
        self._sets[view] = found or self._atlas.arranged(
            self._transfer, view, diffuse=self._diffuse
        )
        oldest = [v for v in self._sets if v not in (view, self._view)]
        for dropped in oldest[: max(len(self._sets) - self._keep, 0)]:
            del self._sets[dropped]
        return self._sets[view]


def _is_ready(tiles: TileSet) -> bool:
    return all(leaf.is_ready() for leaf in jax.tree.leaves(tiles))
