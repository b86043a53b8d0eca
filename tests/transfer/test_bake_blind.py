"""Why vertices see nothing, as the bake's warning counts it, on meshes where it is known."""

import bodies
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh.geometry import Mesh, ray_scene
from jaxsh.transfer import bake

COUNT = 26


@pytest.fixture(scope="module")
def ball() -> Mesh:
    """A closed sphere of 26 vertices, with the sphere's own normals."""
    vertices, faces = bodies.sphere(3, 8, 0.75 * np.pi)
    vertices, ring = np.concatenate([vertices, [[0, 0, -1]]]), 17 + np.arange(8)
    below = np.stack([ring, 0 * ring + 25, np.roll(ring, -1)], axis=1)
    return bodies.by_hand(vertices, np.concatenate([faces, below]), vertices)


def scaled(mesh, by):
    return Mesh(mesh.vertices * np.float32(by), mesh.faces, mesh.normals)


def turned_in(mesh):
    return Mesh(mesh.vertices, mesh.faces[:, ::-1], -mesh.normals)


def check(mesh, blind, reason, **options):
    """Expect these vertices to see nothing, for this reason, and the rest to see something."""
    message = rf"bake: {len(blind)} of {len(mesh.vertices)} vertices see nothing \({reason}\); they"
    with pytest.warns(UserWarning, match=message) as caught:
        got = bake(mesh, 4, directions=256, progress=False, **options).coefficients
    assert len(caught) == 1
    unlit = np.flatnonzero(~np.asarray(got).any(axis=1))
    np.testing.assert_array_equal(unlit, blind)


@pytest.mark.parametrize("scale", [1e-18, 1.0, 1e18])
def test_inside_another_piece(ball, scale):
    mesh = scaled(bodies.joined(ball, scaled(ball, 0.3)), scale)
    check(mesh, COUNT + np.arange(COUNT), f"{COUNT} behind faces of another piece, as inside it")


def test_pieces_that_cut_through_each_other(ball):
    """The caps of two spheres that overlap: those of each that are within the other."""
    mesh = bodies.joined(ball, bodies.moved(ball, [0, 0, 1.6]))
    check(mesh, [0, COUNT + 25], "2 behind faces of another piece, as inside it")


def test_a_piece_that_folds_through_itself():
    """A flap from the corner (1, 1, 1) of a box on, which comes back in through its side."""
    corners = [[2, 0, 0], [0.1, 0.1, 0], [0.1, -0.1, 0], [1, 1, 1], [3, 1, 2]]
    flap = bodies.by_hand(corners, [[0, 1, 2], [0, 3, 4]], [[0, 0, 1]] * 5)
    mesh = bodies.joined(bodies.box([-1] * 3, [1] * 3), flap)
    check(mesh, [25, 26], "2 behind faces of their own piece, which folds or cuts through itself")


def test_faces_both_ways_round(ball):
    """With corners of their own they see in and out; with the same ones their normals cancel."""
    check(
        bodies.joined(ball, turned_in(ball)),
        COUNT + np.arange(COUNT),
        f"{COUNT} on faces that are there twice, both ways round",
    )
    both = jnp.concatenate([ball.faces, ball.faces[:, [2, 1, 0]]])
    message = f"{COUNT} vertices have no normal .{COUNT} on faces that are there twice"
    with pytest.warns(UserWarning, match=message):
        bake(Mesh(ball.vertices, both, ball.normals), 4, shadows=False)
    split = jnp.concatenate([ball.faces, ball.faces[:, ::-1] + COUNT])
    twice = Mesh(jnp.tile(ball.vertices, (2, 1)), split, jnp.tile(0 * ball.normals, (2, 1)))
    with pytest.warns(UserWarning, match=f"{2 * COUNT} whose normal is zero, NaN or infinite"):
        bake(twice, 4, shadows=False)


def test_pieces_inside_out(ball):
    """Wound inwards, or wound outwards with normals that point in."""
    reason = f"{COUNT} on a closed piece whose faces point inwards"
    check(
        bodies.joined(bodies.moved(ball, [9, 0, 0]), turned_in(ball)),
        COUNT + np.arange(COUNT),
        reason,
    )
    flipped = Mesh(ball.vertices, ball.faces, -ball.normals)
    reason = f"{COUNT} with normals that point against their faces"
    check(flipped, np.arange(COUNT), reason)


def test_a_cavity(ball):
    """A small ball in a room: both see each other only."""
    mesh = bodies.joined(scaled(ball, 0.3), turned_in(ball))
    reason = (
        f"{COUNT} shut in by the fronts of faces, as in a cavity, "
        f"{COUNT} on a closed piece whose faces point inwards"
    )
    check(mesh, np.arange(2 * COUNT), reason)


def test_other_meshes_of_the_scene(ball):
    """The mesh need not be in it, nor have faces."""
    reason = f"{COUNT} shut in by other meshes of the scene"
    small = scaled(ball, 0.3)
    check(small, np.arange(COUNT), reason, scene=ray_scene(ball))
    check(small, np.arange(COUNT), reason, scene=ray_scene([small, ball]))
    points = bodies.points(small.vertices, small.normals)
    check(points, np.arange(COUNT), reason, scene=ray_scene(ball))


def test_many_are_estimated(ball, monkeypatch):
    from jaxsh.transfer._bake import _blind

    monkeypatch.setattr(_blind, "_MOST", 13)
    mesh = bodies.joined(ball, scaled(ball, 0.3))
    check(mesh, COUNT + np.arange(COUNT), f"about {COUNT} behind faces of another piece.*")


def test_nothing_is_asked_where_all_see_something(ball, monkeypatch):
    from jaxsh.transfer._bake import _bake

    monkeypatch.setattr(_bake, "why_blind", None)
    got = bake(ball, 4, directions=256, progress=False).coefficients
    np.testing.assert_allclose(got, bodies.unshadowed(ball, 4), rtol=0, atol=3e-7)
