"""Faults of raw vertices and faces that a mesh may not have."""

import numpy as np


def clean(
    vertices: np.ndarray, faces: np.ndarray, *, corners: bool
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Give float32 vertices and int32 faces without faults, and a phrase for each fault found.

    With `corners`, the source stores vertices once per face corner or seam by nature (STL, glTF),
    so that merging equal ones is no finding.
    """
    _check(vertices, faces)
    with np.errstate(over="ignore"):  # what leaves float32's range is infinite, and dropped as such
        # + 0 makes -0 and 0 the same position
        vertices = vertices.astype(np.float32) + np.float32(0)
    faces = faces.astype(np.int32)
    found = []

    def note(count: int, what: str) -> None:
        if count:
            found.append(f"{count} {what}")

    finite = np.all(np.isfinite(vertices), axis=1)
    keep = finite[faces].all(axis=1)
    note(int((~finite).sum()), "NaN or infinite vertices dropped")
    note(int((~keep).sum()), "faces with NaN or infinite vertices dropped")
    faces = faces[keep]

    referenced = np.zeros(len(vertices), bool)
    referenced[faces] = True
    note(int((finite & ~referenced).sum()), "unreferenced vertices dropped")

    first = _first_of_equals(vertices)
    if not corners:
        note(
            int((referenced & (first != np.arange(len(first)))).sum()), "duplicate vertices merged"
        )
    faces = first[faces]

    keep = _has_area(vertices, faces)
    note(int((~keep).sum()), "degenerate faces dropped")
    faces = faces[keep]

    # The same three vertices the same way round: turn each face to start at its smallest index.
    start = faces.argmin(axis=1)[:, None]
    turned = np.take_along_axis(faces, (start + np.arange(3)) % 3, axis=1)
    unique = np.sort(np.unique(turned, axis=0, return_index=True)[1])
    note(len(faces) - len(unique), "duplicate faces dropped")
    faces = faces[unique]

    if len(faces) == 0:
        raise ValueError(f"no face is left ({', '.join(found) or 'there were none'})")
    used = np.unique(faces)
    lost = np.setdiff1d(first[referenced], used)
    note(len(lost), "vertices of dropped faces alone dropped")
    renumber = np.zeros(len(vertices), np.int32)
    renumber[used] = np.arange(len(used), dtype=np.int32)
    return vertices[used], renumber[faces], found


def _check(vertices: np.ndarray, faces: np.ndarray) -> None:
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise ValueError(f"vertices must have shape (v, 3), got {vertices.shape}")
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise ValueError(f"faces must have shape (f, 3), got {faces.shape}")
    if len(faces) == 0:
        raise ValueError("it holds no faces")
    if not np.issubdtype(faces.dtype, np.integer):
        raise ValueError(f"faces must be whole numbers, got {faces.dtype}")
    wrong = (faces < 0) | (faces >= len(vertices))
    if wrong.any():
        row = int(wrong.any(axis=1).argmax())
        raise ValueError(
            f"face {row} is {faces[row].tolist()}, but vertices are 0 to {len(vertices) - 1}"
        )


def _first_of_equals(vertices: np.ndarray) -> np.ndarray:
    """Give for each vertex the index of the first one at the same position."""
    _, first, group = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    return first[group.reshape(-1)].astype(np.int32)


def _has_area(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Tell whether a face is higher, over its longest edge, than float32 can tell from zero."""
    corners = vertices[faces].astype(np.float64)
    edges = np.roll(corners, -1, axis=1) - corners
    longest_squared = (edges**2).sum(axis=2).max(axis=1)
    twice_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return twice_area > np.finfo(np.float32).eps * longest_squared
