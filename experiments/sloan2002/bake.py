"""The bakes of `first_light`: what they take beside their rays alone, and how exact they are."""

import dataclasses
import functools
import itertools
import math
import sys
import time
import warnings
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Int

from jaxsh import geometry, harmonics, transfer

from ..runner import Context
from ..shared.receivers import Receivers
from .reference import VARIANTS, Estimate, direct, turned

OFFSET = 1e-4  # of rays, in half-extents


class Subject(NamedTuple):
    """A mesh, its three transfers, and the vertices that have a reference."""

    name: str
    mesh: geometry.Mesh
    transfers: dict[str, transfer.Transfer]
    chosen: Int[np.ndarray, " n"]


def bounces_alone(bounced: transfer.Transfer, direct: transfer.Transfer) -> transfer.Transfer:
    """What of a transfer arrives by way of the surface: exact, for equal rays cancel."""
    indirect = bounced.coefficients - direct.coefficients
    return dataclasses.replace(bounced, coefficients=indirect)


class _Recorder:
    """A scene that counts the rays it is asked for and keeps a few, to be cast again alone."""

    def __init__(self, scene: geometry.RayScene):
        self._scene = scene
        self._calls = itertools.count()
        self._kept: list[tuple[np.ndarray, np.ndarray]] = []
        self._cast: list[int] = []

    def occluded(self, origins, directions, max_distance: Any = math.inf):
        # An odd stride: the bake's calls alternate between two kinds.
        if next(self._calls) % 15 == 0:
            self._kept.append((origins, directions))
        self._cast.append(len(origins))  # a list, since calls come from several threads
        return self._scene.occluded(origins, directions, max_distance)

    def closest_hit(self, origins, directions):
        return self._scene.closest_hit(origins, directions)

    def rays(self) -> int:
        return sum(self._cast)

    def alone(self) -> "_Seconds":
        """What casting all the rays takes, told from those that were kept."""
        start = _Seconds.now()
        for origins, directions in self._kept:
            self._scene.occluded(origins, directions)
        took = _Seconds.now().since(start)
        share = sum(len(origins) for origins, _ in self._kept) / self.rays()
        return _Seconds(took.wall / share, took.cpu / share)


class _Seconds(NamedTuple):
    wall: float
    cpu: float  # of all threads: what other work on the machine disturbs less

    @classmethod
    def now(cls) -> "_Seconds":
        return cls(time.perf_counter(), time.process_time())

    def since(self, start: "_Seconds") -> "_Seconds":
        return _Seconds(self.wall - start.wall, self.cpu - start.cpu)


def bake(
    context: Context,
    name: str,
    degree: int,
    *,
    directions: int,
    albedo: float,
    chosen: int,
    transfer_directions: int,
) -> Subject:
    """Bake the three variants, and record what they took and the error of the transfer itself."""
    mesh = context.data.mesh(name)
    scene = geometry.ray_scene(mesh)
    baked = functools.partial(
        transfer.bake,
        mesh,
        degree,
        directions=directions,
        albedo=albedo,
        ray_bias=OFFSET,
        seed=context.seed,
        progress=False,
    )
    recorder = _Recorder(scene)
    with warnings.catch_warnings(record=True) as reports, context.time(f"{name}: bake"):
        warnings.simplefilter("always")
        start = _Seconds.now()
        shadowed = baked(scene=recorder)
        took = _Seconds.now().since(start)
    memory = _peak_megabytes()
    alone = recorder.alone()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # they have been noted
        unshadowed = baked(shadows=False)
        start = _Seconds.now()
        bounced = baked(bounces=1)
    took_bounced = _Seconds.now().since(start)
    rng = np.random.default_rng(context.seed)
    defined = np.flatnonzero(np.asarray(unshadowed.coefficients).any(axis=1))
    some = np.sort(rng.choice(defined, min(chosen, len(defined)), replace=False))
    transfers = dict(zip(VARIANTS, (unshadowed, shadowed, bounced), strict=True))
    subject = Subject(name, mesh, transfers, some)
    error, own_error = _transfer_error(context, subject, scene, transfer_directions)
    shade, read = _shading_seconds(context, name, shadowed)
    context.record(
        {
            "mesh": name,
            "vertices": len(mesh.vertices),
            "faces": len(mesh.faces),
            "topology": str(geometry.topology(mesh)),
            "reported": "; ".join(str(report.message) for report in reports) or "nothing",
            "rays": recorder.rays(),
            "bake_seconds": took.wall,
            "rays_seconds": alone.wall,
            "bake_to_rays": took.wall / alone.wall,
            "bake_to_rays_cpu": took.cpu / alone.cpu,
            "peak_megabytes": memory,
            "bounced_bake_seconds": took_bounced.wall,
            "chosen": len(some),
            "transfer_error": error,
            "transfer_reference_error": own_error,
            "shade_ms": 1e3 * shade,
            "read_ms": 1e3 * read,
            "shade_to_read": shade / read,
        }
    )
    return subject


def _transfer_error(
    context: Context, subject: Subject, scene: geometry.RayScene, count: int
) -> tuple[float, float]:
    """Relative RMS error of the shadowed coefficients, and of its reference, in percent."""
    baked = subject.transfers["shadowed"]
    receivers = Receivers.of(subject.mesh, subject.chosen, OFFSET)
    rng = np.random.default_rng([context.seed, 1])
    halves = []
    for _ in range(2):
        directions = turned(count // 2, rng)
        basis = np.asarray(harmonics.evaluate(jnp.asarray(directions), baked.degree))
        weighted = basis * np.float32(4 * np.pi / len(directions))
        halves.append(direct(scene, receivers, directions, weighted, context)[1])
    reference = Estimate.of(*halves)
    error = relative_error(np.asarray(baked.coefficients)[subject.chosen], reference.value)
    return error, 100 * reference.error


def _shading_seconds(context: Context, name: str, baked: transfer.Transfer) -> tuple[float, float]:
    """To shade all vertices, and to read the coefficients once and do no more."""

    def shade(light, baked):
        return transfer.shade_diffuse(light, baked, 0.5)

    light = jnp.ones((3, baked.coefficients.shape[1]), baked.coefficients.dtype)
    shaded = context.measure(f"{name}: shade", shade, light, baked, repeats=21)
    read = context.measure(f"{name}: read", jnp.max, baked.coefficients, repeats=21)
    return shaded.run_seconds, read.run_seconds


def relative_error(value: np.ndarray, reference: np.ndarray) -> float:
    return 100 * float(np.linalg.norm(value - reference) / np.linalg.norm(reference))


def _peak_megabytes() -> float | None:
    """The most memory that the process has held so far; None where the system does not say."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6
