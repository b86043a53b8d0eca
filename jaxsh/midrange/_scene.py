"""Scenes: lights and their blockers, ready to be traced."""

import functools
import math
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_float, check_all
from .._core.known import is_concrete
from ..geometry import Mesh, RayScene, ray_scene
from ..imaging import look_up
from ..sphere import cube_map
from ._emitters import EmissiveMesh, Polygon, Sphere
from ._surfaces import Blocker, Emitter, Spheres, Triangles, spheres, triangles

# Samples of the environment along each side of a texel, at most.
_MOST_SAMPLES = 16


class Scene:
    """Holds emitters, blockers and an environment around them all.

    Blockers are black, whatever radiance they carry. All block each other and the environment,
    from both sides: the back of a one-sided light is black, and so is a sphere from within.
    `environment` is a lat-long picture (H, W, 3) in our orientation (`imaging.read_environment`);
    without one the sky is black.

    What is traced is built at the first capture and kept; the arrays are taken as they are then.
    Surfaces that coincide hide each other by chance: leave a gap.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> corners = jnp.array([[1.0, -1, 2], [-1, -1, 2], [-1, 1, 2], [1, 1, 2]])
    >>> light = midrange.Polygon(corners, jnp.ones(3))
    >>> scene = midrange.Scene([light], [midrange.Polygon(corners / 2, jnp.zeros(3))])
    >>> len(scene.emitters), len(scene.blockers)
    (1, 1)
    """

    def __init__(
        self,
        emitters: Sequence[Emitter],
        blockers: Sequence[Blocker] = (),
        environment: Float[ArrayLike, "h w 3"] | None = None,
    ):
        check_all("emitters", emitters, Polygon, Sphere, EmissiveMesh, least=0)
        check_all("blockers", blockers, Polygon, Sphere, Mesh, least=0)
        if not emitters and environment is None:
            raise ValueError("expected emitters or an environment: a scene without them is black")
        self.emitters, self.blockers = tuple(emitters), tuple(blockers)
        self.environment = None if environment is None else as_float(environment)
        self._skies: dict[int, np.ndarray] = {}
        if self.environment is not None and (
            self.environment.ndim != 3 or self.environment.shape[-1] != 3
        ):
            raise ValueError(
                f"expected an environment (height, width, 3), got shape {self.environment.shape}"
            )

    @functools.cached_property
    def dtype(self) -> np.dtype:
        """float64 where an emitter's array or the environment is, else float32."""
        arrays = [] if self.environment is None else [self.environment]
        for emitter in self.emitters:
            arrays.append(emitter.radiance)
            if isinstance(emitter, Polygon):
                arrays.append(emitter.vertices)
            if isinstance(emitter, Sphere):
                arrays += [emitter.center, emitter.radius]
        return np.result_type(np.float32, *(array.dtype for array in arrays))

    @functools.cached_property
    def triangles(self) -> Triangles:
        return triangles(self.emitters, self.blockers)

    @functools.cached_property
    def spheres(self) -> Spheres:
        return spheres(self.emitters, self.blockers)

    @functools.cached_property
    def rays(self) -> RayScene | None:
        """The triangles for Embree; `None` where there are none."""
        corners = self.triangles.corners
        if not len(corners):
            return None
        vertices = jnp.asarray(corners.reshape(-1, 3), jnp.float32)
        faces = jnp.arange(len(vertices), dtype=jnp.int32).reshape(-1, 3)
        return ray_scene(Mesh(vertices, faces, jnp.zeros_like(vertices)))

    def sky(self, resolution: int) -> Float[np.ndarray, "n 3"]:
        """The environment's mean over each texel of a cube, black without one; kept."""
        if self.environment is None:
            return np.zeros((6 * resolution**2, 3))
        if resolution not in self._skies:
            if not is_concrete(self.environment):
                raise ValueError("a scene's environment must be known, outside of what is traced")
            with jax.ensure_compile_time_eval():
                self._skies[resolution] = _texel_means(self.environment, resolution)
        return self._skies[resolution]


def _texel_means(environment: Float[Array, "h w 3"], resolution: int) -> Float[np.ndarray, "n 3"]:
    """Average n × n bilinear samples in a texel, about two to a pixel where pixels are small."""
    n = min(max(1, math.ceil(environment.shape[0] / resolution)), _MOST_SAMPLES)
    fine, cells = cube_map(resolution * n), (6, resolution, n, resolution, n)
    seen = look_up(environment, fine.directions.astype(environment.dtype))
    weights = np.asarray(fine.weights, np.float64).reshape(cells)
    total = np.einsum(
        "fiajbc,fiajb->fijc", np.asarray(seen, np.float64).reshape(*cells, 3), weights
    )
    return (total / weights.sum(axis=(2, 4))[..., None]).reshape(-1, 3)
