"""Ray casting: Embree where it is installed, in chunks, on every core; JAX elsewhere."""

import functools
import math
import threading
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from jaxtyping import Array, Bool, Float

from .._core.checks import check_all, check_size
from .._core.host import cores
from ._cast import JaxRayScene
from ._frame import Frame, framed
from ._mesh import Mesh
from ._rays import Hit, RayScene, Vectors, limits_of, paired, prepared

# Rays in a chunk: few enough to share a call's rays between the cores, many enough that the cost
# of a chunk is that of its rays.
_CHUNK = (4_096, 65_536)


def ray_scene(meshes: Mesh | Sequence[Mesh], *, threads: int | None = None) -> RayScene:
    """Build a scene of one mesh or several that answers which rays they stop.

    An `EmbreeRayScene` where the package embreex can be imported, and a `JaxRayScene` elsewhere:
    the same questions and answers, slower on a CPU, which one `UserWarning` per process says. A
    later change of a mesh is not seen. `threads` is for Embree alone: by how many a query's rays
    are cast, by default one a core. Raises `ValueError` for an empty sequence and no thread.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import geometry
    >>> scene = geometry.ray_scene(geometry.knot(300))
    >>> hit = scene.closest_hit(np.array([3.0, 0.0, 0.0]), np.array([[-1.0, 0.0, 0.0]]))
    >>> hit.face.shape, hit.barycentric.shape
    ((1,), (1, 3))
    """
    if threads is not None:
        threads = check_size("threads", threads)
    if _embree() is None:
        _warn_once()
        return JaxRayScene(meshes)
    return EmbreeRayScene(meshes, threads=threads)


def _embree() -> Any:
    """Import Embree's classes for a mesh and for a scene; None where they cannot be imported."""
    try:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene
    except ImportError:
        return None
    return TriangleMesh, EmbreeScene


@functools.cache
def _warn_once() -> None:
    message = (
        "embreex cannot be imported here, so rays are cast by JAX, which is slower on a CPU: "
        "`pip install embreex` where it has wheels"
    )
    warnings.warn(message, UserWarning, stacklevel=3)


class EmbreeRayScene:
    """Casts rays by Embree, on all cores or as many threads as told.

    Takes one `Mesh` or a sequence of them, relative to the `origin` of the first; a later change
    of a mesh is not seen. Faces stop rays from both sides. Directions and distances are float32
    within, and so are positions, counted from the middle of meshes that lie far from zero and in
    a unit that suits their size: they may lie anywhere and have any size, and rays at float64
    meshes far away may start at float64 origins.

    In Embree's robust mode. It lets a very few rays slip through exactly at an edge or a vertex
    (`JaxRayScene` lets none), and lets some rays that pass an edge within rounding (4e-7 of the
    distance) hit what they miss: of rays aimed within 3e-6 of the rim of a square it takes 2 %
    for what they are not, `JaxRayScene` 0.5 % (tests/geometry/test_cast.py).

    A ray that starts on a surface may hit it: start it a little off, along the normal.
    Answers do not depend on the number of threads or on how rays are cut into chunks. With
    `threads=1` they are cast on the thread that asks, as suits a program that asks from several.
    The first query builds the tree, on all cores. Runs on the host, outside `jit`, and gives NumPy
    arrays. Not differentiable.

    Raises `ImportError` where embreex cannot be imported, and `ValueError` for no mesh.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import geometry
    >>> scene = geometry.EmbreeRayScene(geometry.knot(300))
    >>> bool(scene.occluded(np.array([0.0, 0.0, 5.0]), np.array([0.0, 0.0, 1.0]))[0])
    False
    """

    frame: Frame

    def __init__(self, meshes: Mesh | Sequence[Mesh], *, threads: int | None = None):
        self._threads = cores() if threads is None else check_size("threads", threads)
        classes = _embree()
        if classes is None:
            raise ImportError(
                "EmbreeRayScene needs embreex, which cannot be imported here: ray_scene gives a "
                "JaxRayScene then, which answers the same questions"
            )
        build_mesh, build_scene = classes
        meshes = [meshes] if isinstance(meshes, Mesh) else meshes
        check_all("meshes", meshes, Mesh, least=0)
        if not meshes:
            raise ValueError("EmbreeRayScene needs at least one mesh, got an empty sequence")
        points, faces, self.frame = framed(meshes)
        self._scene: Any = build_scene(robust=True)
        for part in zip(points, faces, strict=True):
            build_mesh(self._scene, *part)
        self._built, self._building = False, threading.Lock()

    def _build(self) -> None:
        """Have Embree build its tree, which it does at the first query, on one thread.

        Not with the scene: who needs the meshes no more may let go of them before.
        """
        with self._building:
            if not self._built:
                self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
                self._built = True

    @functools.cached_property
    def _pool(self) -> ThreadPoolExecutor:
        """Start threads at the first query of many rays: few need none."""
        return ThreadPoolExecutor(self._threads)

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
        endless = np.ndim(max_distance) == 0 and max_distance == math.inf
        result = np.empty(len(origins), bool)

        def run(part: slice) -> None:
            *rays, ahead = prepared(origins, directions, part, self.frame)
            if endless and ahead is None:
                np.not_equal(self._scene.run(*rays, query="OCCLUDED"), -1, out=result[part])
                return
            limit = self.frame.limits(limits[part], ahead)
            reaches = limit > 0  # Embree takes others for no limit
            found = self._scene.run(*rays, query="OCCLUDED", dists=limit)
            result[part] = (found != -1) & reaches

        self._each_chunk(len(origins), run)
        return result

    def stops(
        self, starts: Float[np.ndarray, "n 3"], towards: Float[np.ndarray, "n 3"]
    ) -> Bool[np.ndarray, " n"]:
        """Tell what `occluded` does of float32 rays that are in the frame, of unit length.

        Not checked, and cast on the calling thread: for programs that ask from several.
        """
        if not self._built:
            self._build()
        return self._scene.run(starts, towards, query="OCCLUDED") != -1

    def closest_hit(self, origins: Vectors, directions: Vectors) -> Hit:
        """Find the first surface that each ray meets. Arguments and errors as for `occluded`."""
        origins, directions = paired(origins, directions)
        count = len(origins)
        hit = Hit(
            distance=np.empty(count, np.float32),
            mesh=np.empty(count, np.int32),
            face=np.empty(count, np.int32),
            barycentric=np.empty((count, 3), np.float32),
        )

        def run(part: slice) -> None:
            *rays, ahead = prepared(origins, directions, part, self.frame)
            found = self._scene.run(*rays, output=True)
            missed = found["geomID"] == -1
            u, v = found["u"], found["v"]  # weights of vertices 1 and 2
            weights = np.stack([np.maximum(1 - u - v, 0), u, v], axis=1)
            distance = self.frame.distances(found["tfar"], ahead)
            hit.distance[part] = np.where(missed, np.inf, distance)
            hit.mesh[part] = found["geomID"]
            hit.face[part] = found["primID"]
            hit.barycentric[part] = np.where(missed[:, None], 0, weights)

        self._each_chunk(count, run)
        return hit

    def _each_chunk(self, count: int, run: Callable[[slice], None]) -> None:
        if not self._built:
            self._build()
        size = min(max(-(-count // self._threads), _CHUNK[0]), _CHUNK[1])
        parts = [slice(start, min(start + size, count)) for start in range(0, count, size)]
        if len(parts) == 1 or self._threads == 1:
            for part in parts:
                run(part)
        else:  # Embree runs without the interpreter's lock, so threads are enough
            list(self._pool.map(run, parts))
