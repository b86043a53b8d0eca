"""A bake as what decides its bits: arguments, surface, origins; it gives the rows of any block."""

import dataclasses
import hashlib
import math
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Array, Float

from ...geometry import Mesh, RayScene
from ...harmonics import num_coefficients
from ._directions import guided, turned_fibonacci
from ._gather import bounced, shadowed
from ._receivers import Receivers, surface, unshadowed


@dataclasses.dataclass(frozen=True, eq=False)
class BakeArguments:
    """Holds all of `bake`'s arguments that decide its bits, checked, but for mesh and scene."""

    degree: int
    directions: int
    shadows: bool = True
    bounces: int = 0
    albedo: np.ndarray = dataclasses.field(default_factory=lambda: np.array(0.5))  # () or (V,)
    ray_bias: float | None = None
    offset: float | None = None
    seed: int = 0
    scene: bool = False  # whether one was given
    device: bool = False  # whether rays are cast on the default device

    @property
    def passes(self) -> int:
        """Count the passes over the vertices: the direct light's, and one a bounce."""
        return 1 + self.bounces

    def identity(self, mesh: Mesh) -> dict[str, Any]:
        """Give what tells this bake from others, for a store's attributes (JSON)."""
        plain = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        share = self.albedo.astype(np.float64)  # of whatever dtype it is given
        return plain | {
            "albedo": fingerprint(share) if share.ndim else float(share),
            "mesh": fingerprint(mesh.vertices, mesh.faces, mesh.normals),
        }

    @staticmethod
    def restored(identity: dict[str, Any], albedo: np.ndarray) -> "BakeArguments":
        """Make the arguments of a store whose attributes hold `identity`."""
        names = {field.name for field in dataclasses.fields(BakeArguments)}
        plain: dict[str, Any] = {name: identity[name] for name in names}
        plain["albedo"] = albedo
        return BakeArguments(**plain)


class Prepared(NamedTuple):
    """Holds what is made once for the whole mesh, before any block."""

    normals: Float[np.ndarray, "v 3"]  # unit, zero where undefined
    origins: Float[np.ndarray, "v 3"]  # of rays, a little off the surface


class Job:
    """Bakes any slice of a mesh's vertices, on its own thread, with memory for that slice alone.

    The rows of a pass do not depend on the slices in which they are asked for, nor on whether the
    session computes in double precision.
    """

    def __init__(
        self,
        mesh: Mesh | None,  # needed for bounces alone
        arguments: BakeArguments,
        scene: RayScene | None,
        prepared: Prepared,
    ):
        self.arguments, self.scene, self.prepared = arguments, scene, prepared
        self.num_points, self.width = len(prepared.normals), num_coefficients(arguments.degree)
        self.dtype = prepared.normals.dtype
        self._receivers = Receivers(prepared.origins, prepared.normals)
        with jax.enable_x64(True):
            if arguments.shadows:
                self._lights = guided(
                    arguments.directions, arguments.degree, arguments.seed, self.dtype
                )
            if arguments.bounces:
                assert mesh is not None
                self._vectors = turned_fibonacci(arguments.directions, arguments.seed, self.dtype)
                self._surface = surface(mesh)
                self._share = np.ravel(self.arguments.albedo).astype(self.dtype) / math.pi

    def rows(
        self,
        number: int,
        rows: slice,
        before: Float[np.ndarray, "v k"] | None = None,
        direct: Float[np.ndarray, "rows k"] | None = None,
    ) -> Float[np.ndarray, "rows k"]:
        """Compute the coefficients after `number` bounces of the vertices in a slice.

        For a bounce `before` are those of all vertices after one bounce less, and `direct` those
        of this slice after none.
        """
        degree = self.arguments.degree
        with jax.enable_x64(True):
            if not self.arguments.shadows:
                return unshadowed(self.prepared.normals[rows], degree)
            assert self.scene is not None
            if number == 0:
                return shadowed(self.scene, self._receivers, self._lights, degree, rows)
            # T_{b+1} = T_0 + ∫ over blocked directions of cosine · albedo/π · T_b at the hit.
            assert before is not None
            assert direct is not None
            return direct + bounced(
                self.scene, self._receivers, self._vectors, self._surface, self._share, before, rows
            )


def fingerprint(*arrays: Array | np.ndarray) -> str:
    """Hash dtypes, shapes and bits of arrays to hexadecimal digits."""
    digest = hashlib.sha256()
    for array in map(np.asarray, arrays):
        digest.update(f"{array.dtype}{array.shape}".encode())
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()[:16]
