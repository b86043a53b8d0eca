"""A bake as what decides its bits: arguments, points, origins; it gives the rows of any block."""

import dataclasses
import hashlib
import math
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Array, Float

from ...geometry import Mesh, RayScene, Surface
from ...harmonics import num_coefficients
from .._surfaces import SurfaceKind, kind_of, points_and_normals
from ._directions import guided, turned_fibonacci
from ._gather import bounced, bundle_of, exact_rows, lights_of, shadowed
from ._receivers import Receivers, faces_of

# What the store of a bake that does not say so is of.
USUAL = {"surface": "vertices", "cosine": True, "occluder": None}


class Step(NamedTuple):
    """Says what one pass computes, and from the rows of which passes before it."""

    reflector: bool  # of the vertices that light bounces off, where these are not the points
    before: int | None  # whose rows a bounce gathers; None: direct light
    direct: int | None  # whose rows of the same points it adds


DIRECT = Step(False, None, None)  # light that reaches the points themselves


@dataclasses.dataclass(frozen=True, eq=False)
class BakeArguments:
    """Holds all of `bake`'s arguments that decide its bits, checked, but for surface and scene."""

    degree: int
    directions: int
    shadows: bool = True
    bounces: int = 0
    albedo: np.ndarray = dataclasses.field(default_factory=lambda: np.array(0.5))  # () or (M,)
    ray_bias: float | None = None
    offset: float | None = None
    seed: int = 0
    scene: bool = False  # whether one was given
    device: bool = False  # whether rays are cast on the default device
    surface: SurfaceKind = "vertices"
    cosine: bool = True  # False for points without normals
    occluder: str | None = None  # fingerprint of the mesh in their way, where it is another

    @property
    def apart(self) -> bool:
        """Tell whether the points are others than the vertices that light bounces off."""
        return self.surface != "vertices" or self.occluder is not None

    @property
    def steps(self) -> list[Step]:
        """List the passes: the direct light's, and one a bounce.

        Points apart come last, and gather what the vertices that light bounces off have by then.
        """
        if not (self.apart and self.bounces):
            later = [Step(False, number, 0) for number in range(self.bounces)]
            return [DIRECT, *later]
        last = self.bounces - 1
        first = [Step(True, number, 0) for number in range(last)]
        ours = [DIRECT, Step(False, last, self.bounces)]
        return [Step(True, None, None), *first, *ours]

    def identity(self, surface: Surface) -> dict[str, Any]:
        """Give what tells this bake from others, for a store's attributes (JSON)."""
        plain = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        share = self.albedo.astype(np.float64)  # of whatever dtype it is given
        plain |= {"albedo": fingerprint(share) if share.ndim else float(share)}
        if isinstance(surface, Mesh):
            return plain | {"mesh": fingerprint(surface.vertices, surface.faces, surface.normals)}
        held = (array for array in points_and_normals(surface) if array is not None)
        word = {"points": "point cloud", "texels": "atlas"}[kind_of(surface)]
        return plain | {word: fingerprint(*held)}

    @staticmethod
    def restored(identity: dict[str, Any], albedo: np.ndarray) -> "BakeArguments":
        """Make the arguments of a store whose attributes hold `identity`."""
        names = {field.name for field in dataclasses.fields(BakeArguments)}
        plain: dict[str, Any] = {name: (USUAL | identity)[name] for name in names}
        plain["albedo"] = albedo
        return BakeArguments(**plain)


class Prepared(NamedTuple):
    """Holds what is made once for all points, before any block."""

    # Unit, zero where undefined; any unit vector at points of a volume, which take no cosine.
    normals: Float[np.ndarray, "v 3"]
    origins: Float[np.ndarray, "v 3"]  # of rays, a little off the surface


class Job:
    """Bakes any slice of the points, on its own thread, with memory for that slice alone.

    The rows of a pass do not depend on the slices in which they are asked for, nor on whether the
    session computes in double precision.
    """

    def __init__(
        self,
        mesh: Mesh | None,  # that light bounces off; needed for that alone
        arguments: BakeArguments,
        scene: RayScene | None,
        prepared: Prepared,
        cosine: bool,
    ):
        self.arguments, self.scene, self.prepared = arguments, scene, prepared
        self.num_points, self.width = len(prepared.normals), num_coefficients(arguments.degree)
        self.dtype = prepared.normals.dtype
        self.cosine = cosine
        self._receivers = Receivers(prepared.origins, prepared.normals, self.cosine)
        with jax.enable_x64(True):
            if arguments.shadows:
                self._directions = guided(
                    arguments.directions, arguments.degree, arguments.seed, self.dtype
                )
                self._lights = lights_of(self._directions)
            if arguments.bounces:
                assert mesh is not None
                self._vectors = turned_fibonacci(arguments.directions, arguments.seed, self.dtype)
                self._bundle = bundle_of(self._vectors)
                self._surface = faces_of(mesh)
                self._share = np.ravel(self.arguments.albedo).astype(self.dtype) / math.pi

    def rows(
        self,
        bounce: bool,
        rows: slice,
        before: Float[np.ndarray, "m k"] | None = None,
        direct: Float[np.ndarray, "rows k"] | None = None,
    ) -> Float[np.ndarray, "rows k"]:
        """Compute the coefficients of the points in a slice: of direct light, or after a bounce.

        For a bounce `before` are those of all vertices that light bounces off, after one bounce
        less, and `direct` those of this slice after none.
        """
        degree = self.arguments.degree
        with jax.enable_x64(True):
            if not self.arguments.shadows:
                return exact_rows(self.prepared.normals[rows], degree, self.cosine)
            assert self.scene is not None
            if not bounce:
                return shadowed(self.scene, self._receivers, self._lights, degree, rows)
            # T_{b+1} = T_0 + ∫ over blocked directions of cosine · albedo/π · T_b at the hit.
            assert before is not None
            assert direct is not None
            return direct + bounced(
                self.scene, self._receivers, self._bundle, self._surface, self._share, before, rows
            )


def fingerprint(*arrays: Array | np.ndarray) -> str:
    """Hash dtypes, shapes and bits of arrays to hexadecimal digits."""
    digest = hashlib.sha256()
    for array in map(np.asarray, arrays):
        digest.update(f"{array.dtype}{array.shape}".encode())
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()[:16]
