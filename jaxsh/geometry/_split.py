"""Corners of a mesh as vertices: split where their attributes differ, joined where not."""

import numpy as np
from jaxtyping import Float, Int

from ._indices import first_of_equals, groups

# Edges with more faces than this are hard: all pairs of faces would be too many.
_SHARING = 8
# In degrees: what float32 positions leave open in an angle.
_SLACK = 1e-3


def split(
    faces: Int[np.ndarray, "f 3"],
    knots: Int[np.ndarray, "f 3"],
    source: Int[np.ndarray, "f 3"],
    attributes: list[Float[np.ndarray, "f 3 _"]],
) -> tuple[Int[np.ndarray, " v"], Int[np.ndarray, "f 3"]]:
    """Give one corner of each vertex, as a row of the flat corners, and the faces of vertices.

    Corners become one vertex where they agree in `faces` (the position), `knots` (the normal) and
    in all `attributes`. Vertices stand in the order of their `source` row, as in the file.
    """
    width = 2 + sum(attribute.shape[2] for attribute in attributes)
    rows = np.empty((*faces.shape, width), np.float32)
    rows[..., :2].view(np.int32)[:] = np.stack([faces, knots], axis=2)
    at = 2
    for attribute in attributes:
        rows[..., at : at + attribute.shape[2]] = attribute
        at += attribute.shape[2]
    first = first_of_equals(rows.reshape(faces.size, width))
    corner = np.flatnonzero(first == np.arange(len(first)))
    earliest = np.full(faces.size, np.iinfo(np.int64).max)
    np.minimum.at(earliest, first, source.ravel())
    order = np.lexsort((corner, earliest[corner]))
    vertex = np.empty(faces.size, np.int32)
    vertex[corner[order]] = np.arange(len(corner), dtype=np.int32)
    return corner[order], vertex[first].reshape(-1, 3)


def smooth_groups(
    vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"], angle: float
) -> Int[np.ndarray, "f 3"]:
    """Name for each corner the corners around its vertex that it shares a normal with.

    Those are reached from face to face over edges where the normals of the faces that meet differ
    by at most `angle` degrees; over an edge of more than eight faces nothing is reached.
    """
    corners = vertices[faces].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    start, end = faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel()
    corner = np.arange(faces.size)  # which also names the edge that leaves it
    ahead = np.roll(corner.reshape(-1, 3), -1, axis=1).ravel()
    key = np.minimum(start, end) * len(vertices) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    begins = np.flatnonzero(np.diff(ordered, prepend=-1) != 0)
    sharing = np.diff(begins, append=len(ordered))
    edge = np.repeat(np.arange(len(begins)), sharing)
    order, edge = order[sharing[edge] <= _SHARING], edge[sharing[edge] <= _SHARING]
    links = [(corner[:0], corner[:0])]
    for apart in range(1, int(min(sharing.max(), _SHARING))):
        same = edge[apart:] == edge[:-apart]
        one, two = order[:-apart][same], order[apart:][same]
        n, m = normal[one // 3], normal[two // 3]
        between = np.arctan2(np.linalg.norm(np.cross(n, m), axis=1), (n * m).sum(axis=1))
        one, two = (x[np.rad2deg(between) <= angle + _SLACK] for x in (one, two))
        same_way = start[one] == start[two]
        links.append((one, np.where(same_way, two, ahead[two])))
        links.append((ahead[one], np.where(same_way, ahead[two], two)))
    one, two = (np.concatenate(ends) for ends in zip(*links, strict=True))
    return groups(one, two, number=faces.size)[1].reshape(-1, 3)
