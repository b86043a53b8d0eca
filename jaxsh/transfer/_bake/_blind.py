"""Why vertices see nothing, or have no normal: counts for a warning."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int, UInt64

from ...geometry import Mesh, RayScene, Surface
from ._origins import Origins
from ._receivers import areas_of, unit_size

# Rays from each vertex, and vertices that are asked: as many as cost a small part of a bake.
_RAYS, _MOST = 6, 4096
_TWINS = "on faces that are there twice, both ways round"
_ZERO = "whose normal is zero, NaN or infinite"
_MIX = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)


def why_undefined(surface: Surface, undefined: Bool[np.ndarray, " v"]) -> list[str]:
    """Say in a phrase each why these points have no normal, the commonest cause first."""
    given = np.asarray(surface.normals)[undefined]
    none = ~np.isfinite(given).all(axis=1) | ~given.any(axis=1)
    if not isinstance(surface, Mesh):
        return _phrases({_ZERO: none}, 1.0)
    mesh = surface
    return _phrases(
        {
            _ZERO: none,
            _TWINS: _on_twins(mesh, np.flatnonzero(undefined)),
            "on faces that cancel": ~none,
        },
        1.0,
    )


def why_blind(
    surface: Surface,
    mesh: Mesh | None,
    scene: RayScene,
    blind: Int[np.ndarray, " n"],
    normals: Float[np.ndarray, "v 3"],
    start: Origins,
) -> list[str]:
    """Say in a phrase each why these points see nothing, the commonest cause first.

    `mesh` is the one in their way, where that is known.
    """
    whole, blind = len(blind), blind[:: -(-len(blind) // _MOST)]
    normals, origins, distance = normals[blind], start.positions[blind], start.distance[blind]
    # Whether something lies between where the rays start and where they might at the nearest.
    ahead = distance - start.least[blind]
    crossed = np.zeros(len(blind), bool)
    far = (ahead > start.least[blind]) & start.chosen
    if far.any():
        nearest = (origins - ahead[:, None] * normals)[far]
        crossed[far] = scene.occluded(nearest, normals[far], ahead[far])
    beyond = {
        f"with rays that start beyond the next surface, up to {distance.max():.2g} off: give a "
        "smaller ray_bias or offset": crossed
    }
    every = np.ones(len(blind), bool)
    if isinstance(surface, Mesh):
        seen = _seen(surface, scene, blind, normals, origins)
        causes = beyond | {
            _TWINS: _on_twins(surface, blind),
            "with normals that point against their faces": _against(surface, blind, normals),
            "shut in by other meshes of the scene": seen.foreign,
            "on a closed piece whose faces point inwards": seen.inverted & ~seen.behind,
            "behind faces of another piece, as inside it": seen.behind & seen.beyond,
            "behind faces of their own piece, which folds or cuts through itself": seen.behind,
            "shut in by the fronts of faces, as in a cavity": every,
        }
    elif mesh is None:
        causes = beyond | {"shut in by the scene": every}
    else:
        met = _met(mesh, scene, normals, origins)
        back = 2 * _count(met.ray[met.back], every) > _count(met.ray, every)
        causes = beyond | {
            "behind faces, as inside the mesh": back,
            "shut in by the fronts of faces, as in a cavity": every,
        }
    return _phrases(causes, whole / len(blind))


def _phrases(causes: dict[str, Any], times: float) -> list[str]:
    """Count for each cause what no cause before it holds for; the largest count first."""
    counts, left = [], True
    for cause, holds in causes.items():
        counts.append((round((left & holds).sum() * times), cause))
        left &= ~holds
    about = "about " if times > 1 else ""
    return [f"{about}{count} {cause}" for count, cause in sorted(counts, reverse=True) if count]


class _Seen(NamedTuple):
    """Holds what most rays of each vertex meet, and what its own piece is."""

    foreign: Bool[np.ndarray, " n"]  # other meshes
    behind: Bool[np.ndarray, " n"]  # the backs of faces
    beyond: Bool[np.ndarray, " n"]  # of another piece
    inverted: Bool[np.ndarray, " n"]  # it is closed and encloses a negative volume


class _Met(NamedTuple):
    """Holds what rays met of a mesh: for each of m of them, `_RAYS` from a point."""

    all: Int[np.ndarray, " n"]  # how many of a point's rays met anything
    ray: Int[np.ndarray, " m"]  # of which point
    face: Int[np.ndarray, " m"]
    back: Bool[np.ndarray, " m"]  # met it from behind


def _met(mesh: Mesh, scene: RayScene, normals, origins) -> _Met:
    """Cast a few rays from each point into its half of space."""
    points, faces, count = np.asarray(mesh.vertices), np.asarray(mesh.faces), len(normals)
    directions = np.random.default_rng(0).normal(size=(count, _RAYS, 3))
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    directions = (directions + 1.01 * normals[:, None]).reshape(-1, 3)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    starts = np.repeat(origins, _RAYS, axis=0).astype(np.float64)
    hit = scene.closest_hit(starts, directions)
    ours = np.flatnonzero((hit.mesh == 0) & (hit.face < len(faces)))
    # The mesh need not be in the scene: its face must lie where the ray has met one.
    place = starts[ours] + hit.distance[ours, None].astype(np.float64) * directions[ours]
    corners = points[faces[hit.face[ours]]].astype(np.float64)
    there = np.einsum("nij,ni->nj", corners, hit.barycentric[ours].astype(np.float64))
    agree = np.linalg.norm(there - place, axis=1) <= 1e-3 * np.ptp(points, axis=0).max()
    ours = ours[agree]
    face = hit.face[ours]
    back = np.einsum("in,ni->n", areas_of(points, faces[face]), directions[ours]) > 0
    met = np.bincount(np.flatnonzero(hit.mesh >= 0) // _RAYS, minlength=count)
    return _Met(met, ours // _RAYS, face, back)


def _count(rays: Int[np.ndarray, " n"], points: np.ndarray) -> Int[np.ndarray, " p"]:
    return np.bincount(rays, minlength=len(points))


def _seen(mesh: Mesh, scene: RayScene, blind, normals, origins) -> _Seen:
    faces, count = np.asarray(mesh.faces), len(blind)
    met = _met(mesh, scene, normals, origins)
    ray, back = met.ray, met.back
    piece = _pieces(mesh)
    other = back & (piece[faces[met.face, 0]] != piece[blind[ray]])
    behind = 2 * _count(ray[back], blind) > _count(ray, blind)
    inverted = np.zeros(count, bool) if behind.all() else _inverted(mesh, piece)[piece[blind]]
    return _Seen(
        2 * _count(ray, blind) < met.all,
        behind,
        2 * _count(ray[other], blind) > _count(ray[back], blind),
        inverted,
    )


def _pieces(mesh: Mesh) -> Int[np.ndarray, " v"]:
    """Number the pieces, corners at one position taken for one, and label each vertex."""
    from scipy.sparse import coo_array, csgraph  # JAX itself needs SciPy

    faces, size = np.asarray(mesh.faces), len(mesh.vertices)

    def joined(*pairs: tuple[np.ndarray, np.ndarray]) -> tuple[int, np.ndarray]:
        one, two = map(np.concatenate, zip(*pairs, strict=True))
        links = coo_array((np.ones(len(one)), (one, two)), shape=(size, size))
        return csgraph.connected_components(links, directed=False)

    edges = [(faces[:, 0], faces[:, 1]), (faces[:, 1], faces[:, 2])]
    number, label = joined(*edges)
    if number > 1:
        _, first, place = np.unique(_places(mesh), return_index=True, return_inverse=True)
        _, label = joined(*edges, (np.arange(size), first[place]))
    return label


def _inverted(mesh: Mesh, piece: Int[np.ndarray, " v"]) -> Bool[np.ndarray, " p"]:
    """Tell which pieces are closed and enclose a negative volume."""
    faces, pieces = np.asarray(mesh.faces), int(piece.max()) + 1
    of_face = piece[faces[:, 0]]
    points = unit_size(np.asarray(mesh.vertices, np.float64))
    areas = areas_of(points, faces)

    def total(values: np.ndarray) -> np.ndarray:
        return np.bincount(of_face, values, minlength=pieces)

    base = np.zeros((pieces, 3))
    base[of_face] = points[faces[:, 0]]  # any corner of the piece
    volume = total(np.einsum("ni,in->n", points[faces[:, 0]] - base[of_face], areas))
    size = total(np.sqrt((areas**2).sum(axis=0)))
    rest = np.sqrt(sum(total(along) ** 2 for along in areas))
    return (rest < 1e-3 * size) & (volume < 0)


def _against(mesh: Mesh, some: Int[np.ndarray, " n"], normals: np.ndarray) -> np.ndarray:
    """Tell which of some vertices have normals that point against the faces around."""
    faces, count = np.asarray(mesh.faces), len(mesh.vertices)
    faces = faces[_marked(some, count)[faces].any(axis=1)]
    areas = areas_of(unit_size(np.asarray(mesh.vertices, np.float64)), faces)
    facing = [np.bincount(faces.ravel(), np.repeat(a, 3), minlength=count) for a in areas]
    return np.einsum("in,ni->n", np.stack(facing)[:, some], normals) < 0


def _on_twins(mesh: Mesh, some: Int[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Tell which of some vertices are on a face that is there the other way round too."""
    places, faces = _places(mesh), np.asarray(mesh.faces)
    faces = faces[np.isin(places, places[some])[faces].any(axis=1)]
    corners = places[faces]
    ordered = np.sort(corners, axis=1)
    mixed = ordered * _MIX
    _, group = np.unique(mixed[:, 0] ^ mixed[:, 1] ^ mixed[:, 2], return_inverse=True)
    first = corners.argmin(axis=1)[:, None]
    turned = np.take_along_axis(corners, (first + np.arange(1, 3)) % 3, axis=1)
    onwards = turned[:, 0] < turned[:, 1]
    ways = [np.bincount(group[way], minlength=len(faces)) > 0 for way in (onwards, ~onwards)]
    return _marked(faces[(ways[0] & ways[1])[group]].ravel(), len(places))[some]


def _places(mesh: Mesh) -> UInt64[np.ndarray, " v"]:
    """Give equal numbers to equal positions, and others to others."""
    vertices = np.ascontiguousarray(mesh.vertices) + 0  # + 0 makes -0 and 0 the same position
    bits = vertices.view(f"u{vertices.itemsize}").astype(np.uint64)
    mixed = bits * _MIX
    mixed ^= mixed >> np.uint64(29)
    mixed *= _MIX[::-1]
    return mixed[:, 0] ^ (mixed[:, 1] >> np.uint64(7)) ^ (mixed[:, 2] << np.uint64(9))


def _marked(some: Int[np.ndarray, " n"], count: int) -> Bool[np.ndarray, " v"]:
    mark = np.zeros(count, bool)
    mark[some] = True
    return mark
