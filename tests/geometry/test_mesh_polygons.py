"""Triangles of polygons: their area and their side, whatever corner they start at."""

import numpy as np
import pytest

from jaxsh.geometry import read_mesh, topology
from jaxsh.geometry._files._triangulate import triangulate

PLUS = [
    (1, 0),
    (2, 0),
    (2, 1),
    (3, 1),
    (3, 2),
    (2, 2),
    (2, 3),
    (1, 3),
    (1, 2),
    (0, 2),
    (0, 1),
    (1, 1),
]
FLAT = {
    "plus": (PLUS, 5),
    "dart": ([(0, 0), (2, -1), (0.5, 0), (2, 1)], 0.5),
    "thin dart": ([(0, 0), (2, -1e-3), (1.9, 0), (2, 1e-3)], 1.9e-3),
    "L": ([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], 3),
    "corners on sides": ([(0, 0), (1, 0), (2, 0), (2, 2), (1, 2), (0, 2), (0, 1)], 4),
    "three corners and one between": ([(0, 0), (1, 0), (2, 0), (0, 2)], 2),
    "repeated corners": ([(0, 0), (0, 0), (2, 0), (2, 1), (2, 1), (0, 1)], 2),
    "bridge to a hole": (
        [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)],
        12,
    ),
    "comb": (
        [
            (0, 0),
            *((i + 1 + dx, y) for i in range(20) for dx, y in ((0, -3), (0.5, 0))),
            (30, 5),
            (0, 5),
        ],
        None,
    ),
    "circle of 40": ([(np.cos(t), np.sin(t)) for t in np.arange(40) / 20 * np.pi], None),
}
# The outline runs out along a line and back: no triangle reaches the end of it.
SPIKES = {
    "spike out": ([(0, 0), (2, 0), (3, 0), (2, 0), (2, 2), (0, 2)], 4),
    "spike in": ([(0, 0), (2, 0), (2, 2), (1, 2), (1, 1), (1, 2), (0, 2)], 4),
    "spike half back": ([(0, 0), (3, 0), (2, 0), (2, 2), (0, 2)], 4),
    "bent spike": ([(0, 0), (2, 0), (3, 0), (3, 1), (3, 0), (2, 0), (2, 2), (0, 2)], 4),
    "four corners with a spike": ([(0, 0), (2, 0), (1, 0), (1, 1)], 0.5),
    "bridge to an island": (
        [(0, 0), (1, 0), (1, 1), (3, 1), (3, 0), (4, 0), (4, 2), (3, 2), (3, 1), (1, 1), (0, 1)],
        3,
    ),
}


def shoelace(corners):
    x, y = np.asarray(corners, float).T
    return (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2


def area_vectors(positions, triangles):
    a, b, c = np.moveaxis(positions[triangles], 1, 0)
    return np.cross(b - a, c - a) / 2


@pytest.mark.parametrize("name", FLAT)
@pytest.mark.parametrize("offset", [0, 1e5])
def test_area_and_side_are_kept_from_any_first_corner(rng, name, offset):
    corners, area = FLAT[name]
    area = shoelace(corners) if area is None else area
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    positions = np.c_[np.array(corners, float), np.zeros(len(corners))] @ turn.T + offset
    cuts = set()
    for first in range(len(corners)):
        ring = np.roll(np.arange(len(corners)), -first)
        slots, owner, crossed = triangulate(positions, ring, np.array([len(ring)]))
        assert not crossed
        assert not owner.any()
        vectors = area_vectors(positions, ring[slots])
        # Nothing faces backwards, and all corners are there, in triangles that have an area.
        along = vectors @ (np.sign(area) * turn[:, 2])
        assert (along > 1e-6 * abs(area) / len(ring)).all()
        # At 1e5 positions are rounded by 7e-12.
        np.testing.assert_allclose(along.sum(), abs(area), rtol=1e-12, atol=1e-15 + 1e-16 * offset)
        assert len({tuple(p) for p in positions[ring[slots]].reshape(-1, 3)}) == len(
            {tuple(p) for p in positions}
        )
        cuts.add(frozenset(frozenset(map(tuple, positions[ring[s]])) for s in slots))
    assert len(cuts) == 1


@pytest.mark.parametrize("name", SPIKES)
@pytest.mark.parametrize("offset", [0, 1e5])
def test_a_spike_has_no_area(rng, name, offset):
    corners, area = SPIKES[name]
    assert shoelace(corners) == area
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    positions = np.c_[np.array(corners, float), np.zeros(len(corners))] @ turn.T + offset
    for first in range(len(corners)):
        ring = np.roll(np.arange(len(corners)), -first)
        slots, _, crossed = triangulate(positions, ring, np.array([len(ring)]))
        along = area_vectors(positions, ring[slots]) @ turn[:, 2]
        assert not crossed
        # At 1e5 the spike is 7e-12 wide.
        np.testing.assert_allclose(along.sum(), area, rtol=2e-11)
        np.testing.assert_allclose(np.abs(along).sum(), area, rtol=2e-11)


def test_random_stars_keep_their_area(rng):
    """Many polygons of all sizes in one call; those of one size are cut together."""
    rings, areas, sizes = [], [], []
    for _ in range(300):
        size = int(rng.integers(3, 40))
        angle = np.sort(rng.uniform(0, 2 * np.pi, size))
        radius = rng.uniform(0.2, 1, size)
        flat = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
        if np.diff(angle, append=angle[0] + 2 * np.pi).max() > np.pi:
            continue  # the middle is outside: it may cross over itself
        rings.append(np.c_[flat, np.zeros(size)])
        areas.append(shoelace(flat))
        sizes.append(size)
    positions = np.concatenate(rings)
    slots, owner, crossed = triangulate(positions, np.arange(len(positions)), np.array(sizes))
    assert crossed == 0
    assert (np.diff(owner) >= 0).all()
    along = area_vectors(positions, slots)[:, 2]
    np.testing.assert_allclose(np.bincount(owner, along), areas, rtol=2e-15)
    np.testing.assert_allclose(np.bincount(owner, np.abs(along)), areas, rtol=2e-15)


def test_quads_that_are_not_flat_are_cut_at_the_shorter_diagonal(rng):
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    quads = np.concatenate([np.broadcast_to(square, (500, 4, 2)), np.zeros((500, 4, 1))], axis=2)
    quads = quads + rng.uniform(-0.2, 0.2, quads.shape)
    positions = quads.reshape(-1, 3)
    shorter = np.linalg.norm(quads[:, 2] - quads[:, 0], axis=1) < np.linalg.norm(
        quads[:, 3] - quads[:, 1], axis=1
    )
    for first in range(4):
        ring = (4 * np.arange(500)[:, None] + (np.arange(4) + first) % 4).ravel()
        slots, owner, _ = triangulate(positions, ring, np.full(500, 4))
        shared = [set(ring[a]) & set(ring[b]) for a, b in slots.reshape(-1, 2, 3)]
        assert owner.tolist() == np.repeat(np.arange(500), 2).tolist()
        expected = [
            {4 * i, 4 * i + 2} if s else {4 * i + 1, 4 * i + 3} for i, s in enumerate(shorter)
        ]
        assert shared == expected


def test_polygons_without_a_right_answer_still_give_triangles():
    nan, inf = np.nan, np.inf
    odd = [
        ([(0, 0), (1, 0), (2, 0), (3, 0)], 0),  # on a line
        ([(0, 0)] * 5, 0),
        ([(0, 0), (1, 1), (1, 0), (0, 1)], 1),  # a bow tie
        ([(nan, 0), (1, 0), (1, 1), (0, 1)], 0),
        ([(inf, 0), (1, 0), (1, 1), (0, 1), (0, 0.5)], 0),
        ([(1e300, 0), (1, 0), (1, 1), (0, 1), (0, 0.5)], 0),
        ([(np.cos(t), np.sin(t)) for t in np.arange(5) * 4 * np.pi / 5], 1),  # a pentagram
    ]
    for corners, crosses in odd:
        positions = np.c_[np.array(corners, float), np.zeros(len(corners))]
        slots, owner, crossed = triangulate(
            positions, np.arange(len(corners)), np.array([len(corners)])
        )
        assert 1 <= len(slots) == len(owner) <= len(corners) - 2
        assert crossed == crosses


def write_plus(path, suffix):
    """A plus sign, pushed up into a closed body of two plus signs and twelve walls."""
    low, high = [(x, y, 0) for x, y in PLUS], [(x, y, 1) for x, y in PLUS]
    walls = [(i, (i + 1) % 12, 12 + (i + 1) % 12, 12 + i) for i in range(12)]
    faces = [tuple(range(11, -1, -1)), tuple(range(12, 24)), *walls]
    points = [" ".join(map(str, p)) for p in low + high]
    counted = [" ".join(map(str, (len(f), *f))) for f in faces]
    lines = {
        ".obj": [f"v {p}" for p in points]
        + ["f " + " ".join(str(i + 1) for i in f) for f in faces],
        ".off": ["OFF", f"24 {len(faces)} 0", *points, *counted],
        ".ply": [
            *["ply", "format ascii 1.0", "element vertex 24", "property float x"],
            *["property float y", "property float z", f"element face {len(faces)}"],
            *["property list uchar int vertex_index", "end_header", *points, *counted],
        ],
    }[suffix]
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply"])
def test_concave_polygons_of_a_file_keep_area_and_volume(tmp_path, suffix):
    path = tmp_path / f"plus{suffix}"
    write_plus(path, suffix)
    mesh = read_mesh(path)
    corners = np.asarray(mesh.vertices, np.float64)[mesh.faces]
    vectors = area_vectors(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces))
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1).sum(), 2 * 5 + 12, rtol=1e-12)
    np.testing.assert_allclose(np.einsum("fi,fi", corners[:, 0], vectors) / 3, 5, rtol=1e-12)
    found = topology(mesh)
    assert (found.closed, found.genus, found.inconsistent_edges) == (True, 0, 0)
