"""One block of vertices: its shadowed coefficients, and those of a bounce."""

import math
from typing import NamedTuple

import jax
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from ..._core.linalg import matmul
from ...geometry import RayScene
from ._directions import Directions
from ._receivers import Faces, Receivers, unshadowed

# Rows of every product: with one fixed shape a vertex's sums are added in one fixed order,
# whatever the block it comes in.
TILE = 64
# Tiles in a call, each multiplied by itself: a call takes longer than the product of a small one.
_TOGETHER = 4


def shadowed(
    scene: RayScene,
    receivers: Receivers,
    directions: Directions,
    degree: int,
    rows: slice,
) -> Float[np.ndarray, "rows k"]:
    """Project visibility times cosine: the cosine's coefficients less those of the blocked part.

    Without cosine visibility alone, likewise.

    The cosine's are exact, so that only the blocked part carries the error of the directions, and
    none is left where nothing is blocked. Exactly zero where no ray gets out.
    """
    normals = receivers.normals[rows]
    cosines = _cosines(receivers, directions.vectors, rows)
    above = cosines > 0
    blocked = _blocked(scene, receivers.origins[rows], directions, above)
    part = _in_tiles(cosines * blocked, directions.basis)
    coefficients = unshadowed(normals, degree, receivers.cosine) - part
    coefficients[above.any(axis=1) & (above == blocked).all(axis=1)] = 0
    return coefficients


def _blocked(
    scene: RayScene,
    origins: Float[np.ndarray, "rows 3"],
    directions: Directions,
    above: Bool[np.ndarray, "rows d"],
) -> Bool[np.ndarray, "rows d"]:
    """Find the blocked directions above the surface with as few rays as tell them."""
    blocked = np.zeros(above.shape, bool)

    def cast(wanted: Bool[np.ndarray, "rows d"]) -> None:
        rays = _rays(origins, directions.vectors, wanted)
        blocked.reshape(-1)[rays.flat] = scene.occluded(rays.origins, rays.directions)

    guides, nearest = directions.guides, directions.nearest
    first = np.zeros_like(above)
    first[:, guides] = above[:, guides]
    cast(first)
    if not len(directions.around):
        return blocked
    answer = blocked[:, guides]
    known = above[:, guides]
    doubtful = ~known
    for other in directions.around:
        doubtful |= (answer != answer[:, other]) & known[:, other]
    # For all directions at once: 0 lets light through, 1 stops it, 2 is to be cast.
    told = np.take(np.where(doubtful, np.uint8(2), answer), nearest, axis=1)
    rest = above & ~first
    cast(rest & (told == 2))
    return blocked | (rest & (told == 1))


def bounced(
    scene: RayScene,
    receivers: Receivers,
    vectors: Float[np.ndarray, "d 3"],
    surface: Faces,
    share: Float[np.ndarray, " v_or_1"],
    before: Float[np.ndarray, "m k"],
    rows: slice,
) -> Float[np.ndarray, "rows k"]:
    """Sum w max(0, n·ω) share · before over the rays that meet the front of a face of the mesh.

    At a hit they are interpolated between the vertices of the face with its barycentrics.
    """
    from scipy.sparse import csr_array

    cosines = _cosines(receivers, vectors, rows)
    rays = _rays(receivers.origins[rows], vectors, cosines > 0)
    hit = scene.closest_hit(rays.origins, rays.directions)
    met = np.flatnonzero(hit.mesh == 0)
    met = met[np.einsum("ij,ij->i", surface.outward[hit.face[met]], rays.directions[met]) < 0]

    weights = cosines.reshape(-1)[rays.flat[met]] * (4 * math.pi / len(vectors))
    weights = weights[:, None] * hit.barycentric[met].astype(cosines.dtype)
    ends = 3 * np.searchsorted(rays.row[met], np.arange(len(cosines) + 1))
    corners = surface.faces[hit.face[met]]
    weights *= share[corners] if len(share) > 1 else share
    shape = len(cosines), len(before)
    return csr_array((weights.ravel(), corners.ravel(), ends), shape) @ before


def _cosines(
    receivers: Receivers, vectors: Float[np.ndarray, "d 3"], rows: slice
) -> Float[np.ndarray, "rows d"]:
    """Compute by what light along each direction counts; no ray is cast where that is not > 0."""
    normals = receivers.normals[rows]
    if receivers.cosine:
        return _in_tiles(normals, vectors.T)
    return np.ones((len(normals), len(vectors)), normals.dtype)


class _Rays(NamedTuple):
    flat: Int[np.ndarray, " n"]  # index into the array of rows and directions
    row: Int[np.ndarray, " n"]
    origins: Float[np.ndarray, "n 3"]
    directions: Float[np.ndarray, "n 3"]


def _rays(
    origins: Float[np.ndarray, "rows 3"],
    directions: Float[np.ndarray, "d 3"],
    wanted: Bool[np.ndarray, "rows d"],
) -> _Rays:
    """Make one ray for each pair that is wanted, row by row."""
    count = np.count_nonzero(wanted, axis=1)
    flat = np.flatnonzero(wanted)
    row = np.repeat(np.arange(len(wanted)), count)
    # `repeat` and `take` copy whole vectors, several times as fast as indexing does.
    towards = np.take(directions, flat - row * wanted.shape[1], axis=0)
    return _Rays(flat, row, np.repeat(origins, count, axis=0), towards)


def _in_tiles(
    left: Float[np.ndarray, "rows n"], right: Float[np.ndarray | Array, "n k"]
) -> Float[np.ndarray, "rows k"]:
    """Multiply matrices, `TILE` rows at a time, the last ones filled up with zeros.

    By XLA, whose threads yield the cores while idle; OpenBLAS's spin, and take them from the rays.
    """
    result = np.empty((len(left), right.shape[1]), left.dtype)
    start = 0
    while start < len(left):
        # One tile or several, never another number: two programs serve all blocks.
        rows = TILE if len(left) - start <= TILE else _TOGETHER * TILE
        part = left[start : start + rows]
        whole = part
        if len(part) < rows:
            whole = np.zeros((rows, left.shape[1]), left.dtype)
            whole[: len(part)] = part
        products = np.asarray(_products(whole.reshape(-1, TILE, left.shape[1]), right))
        result[start : start + rows] = products.reshape(rows, -1)[: len(part)]
        start += rows
    return result


@jax.jit
def _products(tiles: Array, right: Array) -> Array:
    return lax.map(lambda tile: matmul(tile, right), tiles)
