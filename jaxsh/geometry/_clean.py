"""Faults of raw vertices and faces that a mesh may not have."""

from typing import NamedTuple

import numpy as np

from ._indices import first_of_equals, first_of_keys

# Faces whose corners are held in float64 at a time: all at once they take more than the file.
_BLOCK = 1 << 16


class Clean(NamedTuple):
    """Holds what is left of raw vertices and faces, joined where positions are equal."""

    vertices: np.ndarray  # (v, 3) float32
    faces: np.ndarray  # (f, 3) int32
    rows: np.ndarray  # (f,) of the raw faces
    backs: np.ndarray  # (f,) True for a face that is another's back
    found: list[str]  # a phrase for each fault


def clean(
    vertices: np.ndarray, faces: np.ndarray, *, corners: bool, two_sided: bool = False
) -> Clean:
    """Give float32 vertices and int32 faces without faults, and a phrase for each fault found.

    With `corners`, the source stores vertices once per face corner or seam by nature (STL, glTF),
    so that merging equal ones is no finding. With `two_sided`, faces that are each other's back
    both stay.
    """
    with np.errstate(over="ignore"):  # what leaves float32's range is infinite, and dropped as such
        # + 0 makes -0 and 0 the same position
        vertices = vertices.astype(np.float32) + np.float32(0)
    faces = faces.astype(np.int32)
    rows = np.arange(len(faces))
    found = []

    def note(count: int, what: str) -> None:
        if count:
            found.append(f"{count} {what}")

    finite = np.all(np.isfinite(vertices), axis=1)
    keep = finite[faces].all(axis=1)
    note(int((~finite).sum()), "NaN or infinite vertices dropped")
    note(int((~keep).sum()), "faces with NaN or infinite vertices dropped")
    faces, rows = faces[keep], rows[keep]

    referenced = np.zeros(len(vertices), bool)
    referenced[faces] = True
    note(int((finite & ~referenced).sum()), "unreferenced vertices dropped")

    first = first_of_equals(vertices)
    if not corners:
        note(
            int((referenced & (first != np.arange(len(first)))).sum()), "duplicate vertices merged"
        )
    faces = first[faces]

    keep = _has_area(vertices, faces)
    note(int((~keep).sum()), "degenerate faces dropped")
    faces, rows = faces[keep], rows[keep]

    repeated, backs = _repeats(faces)
    note(int(repeated.sum()), "duplicate faces dropped")
    if not two_sided:
        note(int((backs & ~repeated).sum()), "faces that are another's back dropped")
        repeated, backs = repeated | backs, np.zeros_like(backs)
    faces, rows, backs = faces[~repeated], rows[~repeated], backs[~repeated]

    if len(faces) == 0:
        raise ValueError(f"no face is left ({', '.join(found) or 'there were none'})")
    used = np.zeros(len(vertices), bool)
    used[faces] = True
    lost = np.zeros(len(vertices), bool)
    lost[first[referenced]] = True
    note(int((lost & ~used).sum()), "vertices of dropped faces alone dropped")
    renumber = np.cumsum(used, dtype=np.int32) - np.int32(1)
    return Clean(vertices[used], renumber[faces], rows, backs, found)


def _repeats(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tell which faces repeat an earlier one the same way round, and which run the other way."""
    low, middle, high = np.sort(faces, axis=1).astype(np.uint32).T
    count = np.uint64(int(faces.max(initial=0)) + 1)
    # Three indices as one number, or two where three do not fit.
    key = low * count + middle
    if int(count) ** 3 >= 2**64:
        key = first_of_keys(key).astype(np.uint64)
    first = first_of_keys(key * count + high)
    # Even permutations of the sorted corners run one way, odd ones the other.
    a, b, c = faces.T
    odd = (a > b) ^ (b > c) ^ (a > c)
    backs = odd != odd[first]
    repeated = ~backs & (first != np.arange(len(faces)))
    later = np.flatnonzero(backs)
    repeated[later] = first_of_keys(first[later].astype(np.uint64)) != np.arange(len(later))
    return repeated, backs


def _has_area(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Tell whether a face is higher, over its longest edge, than float32 can tell from zero."""
    has = np.empty(len(faces), bool)
    for start in range(0, len(faces), _BLOCK):
        block = slice(start, start + _BLOCK)
        corners = vertices[faces[block]].astype(np.float64)
        edges = np.roll(corners, -1, axis=1) - corners
        longest_squared = (edges**2).sum(axis=2).max(axis=1)
        twice_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
        has[block] = twice_area > np.finfo(np.float32).eps * longest_squared
    return has
