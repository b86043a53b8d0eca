"""Questions to a scene of meshes, their answers, and the checks of rays."""

import math
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from .._core.checks import as_host_float
from ._frame import Frame

# One vector for each ray, or one for all of them.
Vectors = Float[Array | np.ndarray, "n 3"] | Float[Array | np.ndarray, " 3"]


class Hit(NamedTuple):
    """Holds the first surface along each of n rays (NumPy arrays).

    A miss has an infinite `distance`, `mesh` and `face` -1 and zero `barycentric`.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import geometry
    >>> scene = geometry.ray_scene(geometry.knot(300))
    >>> hit = scene.closest_hit(np.array([0.0, 0.0, 3.0]), np.array([0.0, 0.0, 1.0]))
    >>> hit.mesh.tolist(), hit.face.tolist(), hit.distance.tolist()
    ([-1], [-1], [inf])
    """

    distance: Float[np.ndarray, " n"]  # along the ray, in the unit of the vertices; float32
    mesh: Int[np.ndarray, " n"]  # which of the scene's meshes; int32
    face: Int[np.ndarray, " n"]  # which face of that mesh; int32
    barycentric: Float[np.ndarray, "n 3"]  # weights of the face's vertices 0, 1, 2; float32


@runtime_checkable
class RayScene(Protocol):
    """Answers which rays are stopped: anything with these two methods.

    `ray_scene` makes one. A class of your own may wrap another scene (to count its rays, say) or
    know its surfaces in closed form. `transfer.bake`, `imaging.rasterize` and `midrange.capture`
    take any.

    **Example**

    >>> import math
    >>> from jaxsh import geometry, transfer
    >>> class Counting:
    ...     def __init__(self, scene):
    ...         self.scene, self.rays = scene, 0
    ...     def occluded(self, origins, directions, max_distance=math.inf):
    ...         self.rays += len(origins)
    ...         return self.scene.occluded(origins, directions, max_distance)
    ...     def closest_hit(self, origins, directions):
    ...         return self.scene.closest_hit(origins, directions)
    >>> mesh = geometry.knot(300)
    >>> scene = Counting(geometry.ray_scene(mesh))
    >>> baked = transfer.bake(mesh, 1, directions=64, scene=scene)
    >>> scene.rays > 0
    True
    """

    def occluded(
        self,
        origins: Vectors,
        directions: Vectors,
        max_distance: float | Float[Array | np.ndarray, " n"] = math.inf,
    ) -> Bool[np.ndarray, " n"]:
        """Tell whether anything lies on the ray within `max_distance` of its origin.

        `origins` and `directions` are (n, 3), or (3,) for one that all rays share. Directions
        need no unit length; distances are in the unit of the vertices. Gives n booleans.

        Raises `ValueError` for wrong shapes, NaN or infinite vectors, zero directions.
        """
        ...

    def closest_hit(self, origins: Vectors, directions: Vectors) -> Hit:
        """Find the first surface that each ray meets. Arguments and errors as for `occluded`."""
        ...


def paired(origins: Any, directions: Any) -> tuple[np.ndarray, np.ndarray]:
    """Give both as (n, 3) NumPy arrays; one that all rays share is repeated without a copy."""
    arrays = {
        "origins": as_host_float(origins, "origins"),
        "directions": as_host_float(directions, "directions"),
    }
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


def limits_of(max_distance: Any, count: int) -> np.ndarray:
    """Give one limit for each ray; one that all share is repeated without a copy."""
    max_distance = as_host_float(max_distance, "max_distance")
    if np.ndim(max_distance) not in (0, 1) or np.size(max_distance) not in (1, count):
        raise ValueError(
            f"max_distance must be a number or have shape ({count},), one for each ray, "
            f"got shape {np.shape(max_distance)}"
        )
    if np.isnan(max_distance).any():
        raise ValueError("max_distance holds NaN")
    return np.broadcast_to(max_distance, count)


def prepared(
    origins: np.ndarray, directions: np.ndarray, part: slice, frame: Frame
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Give one chunk as Embree wants it: float32, directions of unit length.

    Origins are in the frame. Those of far away are brought nearer: by how much, in the frame, is
    the third array, None where there are none.
    """
    start = frame.into(origins[part])
    shared = directions.strides[0] == 0  # Embree's binding takes one row for all rays
    towards = directions[:1] if shared else directions[part]
    squared = _squared(towards)
    least, most = squared.min(), squared.max()
    # Nearly always all is well, and extremes show it: the slow path is exact about what is not.
    near = _squared(start).max() <= frame.far**2
    if not (least > 1e-30 and most < 1e30 and near):
        given, towards = origins[part], directions[part].astype(np.float64)
        largest = np.abs(towards).max(axis=1, keepdims=True)
        bad = ~(np.isfinite(given).all(axis=1) & np.isfinite(largest[:, 0]) & (largest[:, 0] > 0))
        if bad.any():
            ray = int(bad.argmax())
            raise ValueError(
                f"rays need finite origins and finite directions other than zero: ray "
                f"{part.start + ray} starts at {given[ray].tolist()} towards "
                f"{towards[ray].tolist()}"
            )
        towards = towards / largest
        squared = _squared(towards)
    if least < 1 - 1e-6 or most > 1 + 1e-6:  # else they are units already
        towards = towards / np.sqrt(squared)[:, None]
    towards = np.asarray(towards, np.float32)
    ahead = None
    if not near:
        start, ahead = frame.nearer(origins[part], np.broadcast_to(towards, start.shape))
    return start, towards, ahead


def _squared(vectors: np.ndarray) -> np.ndarray:
    """Compute squared lengths; several times as fast as `einsum` over three columns."""
    x, y, z = vectors.T
    with np.errstate(over="ignore", invalid="ignore"):  # the caller looks at what comes out
        return x * x + y * y + z * z
