"""The neighbor table, and what is said of a mesh that is no closed surface."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import shapes

from jaxsh.geometry import Mesh, knot, make_mesh, neighbors, topology


def mesh_of(faces, vertices=None):
    """A mesh by hand: only its faces matter here."""
    faces = np.asarray(faces, np.int32).reshape(-1, 3)
    count = faces.max(initial=-1) + 1 if vertices is None else vertices
    points = jnp.asarray(np.random.default_rng(1).normal(size=(count, 3)), jnp.float32)
    return Mesh(points, jnp.asarray(faces), points)


def plainly(mesh):
    """The table by sets, one vertex at a time."""
    beside = [set() for _ in mesh.vertices]
    for face in np.asarray(mesh.faces).tolist():
        for a in face:
            beside[a] |= set(face) - {a}
    width = max((len(b) for b in beside), default=0)
    rows = [sorted(b) + [v] * (width - len(b)) for v, b in enumerate(beside)]
    return np.array(rows, np.int32).reshape(len(beside), width)


@pytest.mark.parametrize("face", [(0, 1, 3), (-1, 0, 1)])
@pytest.mark.parametrize("function", [neighbors, topology])
def test_faces_that_name_no_vertex_are_refused(function, face):
    with pytest.raises(ValueError, match=r"faces of the mesh name vertices .*, but it has 0 to 2"):
        function(mesh_of([face], 3))


def fan(count, center=0, first=1):
    return [(center, first + i, first + (i + 1) % count) for i in range(count)]


MESHES = {
    "tetrahedron": shapes.TETRAHEDRON[1],
    "square": shapes.QUAD[1],
    "uneven valence": shapes.sphere(4, 9)[1],
    "two pieces": [(0, 1, 2), (3, 4, 5)],
    "three at an edge": [(0, 1, 2), (1, 0, 3), (0, 1, 4)],
    "bow tie": [(0, 1, 2), (0, 3, 4)],
    "both sides": [(0, 1, 2), (2, 1, 0)],
}


@pytest.mark.parametrize("faces", MESHES.values(), ids=MESHES)
def test_table_equals_that_of_the_slow_twin(faces):
    table = neighbors(mesh_of(faces))
    assert table.dtype == jnp.int32
    np.testing.assert_array_equal(table, plainly(mesh_of(faces)))


def test_table_of_any_faces_equals_that_of_the_slow_twin(rng):
    for _ in range(30):
        count = int(rng.integers(1, 12))
        faces = rng.integers(count, size=(int(rng.integers(0, 9)), 3))  # also with a vertex twice
        mesh = mesh_of(faces, count)
        np.testing.assert_array_equal(neighbors(mesh), plainly(mesh))


def test_a_vertex_in_no_face_has_only_itself():
    table = neighbors(mesh_of([(0, 1, 2)], vertices=5))
    np.testing.assert_array_equal(table[3:], [[3, 3], [4, 4]])
    assert neighbors(mesh_of([], vertices=4)).shape == (4, 0)
    assert neighbors(mesh_of([], vertices=0)).shape == (0, 0)


def test_the_table_drives_a_breadth_first_search():
    """On a sphere of rows, each step of the search takes one row more."""
    rows, columns = 12, 10
    mesh = make_mesh(*shapes.sphere(rows, columns))
    table = neighbors(mesh)
    step = jax.jit(lambda active: active | active[table].any(axis=1))
    active = jnp.zeros(len(mesh.vertices), bool).at[0].set(True)
    for reached in range(1, rows):
        active = step(active)
        assert int(active.sum()) == min(1 + reached * columns, len(mesh.vertices))
    assert step(active).all()


def test_neighbors_are_mutual():
    table = np.asarray(neighbors(knot(2000)))
    vertex = np.arange(len(table))[:, None]
    real = table != vertex
    pairs = set(zip(*(x[real].tolist() for x in np.broadcast_arrays(vertex, table)), strict=True))
    assert pairs == {(b, a) for a, b in pairs}
    assert real.sum() == 2 * topology(knot(2000)).edges


def test_faces_must_be_concrete():
    mesh = mesh_of([(0, 1, 2)])
    with pytest.raises(jax.errors.TracerArrayConversionError):
        jax.jit(neighbors)(mesh)


@pytest.mark.parametrize(
    ("mesh", "said"),
    [
        (knot(), "20,020 vertices and 40,040 faces in 1 piece, closed, genus 1"),
        (mesh_of(MESHES["tetrahedron"]), "4 vertices and 4 faces in 1 piece, closed, genus 0"),
        (
            mesh_of(MESHES["square"], vertices=9),
            "4 vertices and 2 faces in 1 piece, open along 4 edges in 1 loop, genus 0",
        ),
        (
            mesh_of(MESHES["three at an edge"]),
            "5 vertices and 3 faces in 1 piece, open along 6 edges in 1 loop, 1 non-manifold edge",
        ),
        (
            mesh_of([(0, 1, 2), (0, 1, 3)]),
            "4 vertices and 2 faces in 1 piece, open along 4 edges in 1 loop, 1 edge with "
            "inconsistent winding",
        ),
        (
            mesh_of(MESHES["bow tie"]),
            "5 vertices and 2 faces in 1 piece, open along 6 edges in 2 loops, 1 non-manifold "
            "vertex",
        ),
        (mesh_of([(0, 0, 1)]), "0 vertices and 0 faces in 0 pieces, closed, genus 0"),
    ],
)
def test_what_is_said_of_a_mesh(mesh, said):
    assert str(topology(mesh)) == said


def test_two_cones_tip_to_tip_meet_in_a_nonmanifold_vertex():
    found = topology(mesh_of(fan(5) + fan(5, first=6)))
    assert (found.nonmanifold_vertices, found.nonmanifold_edges) == (1, 0)
    assert (found.components, found.boundary_loops, found.genus) == (1, 2, None)
    assert not found.manifold


def test_a_tube_has_two_rims_and_a_torus_none():
    ring = 7
    i, j = np.meshgrid(np.arange(5), np.arange(ring), indexing="ij")
    for rows, expected in ((6, (0, 2, 14)), (5, (0, 0, 0))):
        a, b = i * ring + j, (i + 1) % rows * ring + j
        c, d = (i + 1) % rows * ring + (j + 1) % ring, i * ring + (j + 1) % ring
        faces = [np.stack(f, axis=-1).reshape(-1, 3) for f in ((a, b, c), (a, c, d))]
        found = topology(mesh_of(np.concatenate(faces)))
        assert (found.euler, found.boundary_loops, found.boundary_edges) == expected
        assert found.genus == (0 if rows == 6 else 1)
        assert found.closed == (rows == 5)


def test_a_moebius_strip_cannot_be_wound():
    strip = [(i, (i + 1) % 7, (i + 2) % 7) for i in range(7)]
    found = topology(mesh_of(strip))
    assert found.manifold
    assert (found.boundary_loops, found.euler) == (1, 0)
    assert found.inconsistent_edges > 0
    assert found.genus is None


def test_pieces_add_up():
    sphere, torus = shapes.sphere(6, 8)[1], np.asarray(knot(300).faces)
    both = topology(mesh_of(np.concatenate([sphere, torus + sphere.max() + 1])))
    assert (both.components, both.genus, both.euler) == (2, 1, 2)
    apart = topology(mesh_of(sphere)), topology(mesh_of(torus))
    assert both.edges == sum(one.edges for one in apart)


def test_topology_does_not_depend_on_order(rng):
    faces = np.asarray(knot(400).faces)[:-37]
    known = topology(mesh_of(faces))
    assert known.boundary_edges > 0
    for _ in range(5):
        shuffled = rng.permutation(faces)[:, np.roll(np.arange(3), rng.integers(3))]
        names = rng.permutation(faces.max() + 1)
        assert topology(mesh_of(names[shuffled])) == known


def split_up(mesh, rng):
    """The same surface with a vertex for every corner of every face, in any order."""
    corners = np.asarray(mesh.faces).ravel()
    order = rng.permutation(len(corners))
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    vertices = np.asarray(mesh.vertices)[corners][order]
    vertices[::2] = np.where(vertices[::2] == 0, -0.0, vertices[::2])
    vertices = jnp.asarray(vertices)
    return Mesh(vertices, jnp.asarray(place.reshape(-1, 3), jnp.int32), vertices), corners[order]


def test_a_mesh_in_separate_faces_has_the_topology_of_the_whole(rng):
    for mesh in (knot(300), make_mesh(*shapes.sphere(6, 8)), make_mesh(*shapes.QUAD)):
        assert topology(split_up(mesh, rng)[0]) == topology(mesh)


def test_neighbors_across_a_seam_are_those_of_the_whole(rng):
    mesh = make_mesh(*shapes.sphere(4, 5))
    apart, whole = split_up(mesh, rng)
    table, known = np.asarray(neighbors(apart)), np.asarray(neighbors(mesh))
    for vertex, row in enumerate(table):
        real = row[row != vertex]
        near = {whole[vertex], *known[whole[vertex]].tolist()}
        assert real.tolist() == [w for w in range(len(whole)) if whole[w] in near and w != vertex]
    # One step of a search on the parts takes what one on the whole does.
    active = rng.random(len(whole)) < 0.1
    at_whole = np.zeros(len(known), bool)
    at_whole[whole[active]] = True
    step = at_whole | at_whole[known].any(axis=1)
    np.testing.assert_array_equal(active | active[table].any(axis=1), step[whole])
