"""Origins of rays: a little off the surface, by as little as its coordinates allow."""

import warnings
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ...geometry import Mesh, Points, RayScene, Surface, Texels
from ._facets import raised

# In half-extents of the mesh. Against `ray_bias=3e-7` the coefficients at degree 10 and 2,048
# directions change by 0.02 to 0.15 % (RMS, seven scanned meshes); `ray_bias=1e-4` by 0.05 to 1.5 %.
_SHARE = 1e-5
# What a vertex's shortest edge allows, so that small parts of a large mesh keep their shadows.
_OF_EDGE = 1e-3
# In units of what coordinates are rounded to: a surface is uneven by about one.
_ULPS = 4
_LOUD = 0.1  # of a vertex's shortest edge; warned of where half of the vertices have more
_BESIDE = 1e-3  # a texel with less of a corner's weight lies on the edge across from it
_SINGLE = float(np.finfo(np.float32).eps)
# Faces or vertices in a block: what is made on the way is as large as a block, not as the mesh.
_BLOCK = 2**18


class Origins(NamedTuple):
    """Holds where the rays of V points start."""

    positions: Float[np.ndarray, "v 3"]
    distance: Float[np.ndarray, " v"]  # off the surface
    least: Float[np.ndarray, " v"]  # that coordinates allow
    chosen: bool  # by the user, so that it may pass the next surface


def origins(
    surface: Surface,
    normals: Float[np.ndarray, "v 3"],
    scene: RayScene,
    ray_bias: float | None,
    offset: float | None,
    *,
    mesh: Mesh | None = None,
) -> Origins:
    """Take each point a little off the surface; those of a volume stay where they are.

    Vertices at a rim, also one where only the normals break, start as far inwards too, or they
    would start within the plane of a surface that meets theirs there; and so do texels on it.
    Texels start off the curved surface that normals tell of, rather than off their flat faces. A
    bias of points and texels is a share of the `mesh` in their way.
    """
    points, rim, size, inwards = _measured(surface, normals, mesh)
    single = np.promote_types(points.dtype, np.float32)
    if not isinstance(surface, Mesh) and surface.normals is None:
        none = np.zeros(len(points))
        return Origins(points.astype(single, copy=False), none, none, chosen=False)
    half, shortest, longest = size
    least = _ULPS * _rounding(points, np.where(longest > 0, longest, 2 * half), scene)
    automatic = offset is None and ray_bias is None
    if automatic:
        distance = np.maximum(np.minimum(_SHARE * half, _OF_EDGE * shortest), least)
    else:
        wanted = offset if offset is not None else (ray_bias or 0) * half
        distance = np.maximum(wanted, least)
    _warn_of_large(distance, shortest, least, points)
    if isinstance(surface, Texels):
        points = raised(surface, normals, least, scene)
    every = np.arange(len(points))

    def lifted(by: Float[np.ndarray, " n"], at: slice | Int[np.ndarray, " n"]) -> np.ndarray:
        start = points[at].astype(np.float64)
        start += by[:, None] * normals[at]
        edge = rim[at]
        if edge.any():
            aside = np.minimum(by, shortest[at] / 10)[edge, None]
            start[edge] += aside * inwards(every[at][edge])
        return start.astype(single)

    positions = np.empty(points.shape, single)
    for part in _blocks(len(points)):
        if automatic:
            distance[part] = _within_gaps(scene, normals, distance, least, lifted, part)
        positions[part] = lifted(distance[part], part)
    return Origins(positions, distance, least, not automatic)


class _Size(NamedTuple):
    """Holds how large a surface is, as a whole and around each of V points."""

    half: float  # of its longest extent
    shortest: Float[np.ndarray, " v"]  # edge; infinite where there is none
    longest: Float[np.ndarray, " v"]


class _Measured(NamedTuple):
    points: Float[np.ndarray, "v 3"]
    rim: Bool[np.ndarray, " v"]  # start aside too
    size: _Size
    inwards: Callable[[Int[np.ndarray, " n"]], Float[np.ndarray, "n 3"]]  # unit vectors, or zero


def _measured(surface: Surface, normals: Float[np.ndarray, "v 3"], mesh: Mesh | None) -> _Measured:
    """Measure a surface; of points alone no more is known than the `mesh` in their way."""
    if isinstance(surface, Mesh):
        points, faces = np.asarray(surface.vertices), np.asarray(surface.faces)
        rim = _open(faces, len(points))
        size = _Size(_half(points), *_edges(points, faces))
        return _Measured(points, rim, size, _inwards(points, faces, rim, normals).of)
    points = np.asarray(surface.positions)
    half = _half(points if mesh is None else np.asarray(mesh.vertices))
    if isinstance(surface, Points):
        far, nowhere = np.full(len(points), np.inf), np.zeros(len(points), bool)
        size = _Size(half, shortest=far, longest=np.full(len(points), 2 * half))
        return _Measured(points, nowhere, size, lambda some: np.zeros((len(some), 3)))
    vertices, faces = np.asarray(surface.mesh.vertices), np.asarray(surface.mesh.faces)
    shortest, longest = _edges(vertices, faces)
    corners, weights = faces[np.asarray(surface.face)], np.asarray(surface.barycentric)
    off = weights < _BESIDE  # the corners across from which a texel lies
    on_rim = (off | _open(faces, len(vertices))[corners]).all(axis=1)
    rim = np.logical_and(off.any(axis=1), on_rim)

    def inwards(some: Int[np.ndarray, " n"]) -> Float[np.ndarray, "n 3"]:
        return _unit(vertices[corners[some]].mean(axis=1, dtype=np.float64) - points[some])

    size = _Size(half, shortest[corners].min(axis=1), longest[corners].max(axis=1))
    return _Measured(points, rim, size, inwards)


def _half(points: Float[np.ndarray, "v 3"]) -> float:
    return float(np.ptp(points.astype(np.float64), axis=0).max()) / 2


def _blocks(count: int) -> Iterator[slice]:
    return (slice(start, min(start + _BLOCK, count)) for start in range(0, count, _BLOCK))


def _rounding(
    vertices: Float[np.ndarray, "v 3"], extent: Float[np.ndarray, " v"], scene: RayScene
) -> Float[np.ndarray, " v"]:
    """Give by how much each position is rounded: as the mesh stores it, and as rays are cast.

    Rays are as inexact as float32 makes the faces around, whose `extent` is given.
    """
    largest, single = np.abs(vertices).max(axis=1).astype(np.float64), vertices.dtype == np.float32
    if not single:  # most doubles have been single once
        with np.errstate(over="ignore"):
            single = bool((vertices.astype(np.float32) == vertices).all())
    kind = np.finfo(np.float32 if single else np.float64)
    stored = float(kind.eps) * largest + float(kind.smallest_subnormal)
    frame = getattr(scene, "frame", None)
    if frame is None:
        return np.maximum(stored, _SINGLE * np.maximum(extent, largest))
    alone = frame.radius / frame.scale  # a single point has no extent of its own
    cast = np.maximum(np.where(extent > 0, extent, alone) * _SINGLE, frame.rounding(vertices))
    return np.maximum(stored, cast)


def _within_gaps(scene: RayScene, normals, distance, least, lifted, part: slice) -> np.ndarray:
    """Halve the distance to what lies between a vertex and its origin; the distances of a part."""
    wide = part.start + np.flatnonzero((distance[part] > least[part]) & normals[part].any(axis=1))
    if len(wide):
        start = lifted(least[wide], wide)
        stopped = scene.occluded(start, normals[wide], distance[wide] - least[wide])
        if stopped.any():
            narrow = wide[stopped]
            gap = scene.closest_hit(start[stopped], normals[narrow]).distance.astype(np.float64)
            distance[narrow] = np.minimum(distance[narrow], least[narrow] + gap / 2)
    return distance[part]


def _warn_of_large(distance, shortest, least, vertices) -> None:
    """Warn, on behalf of `bake`, where origins are far off for how fine the mesh is."""
    edged = np.isfinite(shortest) & (shortest > 0)
    if not edged.any():
        return
    share = float(np.median(distance[edged] / shortest[edged]))
    if share <= _LOUD:
        return
    off = float(np.median(distance[edged]))
    if np.median(distance[edged] / least[edged]) < 1.01:
        why = (
            f"coordinates up to {np.abs(vertices).max():.3g} are rounded to {off / _ULPS:.2g}: "
            "take an origin off them, in float64"
        )
    else:
        why = "give a smaller ray_bias or offset"
    message = (
        f"bake: rays start {off:.2g} off the surface, {share:.2g} of a vertex's shortest edge (the "
        f"median), so that finer shadows are lost: {why}"
    )
    warnings.warn(message, UserWarning, stacklevel=4)


def _edges(
    vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]
) -> tuple[Float[np.ndarray, " v"], Float[np.ndarray, " v"]]:
    """Find the shortest edge, but those of no length, and the longest of the faces around a vertex.

    Without any, infinite and zero.
    """
    # By a power of two of moderate size, so that no square leaves the range of numbers.
    exponent = np.frexp(np.abs(vertices).max())[1]
    points = np.ldexp(np.ascontiguousarray(vertices.T, np.float64), -exponent)
    least, most = np.full(len(vertices), np.inf), np.zeros(len(vertices))
    for part in _blocks(len(faces)):
        corners = [np.take(points, faces[part, corner], axis=1) for corner in range(3)]
        shortest, longest = np.full(len(corners[0].T), np.inf), np.zeros(len(corners[0].T))
        for one, two in ((0, 1), (1, 2), (2, 0)):
            x, y, z = corners[two] - corners[one]
            length = np.sqrt(x * x + y * y + z * z)
            longest = np.maximum(longest, length)
            length[length == 0] = np.inf
            shortest = np.minimum(shortest, length)
        for corner in range(3):
            np.minimum.at(least, faces[part, corner], shortest)
            np.maximum.at(most, faces[part, corner], longest)
    return np.ldexp(least, exponent), np.ldexp(most, exponent)


def _open(faces: Int[np.ndarray, "f 3"], count: int) -> Bool[np.ndarray, " v"]:
    """Tell which vertices faces do not surround.

    Around a vertex the numbers of next and previous corners cancel but for the ends of its fan;
    numbers are drawn at random, so that those of several fans do not cancel.
    """
    numbers = np.random.default_rng(0).integers(2**40, size=count)
    ends = np.zeros(count, np.int64)
    for part in _blocks(len(faces)):
        for corner in range(3):
            step = numbers[faces[part, corner - 2]] - numbers[faces[part, corner - 1]]
            np.add.at(ends, faces[part, corner], step)
    return ends != 0


class _Inwards(NamedTuple):
    """Holds for vertices on a rim the directions into their faces: of unit length, or zero."""

    vertices: Int[np.ndarray, " n"]  # ascending
    vectors: Float[np.ndarray, "n 3"]

    def of(self, vertices: Int[np.ndarray, " m"]) -> Float[np.ndarray, "m 3"]:
        return self.vectors[np.searchsorted(self.vertices, vertices)]


def _inwards(
    vertices: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "f 3"],
    rim: Bool[np.ndarray, " v"],
    normals: Float[np.ndarray, "v 3"],
) -> _Inwards:
    """Point from vertices on a rim into their faces, across the normal, at unit length.

    It is the mean over the fan. Where a fan closes only in space, as around a pole that stands
    there once for each UV, its mean is against the normal, and would take back what is moved along.
    """
    parts = [faces[part] for part in _blocks(len(faces))]
    faces = np.concatenate([part[rim[part].any(axis=1)] for part in parts] or [faces])
    used, faces = np.unique(faces, return_inverse=True)
    faces, points, rim = faces.reshape(-1, 3), vertices[used].astype(np.float64), rim[used]
    upwards = normals[used].astype(np.float64)
    total, angle = np.zeros((len(used), 3)), np.zeros(len(used))
    for corner in range(3):
        at = faces[:, corner]
        sides = [points[faces[:, corner - k]] - points[at] for k in (1, 2)]
        one, two = (_unit(side) for side in sides)
        # The mean of directions between two, times the angle, is as long as what joins them.
        width = np.linalg.norm(one - two, axis=1)
        middle = width[:, None] * _unit(one + two)
        for axis in range(3):
            total[:, axis] += np.bincount(at, middle[:, axis], minlength=len(used))
        angle += np.bincount(at, width, minlength=len(used))
    total -= np.sum(total * upwards, axis=1, keepdims=True) * upwards
    # A fan that is nearly whole, as along a slit, has no inside.
    sided = rim & (np.linalg.norm(total, axis=1) > 0.05 * angle)
    return _Inwards(used, np.where(sided[:, None], _unit(total), 0))


def _unit(vectors: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    largest = np.abs(vectors).max(axis=1, keepdims=True, initial=0)
    vectors = np.ldexp(vectors, -np.frexp(largest)[1])  # so that no square is infinite or zero
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0, length, 1)
