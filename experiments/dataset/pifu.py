"""PIFu's bake of training data beside ours, in turn: processor time, wall time, error."""

import dataclasses
import functools
import statistics
import time
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from jaxsh import geometry, harmonics, sphere, transfer

from ..runner import Context, Table, experiment
from ..shared.receivers import Receivers, seen_cosines
from . import pifu_bake

# Of the reference's rays, in half-extents of the mesh: where ours start by default.
_NEAR = 1e-5


@dataclasses.dataclass(frozen=True)
class Config:
    meshes: tuple[str, ...] = ("knot",)
    """meshes by name, "knot" for the one made at run time"""
    vertices: int = 25_000
    """vertices of the knot"""
    directions: tuple[int, ...] = (16, 64)
    """directions of our bakes"""
    side: int = pifu_bake.SIDE
    """PIFu's bake draws the square of it"""
    chosen: int = 2000
    """vertices at which errors are measured"""
    reference: int = 32_768
    """directions of the reference"""
    draws: int = 3
    """seeds over which errors are averaged"""
    rounds: int = 3
    """bakes of each kind, in turn"""

    def __post_init__(self):
        if min(self.vertices, self.side, self.chosen, self.reference, self.draws, self.rounds) < 1:
            raise ValueError("expected sizes, seeds and rounds of at least 1")


class Took(NamedTuple):
    """Seconds of a bake."""

    wall: float
    cpu: float  # of all threads of this process


@experiment("dataset.pifu")
def pifu(config: Config, context: Context) -> list[Table]:
    for name in context.progress(config.meshes, "meshes"):
        mesh = geometry.knot(config.vertices) if name == "knot" else context.data.mesh(name)
        for row in _beside(mesh, config, context):
            context.record({"mesh": name, "vertices": len(mesh.vertices)} | row)
    return [
        Table("How fast", rows=[row for row in context.rows if "cpu" in row]),
        Table("How exact", values={"offset": pifu_bake.OFFSET}),
    ]


def _beside(mesh: geometry.Mesh, config: Config, context: Context) -> list[dict[str, Any]]:
    """A row for PIFu's bake, one for its directions in cells, one for each of ours."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # vertices that see nothing, which the reference has too
        errors = _errors(mesh, config, context)
        ours = {number: functools.partial(_ours, mesh, number, 0) for number in config.directions}
        theirs = functools.partial(_theirs, mesh, config.side, 0)
        first = {number: _took(bake) for number, bake in ours.items()}
        rounds = [
            {"PIFu": _took(theirs)} | {str(number): _took(bake) for number, bake in ours.items()}
            for _ in context.progress(range(config.rounds), "rounds")
        ]

    def times(way: str) -> dict[str, float]:
        ratio = {
            f"{kind}_ratio": statistics.median(
                getattr(each["PIFu"], kind) / getattr(each[way], kind) for each in rounds
            )
            for kind in Took._fields
        }
        best = {kind: min(getattr(each[way], kind) for each in rounds) for kind in Took._fields}
        return best | ratio

    rows: list[dict[str, Any]] = [
        {"way": "PIFu", "directions": config.side**2} | errors["PIFu"] | times("PIFu"),
        {"way": "PIFu, in cells", "directions": config.side**2} | errors["PIFu, in cells"],
    ]
    for number in config.directions:
        row: dict[str, Any] = {"way": "ours", "directions": number} | errors[str(number)]
        row |= times(str(number)) | {"first": first[number].wall}
        rows.append(row | {"error_ratio": errors["PIFu"]["error"] / row["error"]})
    return rows


def _errors(mesh: geometry.Mesh, config: Config, context: Context) -> dict[str, dict[str, float]]:
    """Relative RMS errors in percent, by way: against what is seen from near, and from far off.

    The second reference starts its rays where PIFu's bake does, so that there it errs by its
    directions alone.
    """
    rng = np.random.default_rng(context.seed)
    count = len(mesh.vertices)
    chosen = np.sort(rng.choice(count, min(config.chosen, count), replace=False))
    extents = np.ptp(np.asarray(mesh.vertices), axis=0)
    far = 2 * pifu_bake.OFFSET * extents.min() / extents.max()
    near, off = (_reference(mesh, chosen, bias, config, context) for bias in (_NEAR, far))

    def error(way: Callable[[int], np.ndarray]) -> dict[str, float]:
        values = [way(context.seed + draw) for draw in range(config.draws)]
        return {
            "error": statistics.fmean(_relative(value, near) for value in values),
            "error_off": statistics.fmean(_relative(value, off) for value in values),
        }

    found = {
        "PIFu": error(lambda seed: _theirs(mesh, config.side, seed, chosen)),
        "PIFu, in cells": error(lambda seed: _theirs(mesh, config.side, seed, chosen, cells=True)),
    }
    for number in context.progress(config.directions, "errors"):
        found[str(number)] = error(lambda seed, n=number: _ours(mesh, n, seed)[chosen])
    return found


def _reference(
    mesh: geometry.Mesh, chosen: np.ndarray, bias: float, config: Config, context: Context
) -> np.ndarray:
    """The coefficients at some vertices, by many directions, none of them guessed."""
    directions = np.asarray(sphere.fibonacci(config.reference).directions)
    basis = np.asarray(harmonics.evaluate(jnp.asarray(directions), pifu_bake.DEGREE))
    receivers = Receivers.of(mesh, chosen, bias)
    found = np.empty((len(chosen), basis.shape[1]))
    for part, _, seen in seen_cosines(geometry.ray_scene(mesh), receivers, directions, context):
        found[part] = seen @ basis * (4 * np.pi / len(directions))
    return found


def _theirs(
    mesh: geometry.Mesh,
    side: int,
    seed: int,
    chosen: np.ndarray | slice = slice(None),
    *,
    cells: bool = False,
) -> np.ndarray:
    vectors = pifu_bake.directions(side, seed, stratified=cells)
    return pifu_bake.transfer(mesh, vectors, chosen)


def _ours(mesh: geometry.Mesh, directions: int, seed: int) -> np.ndarray:
    baked = transfer.bake(mesh, pifu_bake.DEGREE, directions=directions, seed=seed, progress=False)
    return np.asarray(baked.coefficients)


def _took(bake: Callable[[], Any]) -> Took:
    wall, cpu = time.perf_counter(), time.process_time()
    bake()
    return Took(time.perf_counter() - wall, time.process_time() - cpu)


def _relative(value: np.ndarray, reference: np.ndarray) -> float:
    return 100 * float(np.linalg.norm(value - reference) / np.linalg.norm(reference))
