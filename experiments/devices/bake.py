"""Bakes on JAX's device beside bakes on the host: how far apart they are, and how fast."""

import dataclasses
import functools
import time
import warnings
from typing import Any, NamedTuple

import jax
import numpy as np

from jaxsh import geometry, transfer

from ..runner import Context, Table, experiment
from ..shared.process import cores
from .workers import Counting


@dataclasses.dataclass(frozen=True)
class Config:
    meshes: tuple[str, ...] = ()
    """meshes by name, "knot" for the one made at run time; none means the first of the data"""
    vertices: int = 20_000
    """vertices of the knot"""
    degree: int = 6
    """degree of the transfer"""
    directions: int = 512
    """directions of the bakes"""
    bounces: tuple[int, ...] = (0, 1)
    """numbers of bounces"""
    reference: int = 8
    """times as many directions are the reference for the error of the directions"""
    rounds: int = 2
    """bakes of each kind, of which the faster counts"""

    def __post_init__(self):
        if (
            min(self.vertices, self.directions, self.reference, self.rounds) < 1
            or min(self.bounces) < 0
        ):
            raise ValueError("expected sizes and rounds of at least 1, and bounces of at least 0")


class _Took(NamedTuple):
    """What a bake took."""

    coefficients: np.ndarray
    wall: float
    cpu: float  # of all threads of this process


@experiment("devices.bake")
def bake(config: Config, context: Context) -> list[Table]:
    names = config.meshes or context.data.meshes()[:1]
    for name in context.progress(names, "meshes"):
        mesh = geometry.knot(config.vertices) if name == "knot" else context.data.mesh(name)
        for bounces in config.bounces:
            context.record({"mesh": name} | _beside(mesh, bounces, config, context.seed))
    device = jax.devices()[0]
    about = {"device": device.device_kind, "cores": cores()}
    return [Table("How far apart they are"), Table("How fast they are", values=about)]


def _beside(mesh: geometry.Mesh, bounces: int, config: Config, seed: int) -> dict[str, Any]:
    ours, embree = geometry.JaxRayScene(mesh), geometry.ray_scene(mesh)
    baked = functools.partial(
        transfer.bake, mesh, config.degree, bounces=bounces, seed=seed, progress=False
    )
    counting = Counting(embree)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # vertices that see nothing
        baked(directions=config.directions, scene=counting, device=False)
        ways = {
            "host": functools.partial(baked, scene=embree, device=False),
            "device": functools.partial(baked, scene=ours, device=True),
        }
        best: dict[str, _Took] = {}
        for _ in range(config.rounds):
            for way, function in ways.items():
                took = _took(functools.partial(function, directions=config.directions))
                if way not in best or took.cpu < best[way].cpu:
                    best[way] = took
        many = config.reference * config.directions
        reference = np.asarray(baked(directions=many, scene=embree, device=False).coefficients)
    rays, host, device = counting.rays, best["host"], best["device"]
    difference = _relative(device.coefficients, host.coefficients)
    sampling = _relative(host.coefficients, reference)
    return {
        "vertices": len(mesh.vertices),
        "bounces": bounces,
        "rays": rays / 1e6,
        "difference": difference,
        "sampling": sampling,
        "difference_to_sampling": difference / sampling,
        "device_rate": rays / device.wall / 1e6,
        "host_rate": rays / host.wall / 1e6,
        "device_cpu": 1e6 * device.cpu / rays,
        "host_cpu": 1e6 * host.cpu / rays,
        "cpu_ratio": device.cpu / host.cpu,
    }


def _took(function) -> _Took:
    wall, cpu = time.perf_counter(), time.process_time()
    coefficients = jax.block_until_ready(function().coefficients)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    return _Took(np.asarray(coefficients), wall, cpu)


def _relative(value: np.ndarray, reference: np.ndarray) -> float:
    """Relative RMS difference, in percent."""
    return 100 * float(np.linalg.norm(value - reference) / np.linalg.norm(reference))
