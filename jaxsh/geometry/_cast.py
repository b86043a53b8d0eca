"""Ray casting without Embree, by JAX."""

import math
from collections.abc import Callable, Iterator, Sequence

import jax
import numpy as np
from jaxtyping import Array, Bool, Float

from .._core.checks import check_all
from ._frame import Frame, framed
from ._mesh import Mesh
from ._rays import Hit, Vectors, limits_of, paired, prepared
from ._trace import Trace, cast
from ._tree import RayTree, ray_tree

# Lanes on a CPU fit its cache.
_LANES = {"cpu": 2048}
# An accelerator hides memory's latency behind as many threads as it can hold, 2,048 for each
# multiprocessor of a GPU, and its host needs about as long to start a step as that many lanes take.
_LANES_FOR_EACH_CORE, _FEWEST_LANES, _MOST_LANES = 4096, 2**15, 2**20
# Rays in a chunk, for each lane: the last rays of a chunk leave lanes idle.
_CHUNK = 32


class JaxRayScene:
    """Casts rays by JAX, on any device that it has: `EmbreeRayScene` without Embree.

    Takes one `Mesh` or a sequence of them, relative to the `origin` of the first; a later change
    of a mesh is not seen. Faces stop rays from both sides. Watertight at edges and vertices.
    Positions, directions and distances are float32 within, in a frame of the meshes' own as
    `EmbreeRayScene` has it, and agree with Embree's to rounding; a ray through an edge may name
    either of its faces, and one that passes an edge within rounding (4e-7 of the distance) may hit
    it.

    On a CPU slower than Embree, which is made for it. The first query compiles, once for each
    power of two of the number of faces; no number of rays compiles anew on a CPU, and five sizes of
    chunks do on an accelerator. Memory is bounded, for rays pass in chunks. `tree` is what `trace`
    takes, for rays cast inside `jit`, and `lanes` how many suit the `device` that it is on:
    the default one when the scene was made, where the methods cast too. These run outside `jit` and
    give NumPy arrays. Not differentiable.

    Raises `ValueError` for no mesh, and for meshes without a face of finite corners.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import geometry
    >>> scene = geometry.JaxRayScene(geometry.knot(300))
    >>> up = np.array([0.0, 0.0, 1.0])
    >>> scene.occluded(np.array([[0.0, 0.0, -2.0], [2.0, 0.0, 0.0]]), up).shape
    (2,)
    """

    tree: RayTree
    frame: Frame

    def __init__(self, meshes: Mesh | Sequence[Mesh]):
        meshes = [meshes] if isinstance(meshes, Mesh) else meshes
        check_all("meshes", meshes, Mesh, least=0)
        if not meshes:
            raise ValueError("JaxRayScene needs at least one mesh, got an empty sequence")
        points, faces, self.frame = framed(meshes)
        corners = np.concatenate([p[f] for p, f in zip(points, faces, strict=True)])
        self.tree = ray_tree(corners, self.frame)
        self._starts = np.cumsum([0] + [len(mesh.faces) for mesh in meshes])

    @property
    def lanes(self) -> int:
        """Tell how many rays are best under way at once on `device`, for `trace`."""
        device = self.device
        if device.platform in _LANES:
            return _LANES[device.platform]
        cores = getattr(device, "core_count", None) or 1
        wanted = 1 << (cores * _LANES_FOR_EACH_CORE).bit_length() - 1
        return min(max(wanted, _FEWEST_LANES), _MOST_LANES)

    @property
    def device(self) -> jax.Device:  # pyright: ignore[reportInvalidTypeForm]
        """Tell where `tree` is and rays are cast."""
        return next(iter(self.tree.boxes.devices()))

    def occluded(
        self,
        origins: Vectors,
        directions: Vectors,
        max_distance: float | Float[Array | np.ndarray, " n"] = math.inf,
    ) -> Bool[np.ndarray, " n"]:
        """Tell whether anything lies on the ray within `max_distance` of its origin.

        Arguments and errors as for `RayScene.occluded`.
        """
        origins, directions = paired(origins, directions)
        limits = limits_of(max_distance, len(origins))
        result = np.empty(len(origins), bool)
        for part, found, _ in self._each_chunk(origins, directions, limits, first=False):
            result[part] = np.asarray(found.triangle)[: part.stop - part.start] >= 0
        return result

    def closest_hit(self, origins: Vectors, directions: Vectors) -> Hit:
        """Find the first surface that each ray meets. Arguments and errors as for `occluded`."""
        origins, directions = paired(origins, directions)
        count = len(origins)
        limits = np.broadcast_to(np.float32(np.inf), count)
        triangle = np.empty(count, np.int32)
        distance, weights = np.empty(count, np.float32), np.empty((count, 3), np.float32)
        for part, found, ahead in self._each_chunk(origins, directions, limits, first=True):
            far, *rest = (np.asarray(array)[: part.stop - part.start] for array in found)
            distance[part] = self.frame.distances(far, ahead)
            triangle[part], weights[part] = rest
        mesh = np.searchsorted(self._starts, triangle, side="right").astype(np.int32) - 1
        face = np.where(mesh >= 0, triangle - self._starts[mesh], -1).astype(np.int32)
        return Hit(distance, mesh, face, weights)

    def _each_chunk(
        self, origins: np.ndarray, directions: np.ndarray, limits: np.ndarray, *, first: bool
    ) -> Iterator[tuple[slice, Trace, np.ndarray | None]]:
        """Cast rays in chunks of one size; yields which, what they met, and how far ahead they are.

        Few rays get a smaller chunk on an accelerator, so that it is not filled up with many. What
        is yielded is to be waited for before the next, for whose rays its arrays serve again.
        """
        device, lanes = self.device, self.lanes
        size = min(lanes, _LANES["cpu"]) * _CHUNK
        while size < min(len(origins), lanes * _CHUNK):
            size *= 4
        padded = [np.zeros(shape, np.float32) for shape in ((size, 3), (size, 3), size)]
        for start in range(0, len(origins), size):
            part = slice(start, min(start + size, len(origins)))
            count = part.stop - start
            *rays, ahead = prepared(origins, directions, part, self.frame)
            rays.append(self.frame.limits(limits[part], ahead))
            for array, values in zip(padded, rays, strict=True):
                array[:count] = values
            given = (jax.device_put(array, device) for array in padded)
            found = _trace(self.tree, *given, first=first, count=count, lanes=min(lanes, size))
            yield part, found, ahead


_trace: Callable[..., Trace] = jax.jit(cast, static_argnames="lanes")
