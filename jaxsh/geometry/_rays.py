"""Ray casting: Embree, in chunks, on every core."""

import functools
import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from .._core.host import cores
from ._mesh import Mesh

# One vector for each ray, or one for all of them.
Vectors = Float[Array | np.ndarray, "n 3"] | Float[Array | np.ndarray, " 3"]

# Rays in a chunk: few enough to share a call's rays between the cores, many enough that the cost
# of a chunk is that of its rays.
_CHUNK = (4_096, 65_536)


class Hit(NamedTuple):
    """The first surface along each of n rays (NumPy arrays).

    A miss has an infinite `distance`, `mesh` and `face` -1 and zero `barycentric`.
    """

    distance: Float[np.ndarray, " n"]  # along the ray, in the unit of the vertices; float32
    mesh: Int[np.ndarray, " n"]  # which of the scene's meshes; int32
    face: Int[np.ndarray, " n"]  # which face of that mesh; int32
    barycentric: Float[np.ndarray, "n 3"]  # weights of the face's vertices 0, 1, 2; float32


class RayScene:
    """Meshes in an Embree scene, to be asked which rays they stop.

    Takes one `Mesh` or a sequence of them; a later change of a mesh is not seen. Faces stop rays
    from both sides. In Embree's robust mode, which still lets a very few rays slip through exactly
    at an edge or a vertex (`JaxRayScene` lets none). Positions, directions and distances are
    float32 within.

    A ray that starts on a surface may hit it: start it a little off, along the normal.
    Answers do not depend on the number of threads or on how rays are cut into chunks.
    """

    def __init__(self, meshes: Mesh | Sequence[Mesh]):
        try:
            from embreex.mesh_construction import TriangleMesh
            from embreex.rtcore_scene import EmbreeScene
        except ImportError as error:
            raise ImportError(
                "RayScene needs embreex, which cannot be imported here: JaxRayScene answers the "
                "same questions without it"
            ) from error

        meshes = [meshes] if isinstance(meshes, Mesh) else list(meshes)
        if not meshes:
            raise ValueError("RayScene needs at least one mesh, got an empty sequence")
        self._scene: Any = EmbreeScene(robust=True)
        for mesh in meshes:
            vertices = np.ascontiguousarray(mesh.vertices, np.float32)
            TriangleMesh(self._scene, vertices, np.ascontiguousarray(mesh.faces, np.int32))
        # Embree builds its tree at the first query, and that must not happen on two threads.
        self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
        self._threads = cores()

    @functools.cached_property
    def _pool(self) -> ThreadPoolExecutor:
        """Started by the first query of many rays: few need no threads."""
        return ThreadPoolExecutor(self._threads)

    def occluded(
        self,
        origins: Vectors,
        directions: Vectors,
        max_distance: float | Float[Array | np.ndarray, " n"] = math.inf,
    ) -> Bool[np.ndarray, " n"]:
        """Whether anything lies on the ray within `max_distance` of its origin.

        `origins` and `directions` are (n, 3), or (3,) for one that all rays share. Directions
        need no unit length; distances are in the unit of the vertices.

        Raises `ValueError` for wrong shapes, NaN or infinite vectors, zero directions.
        """
        origins, directions = _paired(origins, directions)
        limits = _limits(max_distance, len(origins))
        result = np.empty(len(origins), bool)

        def run(part: slice) -> None:
            rays = _prepared(origins, directions, part)
            limit = limits[part].copy()  # Embree's binding wants to be able to write there
            result[part] = self._scene.run(*rays, query="OCCLUDED", dists=limit) != -1

        self._each_chunk(len(origins), run)
        return result

    def closest_hit(self, origins: Vectors, directions: Vectors) -> Hit:
        """The first surface that each ray meets. Arguments and errors as for `occluded`."""
        origins, directions = _paired(origins, directions)
        count = len(origins)
        hit = Hit(
            distance=np.empty(count, np.float32),
            mesh=np.empty(count, np.int32),
            face=np.empty(count, np.int32),
            barycentric=np.empty((count, 3), np.float32),
        )

        def run(part: slice) -> None:
            found = self._scene.run(*_prepared(origins, directions, part), output=True)
            missed = found["geomID"] == -1
            u, v = found["u"], found["v"]  # weights of vertices 1 and 2
            weights = np.stack([np.maximum(1 - u - v, 0), u, v], axis=1)
            hit.distance[part] = np.where(missed, np.inf, found["tfar"])
            hit.mesh[part] = found["geomID"]
            hit.face[part] = found["primID"]
            hit.barycentric[part] = np.where(missed[:, None], 0, weights)

        self._each_chunk(count, run)
        return hit

    def _each_chunk(self, count: int, run: Callable[[slice], None]) -> None:
        size = min(max(-(-count // self._threads), _CHUNK[0]), _CHUNK[1])
        parts = [slice(start, min(start + size, count)) for start in range(0, count, size)]
        if len(parts) == 1:
            run(parts[0])
        else:  # Embree runs without the interpreter's lock, so threads are enough
            list(self._pool.map(run, parts))


def _paired(origins: Any, directions: Any) -> tuple[np.ndarray, np.ndarray]:
    """Both as (n, 3) NumPy arrays; one that all rays share is repeated without a copy."""
    arrays = {"origins": np.asarray(origins), "directions": np.asarray(directions)}
    for name, array in arrays.items():
        if array.ndim not in (1, 2) or array.shape[-1] != 3:
            raise ValueError(f"{name} must have shape (n, 3) or (3,), got {array.shape}")
    counts = {len(array) for array in arrays.values() if array.ndim == 2}
    if len(counts) > 1:
        shapes = " and ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise ValueError(f"each ray needs one origin and one direction, got {shapes}")
    count = counts.pop() if counts else 1
    starts, towards = (np.broadcast_to(array, (count, 3)) for array in arrays.values())
    return starts, towards


def _limits(max_distance: Any, count: int) -> np.ndarray:
    """One float32 limit for each ray; one that all share is repeated without a copy."""
    if np.ndim(max_distance) not in (0, 1) or np.size(max_distance) not in (1, count):
        raise ValueError(
            f"max_distance must be a number or have shape ({count},), one for each ray, "
            f"got shape {np.shape(max_distance)}"
        )
    if np.isnan(max_distance).any():
        raise ValueError("max_distance holds NaN")
    return np.broadcast_to(np.asarray(max_distance, np.float32), count)


def _prepared(
    origins: np.ndarray, directions: np.ndarray, part: slice
) -> tuple[np.ndarray, np.ndarray]:
    """One chunk as Embree wants it: contiguous float32, directions of unit length."""
    start = np.ascontiguousarray(origins[part], np.float32)
    shared = directions.strides[0] == 0  # Embree's binding takes one row for all rays
    towards = directions[:1] if shared else directions[part]
    squared = _squared(towards)
    least, most = squared.min(), squared.max()
    # Nearly always all is well, and sums show it: the slow path is exact about what is not.
    if not (least > 1e-30 and most < 1e30 and np.isfinite(start.sum())):
        towards = directions[part].astype(np.float64)
        largest = np.abs(towards).max(axis=1, keepdims=True)
        bad = ~(np.isfinite(start).all(axis=1) & np.isfinite(largest[:, 0]) & (largest[:, 0] > 0))
        if bad.any():
            ray = int(bad.argmax())
            raise ValueError(
                f"rays need finite origins and finite directions other than zero: ray "
                f"{part.start + ray} starts at {start[ray].tolist()} towards "
                f"{towards[ray].tolist()}"
            )
        towards = towards / largest
        squared = _squared(towards)
    if least < 1 - 1e-6 or most > 1 + 1e-6:  # else they are units already
        towards = towards / np.sqrt(squared)[:, None]
    return start, np.ascontiguousarray(towards, np.float32)


def _squared(vectors: np.ndarray) -> np.ndarray:
    """Squared lengths; several times as fast as `einsum` over three columns."""
    x, y, z = vectors.T
    with np.errstate(over="ignore", invalid="ignore"):  # the caller looks at what comes out
        return x * x + y * y + z * z
