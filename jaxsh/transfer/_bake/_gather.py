"""One block of vertices: its shadowed coefficients, and those of a bounce."""

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int, UInt8

from ..._core.host import put
from ..._core.linalg import matmul
from ...geometry import EmbreeRayScene, RayScene
from ._directions import Directions
from ._receivers import Faces, Receivers, basis_at, expanded

# Rows of every product: with one fixed shape a vertex's sums are added in one fixed order,
# whatever the block it comes in.
TILE = 64
# Rows in a call, whose tiles are multiplied each by itself: a call takes longer than the product of
# one. Never another number, so that one compiled program serves all.
_BLOCK = 4 * TILE


class Bundle(NamedTuple):
    """Holds directions as every block uses them."""

    across: Float[Array, "3 d"]  # by component, on a device
    rays: Float[np.ndarray, "d 4"]  # float32, of which the first three count


class Lights(NamedTuple):
    """Holds what every block uses of `Directions`."""

    bundle: Bundle
    basis: Float[Array, "d k"]  # on a device
    nearest: Int[np.ndarray, " r"]
    around: Int[np.ndarray, "n g"]


def bundle_of(vectors: Float[np.ndarray, "d 3"]) -> Bundle:
    """Prepare directions for `bounced`."""
    return Bundle(put(vectors.T), in_fours(vectors.astype(np.float32)))


def lights_of(directions: Directions) -> Lights:
    """Prepare directions for `shadowed`."""
    vectors, basis, nearest, around = directions
    return Lights(bundle_of(vectors), put(basis), nearest, around)


def in_fours(vectors: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 4"]:
    """Fill vectors up with a zero: NumPy copies four numbers faster than three."""
    return np.pad(vectors, ((0, 0), (0, 1)))


def exact_rows(
    normals: Float[np.ndarray, "rows 3"], degree: int, cosine: bool
) -> Float[np.ndarray, "rows k"]:
    """Compute the coefficients of points on which nothing casts a shadow."""

    def program(part: np.ndarray) -> Array:
        return _expanded(part, basis_at(part, degree), cosine=cosine)

    return _in_pieces(program, normals)


_expanded = jax.jit(expanded, static_argnames="cosine")


def shadowed(
    scene: RayScene,
    receivers: Receivers,
    lights: Lights,
    degree: int,
    rows: slice,
) -> Float[np.ndarray, "rows k"]:
    """Project visibility times cosine: the cosine's coefficients less those of the blocked part.

    Without cosine visibility alone, likewise.

    The cosine's are exact, so that only the blocked part carries the error of the directions, and
    none is left where nothing is blocked. Exactly zero where no ray gets out.
    """
    normals, cosine = receivers.normals[rows], receivers.cosine
    facing = functools.partial(_above, across=lights.bundle.across, cosine=cosine)
    above = _in_pieces(facing, normals)
    blocked = _blocked(scene, receivers.origins[rows], lights, above)
    state = np.add(above, blocked, dtype=np.uint8)

    def program(part: np.ndarray, state: np.ndarray) -> Array:
        own = basis_at(part, degree)
        return _lit(part, own, state, lights.bundle.across, lights.basis, cosine=cosine)

    return _in_pieces(program, normals, state)


@functools.partial(jax.jit, static_argnames="cosine")
def _above(
    normals: Float[Array, "rows 3"], across: Float[Array, "3 d"], *, cosine: bool
) -> Bool[Array, "rows d"]:
    return _cosines(normals, across, cosine=cosine) > 0


@functools.partial(jax.jit, static_argnames="cosine")
def _cosines(
    normals: Float[Array, "rows 3"], across: Float[Array, "3 d"], *, cosine: bool
) -> Float[Array, "rows d"]:
    """Compute by what light along each direction counts; no ray is cast where that is not > 0."""
    if not cosine:
        return jnp.ones((len(normals), across.shape[1]), normals.dtype)
    x, y, z = (normals[:, axis, None] * across[None, axis] for axis in range(3))
    return x + y + z


@functools.partial(jax.jit, static_argnames="cosine")
def _lit(
    normals: Float[Array, "rows 3"],
    own: Float[Array, "rows k"],  # y_i at the normals
    state: UInt8[Array, "rows d"],  # of a direction: 0 below the surface, 1 open, 2 blocked
    across: Float[Array, "3 d"],
    basis: Float[Array, "d k"],
    *,
    cosine: bool,
) -> Float[Array, "rows k"]:
    def of_tile(tile: tuple[Array, Array, Array]) -> Float[Array, "tile k"]:
        normals, own, state = tile
        lost = jnp.where(state == 2, _cosines(normals, across, cosine=cosine), 0)
        rows = expanded(normals, own, cosine=cosine) - matmul(lost, basis)
        # Something is blocked and nothing open; in one reduction, as 3 for open.
        dark = jnp.max(jnp.where(state == 1, np.uint8(3), state), axis=1) == 2
        return jnp.where(dark[:, None], 0, rows)

    tiles = (array.reshape(-1, TILE, array.shape[1]) for array in (normals, own, state))
    return lax.map(of_tile, tuple(tiles)).reshape(len(normals), -1)


def _in_pieces(program: Callable[..., Any], *arrays: np.ndarray) -> np.ndarray:
    """Run a program on `_BLOCK` rows of the arrays at a time, the last ones filled up with zeros.

    By XLA, whose threads yield the cores while idle; OpenBLAS's spin, and take them from the rays.
    """
    count = len(arrays[0])
    found = []
    for start in range(0, count, _BLOCK):
        rows = [array[start : start + _BLOCK] for array in arrays]
        some = len(rows[0])
        if some < _BLOCK:
            rows = [np.pad(part, ((0, _BLOCK - some), (0, 0))) for part in rows]
        found.append(np.asarray(program(*rows))[:some])
    return found[0] if len(found) == 1 else np.concatenate(found)


def _blocked(
    scene: RayScene,
    origins: Float[np.ndarray, "rows 3"],
    lights: Lights,
    above: Bool[np.ndarray, "rows d"],
) -> Bool[np.ndarray, "rows d"]:
    """Find the blocked directions above the surface with as few rays as tell them."""
    (_, vectors), _, nearest, around = lights
    guides, stops = around.shape[1], scene.occluded
    if (
        isinstance(scene, EmbreeRayScene)
        and type(scene).occluded is EmbreeRayScene.occluded  # and not a user's own
        and not scene.frame.beyond(origins)
    ):
        origins, stops = scene.frame.into(origins), scene.stops
    starts = in_fours(origins)

    def cast(
        wanted: Bool[np.ndarray, "rows n"],
        towards: Float[np.ndarray, "n 4"],
        blocked: Bool[np.ndarray, "rows n"],
    ) -> None:
        rays = _rays(starts, towards, wanted)
        blocked.reshape(-1)[rays.flat] = stops(rays.origins, rays.directions)

    known = np.ascontiguousarray(above[:, :guides])
    answer = np.zeros(known.shape, bool)
    cast(known, vectors[:guides], answer)
    if not len(around):
        return answer
    # By guide: 0 below the surface, 1 open, 2 blocked. Of those around the bits are collected, so
    # that 3 tells of both. A guide's numbers lie side by side, which to gather takes little time.
    own = np.add(known, answer, dtype=np.uint8).T.copy()
    met = own.copy()
    for other in around:
        met |= own[other]
    # 0 lets light through, 1 stops it, 2 is to be cast.
    told = np.where((own == 0) | (met == 3), np.uint8(2), own == 2).T.copy()
    told = np.take(told, nearest, axis=1)
    rest = above[:, guides:]
    blocked = rest & (told == 1)
    cast(rest & (told == 2), vectors[guides:], blocked)
    return np.concatenate([answer, blocked], axis=1)


def bounced(
    scene: RayScene,
    receivers: Receivers,
    bundle: Bundle,
    surface: Faces,
    share: Float[np.ndarray, " v_or_1"],
    before: Float[np.ndarray, "m k"],
    rows: slice,
) -> Float[np.ndarray, "rows k"]:
    """Sum w max(0, n·ω) share · before over the rays that meet the front of a face of the mesh.

    At a hit they are interpolated between the vertices of the face with its barycentrics.
    """
    from scipy.sparse import csr_array

    facing = functools.partial(_cosines, across=bundle.across, cosine=receivers.cosine)
    cosines = _in_pieces(facing, receivers.normals[rows])
    rays = _rays(in_fours(receivers.origins[rows]), bundle.rays, cosines > 0)
    hit = scene.closest_hit(rays.origins, rays.directions)
    met = np.flatnonzero(hit.mesh == 0)
    met = met[np.einsum("ij,ij->i", surface.outward[hit.face[met]], rays.directions[met]) < 0]

    weights = cosines.reshape(-1)[rays.flat[met]] * (4 * math.pi / len(bundle.rays))
    weights = weights[:, None] * hit.barycentric[met].astype(cosines.dtype)
    ends = 3 * np.searchsorted(met, rays.ends)
    corners = surface.faces[hit.face[met]]
    weights *= share[corners] if len(share) > 1 else share
    shape = len(cosines), len(before)
    return csr_array((weights.ravel(), corners.ravel(), ends), shape) @ before


class _Rays(NamedTuple):
    flat: Int[np.ndarray, " n"]  # index into the array of rows and directions
    ends: Int[np.ndarray, " rows+1"]  # rays before each row, and all
    origins: Float[np.ndarray, "n 3"]
    directions: Float[np.ndarray, "n 3"]


def _rays(
    origins: Float[np.ndarray, "rows 4"],
    directions: Float[np.ndarray, "d 4"],
    wanted: Bool[np.ndarray, "rows d"],
) -> _Rays:
    """Make one ray for each pair that is wanted, row by row."""
    flat, width = np.flatnonzero(wanted), wanted.shape[1]
    firsts = np.arange(len(wanted) + 1) * width
    ends = np.searchsorted(flat, firsts)
    count = np.diff(ends)
    # `repeat` and `take` copy four numbers at once, several times as fast as indexing does.
    towards = np.take(directions, flat - np.repeat(firsts[:-1], count), axis=0)
    return _Rays(flat, ends, np.repeat(origins, count, axis=0)[:, :3], towards[:, :3])
