"""Baked transfer against closed forms, a slow twin, and itself under every change of procedure."""

import io
import sys

import bodies
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from bodies import relative
from jax.sharding import AxisType, NamedSharding, PartitionSpec

from jaxsh.geometry import (
    EmbreeRayScene,
    JaxRayScene,
    Mesh,
    _embree,
    knot,
    make_mesh,
    neighbors,
    ray_scene,
    vertex_normals,
)
from jaxsh.harmonics import clamped_cosine, convolve, evaluate, rotate
from jaxsh.transfer import bake
from jaxsh.transfer._bake import _passes
from jaxsh.transfer._bake._directions import guided


def baked(mesh, degree=4, **options):
    return np.asarray(bake(mesh, degree, progress=False, **options).coefficients)


@pytest.mark.parametrize("body", [bodies.ball, bodies.cube])
def test_a_convex_body_has_no_shadow_and_no_error(body):
    mesh = body()
    got = baked(mesh, 6, directions=256)
    np.testing.assert_array_equal(got, baked(mesh, 6, shadows=False))
    exact = convolve(evaluate(mesh.normals, 6), clamped_cosine(6))
    np.testing.assert_allclose(
        got, exact, rtol=0, atol=2e-7
    )  # 6e-8 measured: normals at unit length


def test_a_transfer_holds_the_mesh():
    mesh = bodies.ball()
    transfer = bake(mesh, 3, shadows=False)
    assert transfer.degree == 3
    assert transfer.coefficients.dtype == mesh.vertices.dtype
    np.testing.assert_array_equal(transfer.positions, mesh.vertices)
    np.testing.assert_array_equal(transfer.normals, mesh.normals)
    np.testing.assert_array_equal(transfer.neighbors, neighbors(mesh))


def test_doubles_stay_doubles():
    mesh = jax.tree.map(lambda x: x.astype(float) if x.dtype == jnp.float32 else x, bodies.ball())
    assert baked(mesh, 2).dtype == np.float64


def slow_twin(mesh, degree, directions, seed, vertices):
    """Every direction of the quadrature cast from every vertex, summed as the definition says."""
    scene, quadrature = ray_scene(mesh), guided(directions, 2, seed, np.dtype(float)).vectors
    half_extent = np.ptp(np.asarray(mesh.vertices), axis=0).max() / 2
    basis = np.asarray(evaluate(quadrature, degree))
    rows = []
    for vertex in vertices:
        normal = np.asarray(mesh.normals)[vertex]
        origin = np.asarray(mesh.vertices)[vertex] + 1e-4 * half_extent * normal
        total = np.asarray(convolve(evaluate(normal, degree), clamped_cosine(degree)), float)
        blocked = scene.occluded(origin, quadrature)
        for direction, y, hit in zip(quadrature, basis, blocked, strict=True):
            cosine = normal @ direction
            if cosine > 0 and hit:
                total -= 4 * np.pi / len(quadrature) * cosine * y
        rows.append(total)
    return np.array(rows)


@pytest.mark.parametrize(
    ("directions", "tolerance"),
    # 100 grant 225 directions, all of them guides: only float32 is left.
    # Of the 576 that 256 grant, guides speak for most: 1.6e-3 measured.
    [(100, 1e-6), (256, 2e-3)],
)
def test_equals_the_slow_twin(directions, tolerance):
    mesh = knot(400)
    vertices = [0, 57, 200, 311]
    twin = slow_twin(mesh, 3, directions, 5, vertices)
    got = baked(mesh, 3, directions=directions, seed=5, ray_bias=1e-4)[vertices]
    assert relative(baked(mesh, 3, shadows=False)[vertices], twin) > 0.1
    assert relative(got, twin) < tolerance


def test_a_scene_that_says_otherwise_is_asked():
    """Of Embree's scene rays are cast without `occluded`, but not where that is another's."""

    class Open(EmbreeRayScene):
        def occluded(self, origins, directions, max_distance=np.inf):
            return np.zeros(len(origins), bool)

    mesh = knot(400)
    lit = baked(mesh, 3, directions=64, scene=Open(mesh))
    np.testing.assert_array_equal(lit, baked(mesh, 3, shadows=False))


@pytest.mark.slow
def test_few_rays_go_far():
    mesh = knot(600)
    reference = baked(mesh, 6, directions=4096, seed=1)
    # 2.1 % measured; 512 directions cast evenly give 3.4 %.
    assert relative(baked(mesh, 6, directions=512), reference) < 0.023


WALL = bodies.rectangle([0, -1e4, -1e4], [0, 2e4, 0], [0, 0, 2e4])


def test_a_vertical_wall_takes_half_of_the_sky():
    """Everything on its side of the horizon is blocked: the directions with x < 0."""
    floor = bodies.points([[1, 0, 0], [0.5, 3, 0]], [[0, 0, 1]] * 2)
    coefficients = baked(floor, 6, scene=ray_scene(WALL))
    exact = bodies.lune(0, np.pi / 2, 6)
    np.testing.assert_allclose(exact[0] * np.sqrt(4 * np.pi), np.pi / 2, rtol=1e-12)
    np.testing.assert_allclose(coefficients, [exact] * 2, rtol=0, atol=4e-3)  # 3.3e-3 measured


@pytest.mark.parametrize("opening", [40, 90, 130])
def test_a_point_in_a_groove(opening):
    """Two half-planes meet at an angle γ. A point on one at a distance s from the bottom sees the
    other, of width w, between the ground and an angle ψ, tan ψ = w sin γ / (s - w cos γ), so that
    its irradiance under a uniform sky is π/2·(1 + cos ψ).
    """
    angle, width, distance = np.radians(opening), 2.0, 1.5
    side = [width * np.cos(angle), 0, width * np.sin(angle)]
    scene = ray_scene(bodies.rectangle([0, -1e4, 0], [0, 2e4, 0], side))
    receiver = bodies.points([[distance, 0, 0], [distance, 1, 0]], [[0, 0, 1]] * 2)
    psi = np.arctan2(side[2], distance - side[0])
    exact = bodies.lune(0, np.pi - psi, 6)
    irradiance = np.pi / 2 * (1 + np.cos(psi))
    np.testing.assert_allclose(exact[0] * np.sqrt(4 * np.pi), irradiance, rtol=1e-12)
    got = baked(receiver, 6, scene=scene)
    np.testing.assert_allclose(got, [exact] * 2, rtol=0, atol=3e-3)  # 2.2e-3 measured


def test_turning_mesh_and_light_together_changes_nothing(rng):
    mesh = knot(700)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    turned = make_mesh(np.asarray(mesh.vertices) @ turn.T, mesh.faces)
    expected = rotate(jnp.asarray(baked(mesh, directions=1024), float), jnp.asarray(turn))
    assert relative(baked(turned, directions=1024), np.asarray(expected)) < 0.015  # 1.1e-2 measured


def test_a_seed_turns_the_directions():
    mesh = knot(400)
    first, again, other = (baked(mesh, directions=256, seed=seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert 1e-3 < relative(other, first) < 0.1


@pytest.mark.parametrize(("chunk", "threads"), [(1, 1), (64, 3), (300, 2), (10_000, 4)])
def test_chunks_and_threads_change_no_bit(monkeypatch, chunk, threads):
    mesh = knot(500)
    whole = baked(mesh, directions=256, bounces=1)
    monkeypatch.setattr(_embree, "cores", lambda: threads)
    monkeypatch.setattr(_passes, "cores", lambda: threads)
    cut = baked(mesh, directions=256, bounces=1, chunk=chunk)
    np.testing.assert_array_equal(cut, whole)


def test_vertices_that_see_nothing_or_have_no_normal_are_counted():
    """A fin of two faces back to back, and a small ball enclosed by a larger one."""
    outer, faces = bodies.sphere(6, 8, 0.99 * np.pi)
    vertices = np.concatenate([[[5, 0, 0], [5, 0, 1], [5, 1, 0]], 2 * outer, 0.2 * outer])
    fin = np.array([[0, 1, 2], [0, 2, 1]])
    # The outer ball is closed at its lower end by a fan about the first vertex of its last ring.
    ring = len(outer) - 8 + np.arange(8)
    cap = np.stack([ring[1:-1], ring[0] + 0 * ring[1:-1], ring[2:]], axis=1)[:, [1, 2, 0]]
    faces = np.concatenate([faces, cap])
    points = jnp.asarray(vertices, jnp.float32)  # make_mesh would drop a side of the fin
    faces = jnp.asarray(np.concatenate([fin, faces + 3, faces + 3 + len(outer)]))
    mesh = Mesh(points, faces, vertex_normals(points, faces))
    message = (
        rf"bake: 3 of {len(vertices)} vertices have no normal \(3 on faces that are there twice, "
        rf"both ways round\) and {len(outer)} of {len(vertices)} vertices see nothing "
        rf"\({len(outer)} behind faces of another piece, as inside it\); they get no direct light"
    )
    with pytest.warns(UserWarning, match=message):
        coefficients = baked(mesh, directions=128)
    unlit = ~coefficients.any(axis=1)
    np.testing.assert_array_equal(
        unlit, np.r_[[True] * 3, [False] * len(outer), [True] * len(outer)]
    )


@pytest.mark.parametrize("normal", [[0, 0, 0], [np.nan, 0, 1], [0, np.inf, 0]])
def test_normals_by_hand_that_are_none_are_counted(normal):
    receivers = bodies.points([[0, 0, 0], [1, 0, 0]], [[0, 0, 3], normal])
    message = "1 of 2 vertices have no normal .1 whose normal is zero, NaN or infinite"
    with pytest.warns(UserWarning, match=message):
        coefficients = baked(receivers, shadows=False)
    exact = convolve(evaluate(jnp.array([0.0, 0, 1]), 4), clamped_cosine(4))
    np.testing.assert_allclose(coefficients, [exact, 0 * exact], rtol=0, atol=1e-6)


@pytest.mark.parametrize("kind", [AxisType.Auto, AxisType.Explicit])
def test_a_mesh_that_is_shared_out_is_baked_on_the_host(kind):
    """The bake does not shard: it reads the whole mesh, and gives arrays on one device."""
    devices = jax.make_mesh((2,), ("rows",), axis_types=(kind,))
    mesh = knot(300)
    shared = jax.device_put(mesh, NamedSharding(devices, PartitionSpec("rows")))
    options = {"directions": 64, "bounces": 1, "progress": False}
    whole, got = bake(mesh, 2, **options), bake(shared, 2, **options)
    np.testing.assert_array_equal(got.coefficients, whole.coefficients)
    assert len(got.coefficients.devices()) == 1


def test_a_scene_may_hold_more_than_the_mesh():
    mesh = bodies.ball()
    roof = bodies.rectangle([-50, -50, 1.5], [100, 0, 0], [0, 100, 0])
    alone, under = baked(mesh), baked(mesh, scene=ray_scene([mesh, roof]))
    top = int(np.asarray(mesh.vertices)[:, 2].argmax())
    # What is left of the sky at the top is a rim at most 0.5/50 above the horizon.
    assert alone[top, 0] * np.sqrt(4 * np.pi) == pytest.approx(np.pi)
    assert abs(under[top, 0]) * np.sqrt(4 * np.pi) < 1e-3


@pytest.mark.slow
def test_bounces_off_another_mesh_than_the_scenes_first_are_refused():
    mesh = knot(300)
    ground = bodies.rectangle((-2.0, -2.0, -2.0), (4.0, 0.0, 0.0), (0.0, 4.0, 0.0))
    turned = make_mesh(np.asarray(mesh.vertices) @ [[0, 1, 0], [0, 0, 1], [1, 0, 0]], mesh.faces)
    for others in ([knot(600)], [turned], [ground], [ground, mesh]):
        for make in (ray_scene, JaxRayScene):
            with pytest.raises(ValueError, match="expected a scene whose first mesh is the baked"):
                baked(mesh, 1, directions=64, bounces=1, scene=make(others))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"degree": -1}, "degree must be an integer >= 0"),
        ({"directions": 0}, "directions must be an integer >= 1, got 0"),
        ({"bounces": -1}, "bounces must be an integer >= 0, got -1"),
        ({"chunk": 0}, "chunk must be an integer >= 1"),
        ({"bounces": 1, "shadows": False}, "bounces=1 needs rays"),
        ({"ray_bias": 0.0}, "ray_bias must be a number > 0, got 0.0"),
        ({"ray_bias": float("nan")}, "ray_bias must be a number > 0, got nan"),
        ({"albedo": np.ones(3)}, r"albedo must be a number or have shape \(8,\), got shape \(3,\)"),
        ({"albedo": -0.1}, "albedo must be finite and >= 0"),
        (
            {"surface": "ball.ply"},
            "expected surface as a Mesh or a Points or a Texels, got .ball.ply.",
        ),
    ],
)
def test_bad_arguments_are_refused(unchecked, options, message):
    with pytest.raises((ValueError, TypeError), match=message):
        bake(**({"surface": bodies.cube(), "degree": 2, "progress": False} | options))


def test_bad_meshes_are_refused(unchecked):
    mesh = bodies.cube()
    broken = Mesh(mesh.vertices.at[3, 1].set(jnp.nan), mesh.faces, mesh.normals)
    with pytest.raises(ValueError, match="1 NaN or infinite vertices"):
        bake(broken, 2)
    with pytest.raises(ValueError, match="name vertices 0 to 7, but it has 0 to 6"):
        bake(Mesh(mesh.vertices[:7], mesh.faces, mesh.normals[:7]), 2)
    with pytest.raises(ValueError, match="no vertices"):
        bake(Mesh(mesh.vertices[:0], mesh.faces[:0], mesh.normals[:0]), 2)


def test_hand_made_meshes_of_small_floats_are_refused(unchecked):
    mesh = bodies.cube()
    small = Mesh(mesh.vertices.astype(jnp.float16), mesh.faces, mesh.normals)
    with pytest.raises(ValueError, match="expected vertices of the mesh in float32 or float64"):
        bake(small, 2)


def test_traced_meshes_are_refused():
    with pytest.raises(ValueError, match="known values for vertices of the mesh, got traced ones"):
        jax.eval_shape(lambda mesh: bake(mesh, 2).coefficients, bodies.cube())


@pytest.mark.parametrize("length", [1e-40, 1e-30, 1e30])
def test_normals_may_have_any_length(length):
    mesh = bodies.cube()
    normals = np.asarray(mesh.normals, np.float32) * np.float32(length)
    other = Mesh(mesh.vertices, mesh.faces, jnp.asarray(normals))
    expected, got = (baked(m, 2, shadows=False) for m in (mesh, other))
    atol = 1e-5 if length < 1e-38 else 3e-7  # below 1.2e-38 the normals themselves lose digits
    np.testing.assert_allclose(got, expected, rtol=0, atol=atol)


def test_doubles_on_this_thread_alone_are_doubles_on_all(recwarn):
    """`with jax.enable_x64(True)` holds on one thread, and a bake has several."""
    mesh = knot(300)
    mesh = Mesh(mesh.vertices.astype(float), mesh.faces, mesh.normals.astype(float))
    expected = baked(mesh, 2, directions=16, bounces=1)
    jax.config.update("jax_enable_x64", False)
    try:
        with jax.enable_x64(True):
            got = baked(mesh, 2, directions=16, bounces=1)
    finally:
        jax.config.update("jax_enable_x64", True)
    np.testing.assert_array_equal(got, expected)
    assert not list(recwarn)


@pytest.mark.parametrize(("terminal", "progress"), [(True, True), (True, False), (False, True)])
def test_the_bar_is_for_a_terminal_and_can_be_switched_off(terminal, progress, monkeypatch):
    import tqdm

    class Eager(tqdm.tqdm):
        def __init__(self, **options):
            super().__init__(**options | {"delay": 0})

    screen = io.StringIO()
    screen.isatty = lambda: terminal
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setattr(tqdm, "tqdm", Eager)
    bake(bodies.cube(), 2, directions=64, progress=progress)
    assert ("8/8" in screen.getvalue()) == (terminal and progress)
    assert bool(screen.getvalue()) == (terminal and progress)
