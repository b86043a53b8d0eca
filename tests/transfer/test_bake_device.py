"""Bakes whose rays JAX casts, a chunk of vertices in one program, against those on the host."""

import functools

import bodies
import jax
import jax.numpy as jnp
import lowered.loops
import numpy as np
import pytest
from bodies import relative

from jaxsh.geometry import JaxRayScene, Mesh, Points, _cast, knot, ray_scene, vertex_normals
from jaxsh.transfer import bake
from jaxsh.transfer._bake import _chunk, _device, _passes
from jaxsh.transfer._bake._directions import guided, turned_fibonacci
from jaxsh.transfer._bake._receivers import faces_of

MESH = knot(500)
OPTIONS = {"directions": 64, "progress": False}  # 128 vertices in a chunk
bounces_too = pytest.mark.parametrize("bounces", [0, pytest.param(2, marks=pytest.mark.slow)])


@pytest.fixture(scope="module", autouse=True)
def few_lanes():
    """Less to compile for, and a mesh of 500 vertices takes several chunks."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_cast, "_LANES", {"cpu": 256})
        yield


def baked(mesh=MESH, degree=3, **options):
    return np.asarray(bake(mesh, degree, **OPTIONS | options).coefficients)


@functools.cache
def whole(bounces):
    return baked(device=True, bounces=bounces)


@bounces_too
def test_agrees_with_the_host(bounces):
    """No ray of these grazes an edge, so that only sums are rounded differently."""
    got, host = whole(bounces), baked(device=False, bounces=bounces)
    assert got.dtype == np.float32
    assert relative(got, host) < 1e-7  # 8.2e-8 measured: what is exact, the host has in doubles
    np.testing.assert_array_equal(baked(bounces=bounces), host)  # by default, on a CPU


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "directions", "tolerance"),
    # 8.2e-8 and 4.9e-9 measured: where rays hit is told in float32.
    [(np.float32, 300, 1e-7), (np.float64, 100, 6e-9)],
)
def test_agrees_in_either_precision_and_where_all_directions_are_guides(
    kind, directions, tolerance
):
    mesh = jax.tree.map(lambda x: x.astype(kind) if x.dtype == jnp.float32 else x, knot(300))
    albedo = np.linspace(0.2, 0.9, len(mesh.vertices))
    options = {"degree": 5, "directions": directions, "bounces": 2, "albedo": albedo}
    got = baked(mesh, device=True, **options)
    assert got.dtype == kind
    assert relative(got, baked(mesh, device=False, **options)) < tolerance


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:bake. .* of .* points see nothing")
def test_points_and_volumes_agree_with_the_host():
    """Of a volume all directions count alike, which a last chunk that is filled up must not do."""
    points = Points(1.3 * MESH.vertices[:200], MESH.normals[:200])
    for surface in (points, Points(points.positions)):
        options = {"scene": MESH, "bounces": 1}
        got, host = (baked(surface, device=device, **options) for device in (True, False))
        assert relative(got, host) < 1e-7
        assert np.abs(host).max() > 1


@pytest.mark.slow
def test_a_scene_may_hold_more_than_the_mesh():
    """Its other meshes stop rays, and reflect nothing."""
    meshes = [MESH, bodies.rectangle([-9, -9, -2], [18, 0, 0], [0, 18, 0])]
    got = baked(device=True, scene=JaxRayScene(meshes), bounces=2)
    assert relative(got, whole(2)) > 0.1
    assert relative(got, baked(scene=ray_scene(meshes), bounces=2)) < 1.3e-7  # 1.15e-7 measured


@bounces_too
def test_a_stopped_bake_goes_on_and_ends_the_same(tmp_path, monkeypatch, bounces):
    """Blocks of the store are half a chunk, so that it goes on in the middle of one."""
    path, started = tmp_path / "knot", []

    def stop(*arguments, **options):
        started.append(1)
        if len(started) == 2:
            raise KeyboardInterrupt
        return _chunk.shadowed_rows(*arguments, **options)

    with monkeypatch.context() as patch:
        patch.setattr(_passes, "UNDER_WAY", 1)
        patch.setattr(_device, "shadowed_rows", stop)
        with pytest.raises(KeyboardInterrupt):
            baked(device=True, bounces=bounces, store=path)
    (path / ("passes/0" if bounces else "coefficients") / "c/1/0").unlink()
    again = baked(device=True, bounces=bounces, store=path)
    np.testing.assert_array_equal(again, whole(bounces))
    with pytest.raises(ValueError, match="its device is True, and False here"):
        baked(device=False, bounces=bounces, store=path)


def test_vertices_that_see_nothing_or_have_no_normal_are_counted_alike():
    """A fin of two faces back to back, and a ball enclosed by a larger one."""
    ball, faces = bodies.sphere(16, 16)
    vertices = np.concatenate([[[5, 0, 0], [5, 0, 1], [5, 1, 0]], 2 * ball, 0.2 * ball])
    faces = np.concatenate([[[0, 1, 2], [0, 2, 1]], faces + 3, faces + 3 + len(ball)])
    points, faces = jnp.asarray(vertices, jnp.float32), jnp.asarray(faces, jnp.int32)
    mesh = Mesh(points, faces, vertex_normals(points, faces))
    said, seeing = [], []
    for device in (True, False):
        with pytest.warns(UserWarning, match="have no normal .* see nothing") as record:
            seeing.append(baked(mesh, device=device).any(axis=1))
        said.append([str(warning.message) for warning in record])
    assert said[0] == said[1]
    assert len(said[0]) == 1
    np.testing.assert_array_equal(*seeing)
    assert 0 < seeing[0].sum() < len(vertices)


@pytest.mark.slow
@pytest.mark.parametrize("far", [1e6, 1e50])
def test_from_afar_nothing_is_in_the_way(far):
    """From where float32 loses origins, or does not reach at all, the mesh is too small to hit."""
    points, normals = np.asarray(MESH.vertices, float), np.asarray(MESH.normals, float)
    away = [[far * (1 + 0.01 * i), 3e5, 1e5] for i in range(100)]
    points, normals = np.concatenate([points, away]), np.concatenate([normals, -normals[:100]])
    mesh = Mesh(jnp.asarray(points), MESH.faces, jnp.asarray(normals))
    options = {"scene": JaxRayScene(mesh), "offset": 1e-4}
    got, host = (baked(mesh, device=device, **options) for device in (True, False))
    np.testing.assert_allclose(got, host, rtol=0, atol=1e-15)  # 1.2e-16 measured


@pytest.mark.slow
def test_nothing_is_read_back_but_what_the_whole_mesh_needs(monkeypatch):
    """The number of arrays that NumPy takes from JAX does not depend on that of vertices."""
    counts = []
    for mesh in (MESH, knot(300)):
        taken = []
        with monkeypatch.context() as patch:
            for name in ("asarray", "concatenate"):
                patch.setattr(np, name, counting(getattr(np, name), taken))
            bake(mesh, 3, **OPTIONS | {"bounces": 1, "device": True})
        counts.append(len(taken))
    # 21: 12 for what the mesh holds, 7 for the directions; which rays start beyond a gap, and who
    # sees nothing. Each block of 262,144 vertices asks once or twice more about gaps.
    assert counts[0] == counts[1] < 25


def counting(function, taken):
    def counted(first, *others, **options):
        taken.extend(leaf for leaf in jax.tree.leaves(first) if isinstance(leaf, jax.Array))
        return function(first, *others, **options)

    return counted


WALK = [(None,), (None, None), (None, None, 4)]  # refills of lanes, steps between two, boxes


@functools.cache
def traced(name):
    """A chunk of 4,096 vertices on as many lanes as an H200 has."""
    scene, dtype = JaxRayScene(MESH), np.dtype(np.float32)
    vectors = jnp.zeros((4096, 3), dtype)
    if name == "direct":
        given = _chunk.lights(guided(256, 6, 0, dtype))
        program = functools.partial(_chunk.shadowed_rows.trace, degree=6)
    else:
        outgoing = jnp.zeros((len(MESH.vertices), 49), dtype)
        given = _chunk.reflectors(turned_fibonacci(256, 0, dtype), faces_of(MESH), outgoing)
        program = _chunk.bounced_rows.trace
    return program(scene.tree, vectors, vectors, given, lanes=2**19)


@pytest.mark.parametrize("platform", ["cuda", "tpu"])
@pytest.mark.parametrize(
    ("name", "nests"),
    # What a bounce looks up is cut in four.
    [("direct", WALK + WALK), pytest.param("bounce", [*WALK, (4,)], marks=pytest.mark.slow)],
)
def test_a_chunk_has_no_loops_but_those_of_its_rays(platform, name, nests):
    program = lowered.loops.lowered(traced(name), platform)
    assert program.nests == nests
    assert program.callbacks == []


def test_a_scene_that_jax_does_not_cast_is_refused(unchecked):
    with pytest.raises(ValueError, match="needs a scene whose rays JAX casts, a JaxRayScene, got"):
        baked(scene=ray_scene(MESH), device=True)
    with pytest.raises(ValueError, match=r"expected device as True .* or None .*, got"):
        baked(device=jax.devices()[0])


def test_an_accelerator_casts_by_default(monkeypatch):
    monkeypatch.setattr(_device, "_default_platform", lambda: "gpu")
    assert _device.takes_device(None, None)
    assert _device.takes_device(None, JaxRayScene(MESH))
    assert not _device.takes_device(None, ray_scene(MESH))
    assert not _device.takes_device(False, None)
