"""A bake whose rays are cast on JAX's default device, chunk after chunk, without a wait between."""

import contextlib
import threading
from collections.abc import Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..._core.checks import described
from ...geometry import JaxRayScene, Mesh, RayScene, ray_scene
from ._chunk import Reflectors, bounced_rows, lights, reflectors, shadowed_rows
from ._gather import TILE
from ._job import BakeArguments, Job, Prepared, Step

# Rays in a chunk for each lane: many, since the last ones leave lanes idle.
_RAYS = 32
# Chunks that are under way at once, which bounds the memory and keeps the device from waiting.
UNDER_WAY = 2


def takes_device(device: bool | None, scene: RayScene | None) -> bool:
    """Decide whether a bake's rays are cast on the default device; by default on accelerators.

    Raises `ValueError` for a scene that cannot be cast there.
    """
    ours = scene is None or isinstance(scene, JaxRayScene)
    if device is None:
        return ours and _default_platform() != "cpu"
    if not isinstance(device, bool | np.bool_):
        raise ValueError(
            "expected device as True for rays on JAX's default device, False for the host, or None "
            f"for the device where it is a GPU or TPU, got {described(device)}"
        )
    if device and not ours:
        raise ValueError(
            f"device=True needs a scene whose rays JAX casts, a JaxRayScene, got {described(scene)}"
        )
    return bool(device)


def _default_platform() -> str:
    return next(iter(jnp.zeros(()).devices())).platform


def scene_for(mesh: Mesh | None, device: bool, threads: int | None = None) -> RayScene:
    """Build the scene of a mesh alone."""
    assert mesh is not None  # points without a scene are refused
    return JaxRayScene(mesh) if device else ray_scene(mesh, threads=threads)


class Jobs(NamedTuple):
    """Holds who computes the passes of a bake."""

    steps: list[Step]
    points: Job
    reflector: Job | None  # of the vertices that light bounces off, where these are not the points

    def of(self, number: int) -> Job:
        """Give the job of a pass."""
        if self.reflector is not None and self.steps[number].reflector:
            return self.reflector
        return self.points

    def rows(
        self,
        number: int,
        rows: slice,
        before: Float[np.ndarray, "m k"] | None = None,
        direct: Float[np.ndarray, "rows k"] | None = None,
    ) -> Float[np.ndarray, "rows k"]:
        """Compute what `Job.rows` does, of a pass."""
        return self.of(number).rows(self.steps[number].before is not None, rows, before, direct)


def jobs_of(
    mesh: Mesh | None,  # that light bounces off; needed for that alone
    arguments: BakeArguments,
    scene: RayScene | None,
    points: Prepared,
    reflector: Prepared | None,
) -> Jobs:
    """Make the jobs of a bake, whose rays are cast where the arguments say."""

    def job(prepared: Prepared, cosine: bool) -> Job:
        if arguments.device and isinstance(scene, JaxRayScene):
            return DeviceJob(mesh, arguments, scene, prepared, cosine)
        return Job(mesh, arguments, scene, prepared, cosine)

    first = None if reflector is None else job(reflector, cosine=True)
    return Jobs(arguments.steps, job(points, arguments.cosine), first)


class DeviceJob(Job):
    """Computes what a `Job` does with one program for each chunk of points, on a device.

    Chunks lie fixed on the points, and each has its place in one, so that its sums are added in
    one order whatever rows are asked for.
    """

    def __init__(
        self,
        mesh: Mesh | None,
        arguments: BakeArguments,
        scene: JaxRayScene,
        prepared: Prepared,
        cosine: bool,
    ):
        super().__init__(mesh, arguments, scene, prepared, cosine)
        self._scene = scene
        wanted = max(scene.lanes * _RAYS // arguments.directions, 1)
        whole = 1 << (self.num_points - 1).bit_length()
        self.chunk = max(min(1 << wanted.bit_length() - 1, whole), TILE)
        with self._there():
            self._direct = lights(self._directions)
        self._lock = threading.Lock()
        self._reflecting: tuple[Any, Reflectors] | None = None

    def rows(
        self,
        bounce: bool,
        rows: slice,
        before: Float[np.ndarray, "m k"] | None = None,
        direct: Float[np.ndarray, "rows k"] | None = None,
    ) -> Float[np.ndarray, "rows k"]:
        """Compute what `Job.rows` does, and wait for it."""
        with self._there():
            result = np.concatenate(
                [np.asarray(each) for each in self._chunks(bounce, rows, before)]
            )
        if direct is not None:
            result += direct
        return result

    def whole(
        self,
        bar: Any,
        bounce: bool,
        before: Float[Array, "m k"] | None = None,
        direct: Float[Array, "v k"] | None = None,
    ) -> Float[Array, "v k"]:
        """Compute what `Job.rows` does of all points; it stays on the device."""
        blocks = []
        with self._there():
            for values in self._chunks(bounce, slice(0, self.num_points), before):
                blocks.append(values)
                if len(blocks) >= UNDER_WAY:
                    bar.update(len(blocks[-UNDER_WAY].block_until_ready()))
            bar.update(sum(map(len, blocks[-UNDER_WAY + 1 :])))
            result = jnp.concatenate(blocks)
            if direct is not None:
                result += direct
        return result

    @contextlib.contextmanager
    def _there(self) -> Iterator[None]:
        """Compute on the scene's device, without tying the results to it, whatever the session."""
        with jax.enable_x64(True), jax.default_device(self._scene.device):
            yield

    def _chunks(self, bounce: bool, rows: slice, before: Any) -> Iterator[Float[Array, "m k"]]:
        """Start the programs of the chunks that hold some rows, and give the rows of each."""
        scene, size, start = self._scene, self.chunk, self.prepared
        light = self._reflected(before) if bounce else self._direct
        for first in range(rows.start - rows.start % size, rows.stop, size):
            part = slice(max(first, rows.start), min(first + size, rows.stop))
            at, count = part.start - first, part.stop - part.start
            origins, normals = np.zeros((size, 3), np.float32), np.zeros((size, 3), self.dtype)
            # Other rows have no normal: no ray leaves them. Origins so far off that float32 loses
            # them stay as they are, for rays from there hit nothing but by chance.
            origins[at : at + count] = scene.frame.into(start.origins[part])
            normals[at : at + count] = start.normals[part]
            given = scene.tree, jnp.asarray(origins), jnp.asarray(normals), light
            how = {"lanes": scene.lanes, "cosine": self.cosine}
            if bounce:
                values = bounced_rows(*given, **how)
            else:
                values = shadowed_rows(*given, degree=self.arguments.degree, **how)
            whole = count == size
            yield values if whole else lax.dynamic_slice_in_dim(values, at, count)

    def _reflected(self, before: Any) -> Reflectors:
        """Put what leaves the vertices after a pass on the device, once for all its rows."""
        with self._lock:
            if self._reflecting is None or self._reflecting[0] is not before:
                # In the dtype of these rows, whatever that of the vertices is.
                rows = jnp.asarray(before).astype(self.dtype)
                outgoing = jnp.asarray(self._share.reshape(-1, 1)) * rows
                self._reflecting = before, reflectors(self._vectors, self._surface, outgoing)
            return self._reflecting[1]
