"""Connectivity of a mesh: its neighbors, pieces and rims, and where it is no surface."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Int

from .._core.checks import check_faces, check_type
from .._core.host import put
from .._core.ranges import ranges
from ._indices import first_of_equals, groups
from ._mesh import Mesh


class Topology(NamedTuple):
    """Counts the parts of a mesh; `str` says them in one sentence.

    An edge is on the boundary where one face has it, and non-manifold where more than two do. A
    vertex is non-manifold where the faces around it form more than one fan, as at the tip of two
    cones. Winding is inconsistent at an edge that its two faces run along in the same direction.
    Loops of the boundary that meet at a non-manifold edge count as one.

    **Example**

    >>> from jaxsh import geometry
    >>> knot = geometry.topology(geometry.knot(300))
    >>> knot.closed, knot.manifold, knot.genus, knot.euler
    (True, True, 1, 0)
    """

    vertices: int  # those in a face; several at one position are one
    edges: int
    faces: int
    components: int  # pieces that share no vertex
    boundary_edges: int
    boundary_loops: int
    nonmanifold_edges: int
    nonmanifold_vertices: int
    inconsistent_edges: int

    @property
    def euler(self) -> int:
        """Euler characteristic: vertices − edges + faces."""
        return self.vertices - self.edges + self.faces

    @property
    def closed(self) -> bool:
        """True if no edge is on the boundary."""
        return self.boundary_edges == 0

    @property
    def manifold(self) -> bool:
        """True if it is everywhere a surface, with or without boundary."""
        return self.nonmanifold_edges == 0 and self.nonmanifold_vertices == 0

    @property
    def genus(self) -> int | None:
        """Handles of all components; None where it is no consistently wound manifold."""
        if not self.manifold or self.inconsistent_edges:
            return None
        return self.components - (self.euler + self.boundary_loops) // 2

    def __str__(self) -> str:
        faults = [
            (self.nonmanifold_edges, "non-manifold edge"),
            (self.nonmanifold_vertices, "non-manifold vertex"),
            (self.inconsistent_edges, "edge with inconsistent winding"),
        ]
        rim = f"open along {self.boundary_edges:,} edges in {_many(self.boundary_loops, 'loop')}"
        return ", ".join(
            [
                f"{_many(self.vertices, 'vertex')} and {_many(self.faces, 'face')}"
                f" in {_many(self.components, 'piece')}",
                "closed" if self.closed else rim,
                *([f"genus {self.genus}"] if self.genus is not None else []),
                *(_many(count, what) for count, what in faults if count),
            ]
        )


def topology(mesh: Mesh) -> Topology:
    """Count the boundary, the pieces and the faults of a mesh.

    Vertices at exactly the same position, as at hard edges and UV seams, count as one.
    Nothing else in `geometry` looks: an open mesh is as good as a closed one to cast rays at, and
    a non-manifold one has normals and neighbors too. Faces that name a vertex twice are left
    out. Runs on the host, outside `jit`: the answer is Python numbers. Not differentiable.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import geometry
    >>> found = geometry.topology(geometry.make_mesh(np.eye(3), np.array([[0, 1, 2]])))
    >>> found.closed, found.boundary_edges, found.euler
    (False, 3, 1)
    """
    check_type("mesh", mesh, Mesh)
    faces = np.asarray(mesh.faces, np.int64)
    faces = _joined(mesh, faces)[faces]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    corner = np.arange(faces.size)  # which also names the half-edge that leaves it
    ahead = np.roll(corner.reshape(-1, 3), -1, axis=1).ravel()

    # Half-edges of one edge stand together when sorted, and each is paired with the one before.
    size = len(mesh.vertices)
    key = np.minimum(start, end) * size + np.maximum(start, end)
    order = np.argsort(key)
    _, first, sharing = np.unique(key[order], return_index=True, return_counts=True)
    later = np.setdiff1d(corner, first, assume_unique=True)
    one, two = order[later - 1], order[later]
    pairs = order[first[sharing == 2]], order[first[sharing == 2] + 1]

    # Faces that share an edge share a fan around either of its ends.
    same_way = start[one] == start[two]
    beside = np.where(same_way, two, ahead[two]), np.where(same_way, ahead[two], two)
    fans, fan = groups(np.concatenate([one, ahead[one]]), np.concatenate(beside), number=faces.size)
    used, at = np.unique(start, return_inverse=True)
    vertex_of_fan = np.empty(fans, np.int64)
    vertex_of_fan[fan] = at

    # A rim passes from one boundary edge to the next within a fan.
    rim = order[first[sharing == 1]]
    ends = np.unique(np.concatenate([fan[rim], fan[ahead[rim]]]), return_inverse=True)
    loops, _ = groups(*ends[1].reshape(2, -1), number=len(ends[0]))
    return Topology(
        vertices=len(used),
        edges=len(first),
        faces=len(faces),
        components=groups(at, at[ahead], number=len(used))[0],
        boundary_edges=len(rim),
        boundary_loops=loops,
        nonmanifold_edges=int((sharing > 2).sum()),
        nonmanifold_vertices=int((np.bincount(vertex_of_fan) > 1).sum()),
        inconsistent_edges=int((start[pairs[0]] == start[pairs[1]]).sum()),
    )


def neighbors(mesh: Mesh) -> Int[Array, "v n"]:
    """List for each vertex the vertices that an edge joins to it, ascending: (v, n), int32.

    n is the largest valence. A row with fewer than n neighbors is filled up with the vertex itself.
    So a gather needs no mask, and `active | active[neighbors(mesh)].any(axis=1)` is one step of a
    breadth-first search (Lee & Kim 2014). Real neighbors are where the entry differs from its row's
    number. Vertices at exactly the same position, as at hard edges and UV seams, are neighbors of
    each other and have the same neighbors, so that a search crosses the seam.

    Takes any mesh: open, non-manifold, in pieces; `topology` tells which. Runs on the host: the
    faces must be concrete, since n depends on them, so call it outside `jit`. Not differentiable.

    **Example**

    >>> from jaxsh import geometry
    >>> geometry.neighbors(geometry.knot(300)).shape
    (300, 6)
    """
    check_type("mesh", mesh, Mesh)
    faces, count = np.asarray(mesh.faces, np.int64), len(mesh.vertices)
    joined = _joined(mesh, faces)
    faces = joined[faces]
    ahead = faces[:, [1, 2, 0]]
    # Both ways along each edge, as one number that sorts by vertex first.
    keys = np.concatenate([(faces * count + ahead).ravel(), (ahead * count + faces).ravel()])
    keys = np.sort(keys)
    keys = keys[np.diff(keys, prepend=-1) > 0]
    vertex, other = np.divmod(keys, max(count, 1))
    vertex, other = vertex[vertex != other], other[vertex != other]
    if (joined != np.arange(count)).any():
        vertex, other = _to_all_copies(vertex, other, joined)
    valence = np.bincount(vertex, minlength=count)
    first = np.cumsum(valence) - valence
    table = np.repeat(np.arange(count, dtype=np.int32)[:, None], valence.max(initial=0), axis=1)
    table[vertex, np.arange(len(vertex)) - first[vertex]] = other
    return put(table)


def _joined(mesh: Mesh, faces: np.ndarray) -> np.ndarray:
    """Name for each vertex in a face the first such at its position; the others name themselves."""
    vertices = np.asarray(mesh.vertices)
    vertices = vertices.astype(np.promote_types(vertices.dtype, np.float32))
    check_faces("the mesh", faces, len(vertices))
    used = np.zeros(len(vertices), bool)
    used[faces] = True
    at = np.flatnonzero(used)
    joined = np.arange(len(vertices))
    # + 0 makes -0 and 0 the same position
    joined[at] = at[first_of_equals(vertices[at] + 0)]
    return joined


def _to_all_copies(
    vertex: np.ndarray, other: np.ndarray, joined: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Spread pairs of joined vertices over all that are joined, sorted; those are pairs too."""
    copies = np.argsort(joined, kind="stable")
    count = np.bincount(joined, minlength=len(joined))
    first = np.cumsum(count) - count
    several = np.flatnonzero(count > 1)
    vertex, other = np.concatenate([vertex, several]), np.concatenate([other, several])
    # Each pair once for every copy of its second, then of its first vertex.
    vertex, other = np.repeat(vertex, count[other]), copies[ranges(first[other], count[other])]
    vertex, other = copies[ranges(first[vertex], count[vertex])], np.repeat(other, count[vertex])
    order = np.lexsort((other, vertex))
    vertex, other = vertex[order], other[order]
    return vertex[vertex != other], other[vertex != other]


def _many(count: int, what: str) -> str:
    """Say the count with its noun, in the plural where it wants one."""
    if count != 1:
        noun, *rest = what.split(" with ")
        noun = noun[:-2] + "ices" if noun.endswith("vertex") else noun + "s"
        what = " with ".join([noun, *rest])
    return f"{count:,} {what}"
