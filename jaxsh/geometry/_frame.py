"""The frame that rays are cast in: by the origin and of moderate size, whatever the meshes' own."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from .._core.checks import check_faces
from ._mesh import Mesh

# Sizes that are cast as they are. Tests of triangles multiply three lengths, so that float32 holds
# about 1e-12 to 1e12, and small faces and far origins need room on either side.
_LEAST, _MOST = 2.0**-20, 2.0**20
# Meshes farther from the origin than this many times their half extent are moved to it. Less far
# away, no more than two bits are lost.
_AWAY = 4
# Origins farther away than this many radii are brought nearer along their rays.
_FAR = 2.0**16


class Frame(NamedTuple):
    """Maps positions to those that rays are cast in: (position - center)·scale.

    `center` is representable in float32 and `scale` a power of two, so that float32 positions on
    the meshes lose nothing.
    """

    center: Float[np.ndarray, " 3"]
    scale: float
    middle: Float[np.ndarray, " 3"]  # of a ball around the meshes, in the frame
    radius: float

    @property
    def plain(self) -> bool:
        """True where positions stay as they are."""
        return self.scale == 1 and not self.center.any()

    @property
    def far(self) -> float:
        """Largest coordinate of an origin that is cast as it is."""
        return _FAR * (self.radius + float(np.abs(self.middle).max(initial=0)))

    def beyond(self, origins: Float[np.ndarray, "n 3"]) -> bool:
        """Tell whether some origins are not cast as they are, but brought nearer."""
        return not np.abs(self.into(origins)).max(initial=0) <= self.far

    def into(self, positions: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
        """Map positions, in float32; those beyond its range become infinite."""
        with np.errstate(over="ignore", invalid="ignore"):
            if self.plain:
                return np.asarray(positions, np.float32)
            moved = (positions.astype(np.float64) - self.center) * self.scale
            return moved.astype(np.float32)

    def rounding(self, positions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        """By how much positions are rounded within, at most, in the unit of the meshes."""
        return np.finfo(np.float32).eps * np.abs(positions - self.center).max(axis=1)

    def nearer(
        self, origins: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
        """Bring far origins along their rays to the ball, in float64.

        Gives origins in the frame, and by how much of the way there they are ahead. Rays that pass
        the ball by start beside it and lead away.
        """
        directions = directions.astype(np.float64)
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        with np.errstate(over="ignore", invalid="ignore"):
            start = (origins.astype(np.float64) - self.center) * self.scale - self.middle
            along = -np.einsum("ij,ij->i", start, directions)
            nearest = start + along[:, None] * directions
            # A little more than the ball, for what float32 rounds.
            reach = 1.01 * self.radius
            meets = (along > 0) & (np.linalg.norm(nearest, axis=1) <= reach)
            ahead = along - 2 * reach
        far = np.abs(start).max(axis=1) > self.far
        moved = np.where(
            meets[:, None],
            nearest - 2 * reach * directions,
            (2 * reach or 1) * directions,
        )
        start = np.where(far[:, None], moved, start) + self.middle
        return start.astype(np.float32), np.where(far & meets, ahead, 0)

    def limits(
        self, limits: Float[np.ndarray, " n"], ahead: Float[np.ndarray, " n"] | None
    ) -> Float[np.ndarray, " n"]:
        """Map limits of distance into the frame; a float32 array of its own."""
        with np.errstate(over="ignore"):
            if self.plain and ahead is None:
                return limits.astype(np.float32)
            moved = limits.astype(np.float64) * self.scale
            return (moved if ahead is None else moved - ahead).astype(np.float32)

    def distances(
        self, distances: Float[np.ndarray, " n"], ahead: Float[np.ndarray, " n"] | None
    ) -> Float[np.ndarray, " n"]:
        """Map distances out of the frame."""
        if self.plain and ahead is None:
            return distances
        with np.errstate(over="ignore"):
            moved = distances.astype(np.float64)
            moved = (moved if ahead is None else moved + ahead) / self.scale
            return moved.astype(np.float32)


def frame_around(low: Float[np.ndarray, " 3"], high: Float[np.ndarray, " 3"]) -> Frame:
    """Choose the frame for what lies between two corners: plain wherever float32 allows."""
    low, high = low.astype(np.float64), high.astype(np.float64)
    half, center = (high / 2 - low / 2).max(), low / 2 + high / 2
    with np.errstate(over="ignore"):
        rounded = center.astype(np.float32).astype(np.float64)
    center = np.where(np.isfinite(rounded), rounded, center)
    center = np.where(np.abs(center) > _AWAY * half, center, 0.0)
    low, high = low - center, high - center
    largest = float(max(np.abs(low).max(), np.abs(high).max()))
    scale = 1.0
    if largest > 0 and not _LEAST <= largest <= _MOST:
        scale = 2.0 ** -int(np.clip(np.frexp(largest)[1], -1000, 1000))
    low, high = low * scale, high * scale
    return Frame(center, scale, (low + high) / 2, float(np.linalg.norm(high - low)) / 2)


def framed(meshes: Sequence[Mesh]) -> tuple[list[np.ndarray], list[np.ndarray], Frame]:
    """Give the vertices of meshes in one frame, float32, their faces, int32, and the frame.

    Positions are relative to the first mesh's `origin`. Raises `ValueError` for a face that names
    no vertex.
    """
    points, faces = [], []
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for number, mesh in enumerate(meshes):
        vertices = np.asarray(mesh.vertices)
        away = np.asarray(mesh.origin) - np.asarray(meshes[0].origin)
        points.append(vertices + away if away.any() else vertices)
        faces.append(np.ascontiguousarray(mesh.faces, np.int32))
        if not faces[-1].size:
            continue
        check_faces(f"mesh {number}", faces[-1], len(vertices))
        used = np.zeros(len(vertices), bool)
        used[faces[-1].reshape(-1)] = True
        used &= np.isfinite(points[-1]).all(axis=1)
        low = np.minimum(low, points[-1][used].min(axis=0, initial=np.inf))
        high = np.maximum(high, points[-1][used].max(axis=0, initial=-np.inf))
    if not (low <= high).all():
        low = high = np.zeros(3)
    frame = frame_around(low, high)
    return [np.ascontiguousarray(frame.into(vertices)) for vertices in points], faces, frame
