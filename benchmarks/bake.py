"""What a bake takes beside its rays, and by parts: of a first call and of later ones."""

import time
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from experiments.runner import Column
from experiments.runner.data import Data
from jaxsh import geometry, harmonics, sphere, transfer

from . import page
from ._sections import Cores, Rows, Section

# Name, degree, directions; meshes that are not there are left out.
BAKES = (("knot", 10, 2048), ("maxplanck_25k", 10, 2048), ("armadillo", 10, 2048))
FEW = ("maxplanck_25k", 2, 16)
_VERTICES = 20_000  # of the knot
# One of so many calls for rays is kept, to be cast again alone; odd, as calls are of two kinds.
_KEPT = 15
# Vertices at which errors are measured, directions of their reference, and where rays start off
# the surface, in half-extents.
_CHOSEN, _REFERENCE, _LIFT = 400, 32_768, 1e-4
RAYS, EXACT = "its rays alone", "normals, what is exact"
REST, WHOLE = "origins, choosing rays, sums", "the bake"


class _Took(NamedTuple):
    wall: float
    cpu: float  # of all threads of this process

    def less(self, other: "_Took") -> "_Took":
        return _Took(self.wall - other.wall, self.cpu - other.cpu)


def timings(cores: Cores, rounds: int, dtype: str) -> Iterator[dict[str, Any]]:
    """Rows of the fixed costs, on one core, and of large bakes beside their rays."""
    jax.config.update("jax_enable_compilation_cache", False)
    there = Data.find(None).meshes()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of vertices that see nothing
        if cores == "one":
            name, degree, directions = FEW if FEW[0] in there else ("knot", *FEW[1:])
            yield from _fixed(name, degree, directions, min(rounds, 5))
            yield from _sets("armadillo" if "armadillo" in there else "knot", 10, 1024)
        for name, degree, directions in BAKES:
            if name == "knot" or name in there:
                yield from _large(name, degree, directions)


def _sets(name: str, degree: int, rays: int) -> Iterator[dict[str, Any]]:
    """Errors of our bake, and of sets of directions that are all cast, for about as many rays.

    Relative RMS at some vertices, against a set of many directions, all of them cast.
    """
    mesh = _mesh(name)
    rng = np.random.default_rng(0)
    chosen = np.sort(rng.choice(len(mesh.vertices), _CHOSEN, replace=False))
    points, normals = np.asarray(mesh.vertices)[chosen], np.asarray(mesh.normals)[chosen]
    offset = _LIFT * float(np.ptp(np.asarray(mesh.vertices), axis=0).max()) / 2
    starts = points + offset * normals
    scene = _Recorder(mesh)

    def all_cast(directions: np.ndarray) -> np.ndarray:
        directions = np.asarray(directions, np.float32)
        cosines = np.maximum(normals @ directions.T, 0)
        vertex, direction = np.nonzero(cosines)
        hit = scene.occluded(starts[vertex], directions[direction])
        cosines[vertex[~hit], direction[~hit]] = 0
        basis = np.asarray(harmonics.evaluate(jnp.asarray(directions), degree))
        return exact - cosines @ basis * np.float32(4 * np.pi / len(directions))

    def ours(**options) -> np.ndarray:
        surface = geometry.Points(jnp.asarray(points), jnp.asarray(normals))
        baked = transfer.bake(surface, degree, directions=rays, progress=False, **options)
        return np.asarray(baked.coefficients)

    exact = ours(shadows=False)
    reference = all_cast(np.asarray(sphere.fibonacci(_REFERENCE).directions))
    even = np.asarray(sphere.fibonacci(rays).directions)
    found = {
        "independent directions": all_cast(_unit(rng.normal(size=(rays, 3)))),
        "blue noise": all_cast(_blue_noise(rays, rng)),
        "Fibonacci, all cast": all_cast(even @ np.linalg.qr(rng.normal(size=(3, 3)))[0]),
        "guides and borders: the bake": ours(scene=scene, offset=offset),
    }
    common = {"mesh": name, "degree": degree, "directions": rays}
    for way, value in found.items():
        cast = scene.rays if value is found["guides and borders: the bake"] else _CHOSEN * rays / 2
        error = 100 * np.linalg.norm(value - reference) / np.linalg.norm(reference)
        yield common | {"part": way, "each": round(cast / _CHOSEN), "error": float(error)}


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _blue_noise(count: int, rng: np.random.Generator) -> np.ndarray:
    """Directions drawn at random that have repelled their neighbors for a while."""
    vectors, width = _unit(rng.normal(size=(count, 3))), np.sqrt(4 * np.pi / count)
    for turn in range(60):
        apart = vectors[:, None] - vectors
        squared = (apart**2).sum(axis=2) + np.where(np.eye(count), np.inf, 1e-12)
        near = np.where(squared < (4 * width) ** 2, squared**-2.5, 0)
        pushed = np.einsum("ijk,ij->ik", apart, near)
        pushed = np.clip(pushed / np.median(np.linalg.norm(pushed, axis=1)), -3, 3)
        vectors = _unit(vectors + 0.1 * 0.96**turn * width * pushed)
    return vectors


def _mesh(name: str) -> geometry.Mesh:
    return geometry.knot(_VERTICES) if name == "knot" else Data.find(None).mesh(name)


def _fixed(name: str, degree: int, directions: int, rounds: int) -> Iterator[dict[str, Any]]:
    """A bake of few directions by parts: the first in the process, and the least of later ones."""
    mesh = _mesh(name)
    first = _parts(mesh, degree, directions)
    later = [_parts(mesh, degree, directions) for _ in range(rounds)]
    for part, took in first.items():
        best = min(each[part].cpu for each in later)
        row = {"part": part, "first_s": took.cpu, "cpu_s": best}
        yield {"mesh": name, "degree": degree, "directions": directions} | row


def _parts(mesh: geometry.Mesh, degree: int, directions: int) -> dict[str, _Took]:
    """The steps of `transfer.bake` that may be taken by themselves, and what is left of it."""
    one = np.ones((1, 3), np.float32)

    def tree() -> _Recorder:
        scene = _Recorder(mesh)
        scene.occluded(one, one)  # Embree builds its tree then
        return scene

    scene, built = _taken(tree)
    _, neighbors = _taken(lambda: geometry.neighbors(mesh))
    _, exact = _taken(lambda: transfer.bake(mesh, degree, shadows=False, progress=False))
    options = {"directions": directions, "scene": scene, "progress": False}
    _, rest = _taken(lambda: transfer.bake(mesh, degree, **options))
    parts = {"Embree's tree": built, "neighbors": neighbors, EXACT: exact.less(neighbors)}
    parts[RAYS] = scene.alone()
    parts[REST] = rest.less(neighbors).less(parts[EXACT]).less(parts[RAYS])
    return parts | {WHOLE: _Took(built.wall + rest.wall, built.cpu + rest.cpu)}


def _large(name: str, degree: int, directions: int) -> Iterator[dict[str, Any]]:
    """A bake, after a small one that compiles its programs, and the rays that it casts, alone."""
    mesh = _mesh(name)
    scene = _Recorder(mesh)

    def bake(scene: geometry.RayScene | None) -> transfer.Transfer:
        return transfer.bake(mesh, degree, directions=directions, scene=scene, progress=False)

    some = geometry.Points(mesh.vertices[:256], mesh.normals[:256])
    transfer.bake(some, degree, directions=directions, scene=mesh, progress=False)
    _, took = _taken(lambda: bake(scene))
    alone = scene.alone()
    common = {"mesh": name, "degree": degree, "directions": directions}
    yield common | {
        "part": RAYS,
        "cpu_s": alone.cpu,
        "wall_s": alone.wall,
        "rays": scene.rays / 1e6,
    }
    ratios = {"over_rays": took.cpu / alone.cpu, "wall_over_rays": took.wall / alone.wall}
    yield common | {"part": WHOLE, "cpu_s": took.cpu, "wall_s": took.wall} | ratios


class _Recorder(geometry.EmbreeRayScene):
    """Counts the rays that it is asked for, and keeps a few."""

    def __init__(self, mesh: geometry.Mesh):
        super().__init__(mesh)
        self.kept: list[tuple[np.ndarray, np.ndarray]] = []
        self.cast: list[int] = []

    def stops(self, starts, towards):
        if len(self.cast) % _KEPT == 0:
            self.kept.append((starts, towards))
        self.cast.append(len(starts))  # a list, since calls come from several threads
        return super().stops(starts, towards)

    @property
    def rays(self) -> int:
        return sum(self.cast)

    def alone(self) -> _Took:
        """What `occluded` takes for all rays, told from those that were kept."""
        kept = [tuple(map(np.ascontiguousarray, rays)) for rays in self.kept]
        _, took = _taken(lambda: [self.occluded(*rays) for rays in kept])
        share = sum(len(starts) for starts, _ in kept) / self.rays
        return _Took(took.wall / share, took.cpu / share)


def _taken(call: Callable[[], Any]) -> tuple[Any, _Took]:
    wall, cpu = time.perf_counter(), time.process_time()
    value = jax.block_until_ready(call())
    return value, _Took(time.perf_counter() - wall, time.process_time() - cpu)


def draw(figure: Figure, rows: Rows) -> None:
    """Plot what large bakes take over their rays, and a small one by parts."""
    left, right = figure.subplots(1, 2)
    meshes = list(dict.fromkeys(row["mesh"] for row in rows if row.get("over_rays")))
    for i, (cores, color) in enumerate({"one": "#56B4E9", "all": "#0072B2"}.items()):
        some = [row for row in page.matching(rows, cores=cores) if row.get("over_rays")]
        places = [meshes.index(row["mesh"]) + 0.4 * i - 0.2 for row in some]
        left.bar(places, [row["over_rays"] for row in some], 0.38, color=color, label=f"{cores}")
    left.axhline(1, color="0.4", lw=1)
    left.set_xticks(range(len(meshes)), meshes)
    left.set(ylabel="CPU time over that of its rays alone", title="2,048 directions, degree 10")
    left.set_ylim(0, 1.7)
    left.legend(title="cores", ncols=2, frameon=False, loc="upper center")
    parts = [row for row in rows if row.get("first_s") is not None and row["part"] != WHOLE]
    names = [row["part"] for row in parts]
    right.barh(names, [1e3 * row["first_s"] for row in parts], color="#56B4E9", label="first call")
    right.barh(names, [1e3 * row["cpu_s"] for row in parts], 0.4, color="#003355", label="later")
    right.set(xlabel="CPU, ms", title="16 directions, degree 2, by parts")
    right.invert_yaxis()
    right.legend(frameon=False)


SECTION = Section(
    name="bake",
    title="Bakes",
    intro="A bake beside the rays that it casts, cast again with nothing else to do by `occluded`; "
    "and one of few directions by its parts, of which most are the same for any number.",
    columns=[
        Column("mesh", "mesh"),
        Column("degree", "degree"),
        Column("directions", "directions"),
        Column("part", "part"),
        Column("rays", "rays, millions", digits=1),
        Column("first_s", "first call, CPU, s", digits=3),
        Column("cpu_s", "CPU, s", digits=3),
        Column("wall_s", "wall, s", digits=2),
        Column("over_rays", "CPU / rays alone", digits=2),
        Column("wall_over_rays", "wall / rays alone", digits=2),
        Column("each", "rays of a vertex"),
        Column("error", "error, %", digits=2),
    ],
    timings=timings,
    draw=draw,
    note="Its rays alone: one in fifteen of the bake's calls for rays, scaled to all. A first call "
    "imports Embree and compiles, without JAX's cache on disk. Errors: relative RMS of the "
    f"coefficients at {_CHOSEN} vertices, against {_REFERENCE:,} directions that are all cast, of "
    "sets for about as many rays, all by what they find blocked. PIFu's bake is beside ours in the "
    "experiment `dataset.pifu`.",
    keeps_memory=False,
)
