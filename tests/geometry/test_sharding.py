"""Rays and normals on a mesh of devices; what runs on the host takes shared arrays too."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.sharding import AxisType, NamedSharding
from jax.sharding import PartitionSpec as P
from shapes import square
from sharding import ROWS, WHOLE, check_sharded, collectives

from jaxsh import geometry
from jaxsh.geometry import RayTree

STEPS = {"all-reduce": "the loop over all rays ends when the last of them does, on any device"}


@pytest.fixture(scope="module")
def scene():
    return geometry.JaxRayScene(geometry.knot(300))


def test_trace_keeps_the_sharding_of_rays(scene, rng):
    origins, directions = rng.normal(size=(2, 64, 3)).astype(np.float32)
    limits = rng.uniform(0.5, 2, size=64).astype(np.float32)

    def cast(*arrays):
        tree, (origins, directions, limits) = RayTree(*arrays[:-3]), arrays[-3:]
        found = geometry.trace(tree, origins, directions, limits, lanes=16)
        return found.triangle, jnp.minimum(found.distance, 9), found.barycentric

    specs = (*[WHOLE] * len(scene.tree), ROWS, ROWS, ROWS)
    arguments = *scene.tree, origins, directions, limits
    check_sharded(cast, arguments, specs, (ROWS, ROWS, ROWS), exchange=STEPS)


@pytest.fixture(scope="module")
def held():
    """The unit square on 12 of 6 × 4 texels, with 4 in its gutter."""
    return geometry.texels(square(scale=(0.5, 1.0)), (6, 4), gutter=1)


@pytest.mark.slow
def test_rays_of_the_sun_keep_the_sharding_of_their_origins(scene, rng):
    origins = rng.normal(size=(64, 3)).astype(np.float32)

    def lit(origins, sun):
        directions = jnp.broadcast_to(sun[None], origins.shape)
        found = geometry.trace(scene.tree, origins, directions, first=False)
        return (found.triangle < 0).astype(jnp.float32)

    sun = np.array([0, 0.6, 0.8], np.float32)
    check_sharded(lit, (origins, sun), (ROWS, WHOLE), ROWS, exchange=STEPS)


@pytest.mark.parametrize("count", [0, 5, 40])
def test_rays_beyond_the_count_miss(scene, rng, count):
    """On a mesh of devices too, where each ray has a lane of its own."""
    origins, directions = rng.normal(size=(2, 64, 3)).astype(np.float32)
    mesh = jax.make_mesh((2,), ("rows",), axis_types=(AxisType.Auto,))
    placed = jax.device_put((origins, directions), NamedSharding(mesh, ROWS))

    @jax.jit
    def cast(origins, directions, count):
        return geometry.trace(scene.tree, origins, directions, count=count).triangle

    whole, shared = cast(*map(jnp.asarray, (origins, directions)), count), cast(*placed, count)
    np.testing.assert_array_equal(shared, whole)
    assert (np.asarray(shared)[count:] == -1).all()


@pytest.mark.parametrize("kind", [AxisType.Auto, AxisType.Explicit])
def test_normals_of_shared_faces_are_those_of_all(kind):
    knot = geometry.knot(300)
    mesh = jax.make_mesh((2,), ("rows",), axis_types=(kind,))
    faces = jax.device_put(knot.faces, NamedSharding(mesh, ROWS))
    vertices = jax.device_put(knot.vertices, NamedSharding(mesh, WHOLE))
    compiled = jax.jit(geometry.vertex_normals).lower(vertices, faces).compile()
    np.testing.assert_allclose(compiled(vertices, faces), knot.normals, rtol=0, atol=1e-6)
    assert set(collectives(compiled)) == {"all-reduce"}  # a vertex is in faces of both devices


def test_normals_keep_the_sharding_of_poses(rng):
    knot = geometry.knot(300)
    poses = np.asarray(knot.vertices) + 0.1 * rng.normal(size=(2, 300, 3)).astype(np.float32)
    normals = jax.vmap(lambda v: geometry.vertex_normals(v, knot.faces))
    check_sharded(normals, (poses,), (ROWS,), ROWS)
    if jax.__version_info__ < (0, 12):  # from there on JAX refuses to transpose the gather
        gradient = jax.grad(lambda v: jnp.sum(normals(v) ** 3))
        check_sharded(gradient, (poses,), (ROWS,), ROWS, rtol=1e-4)


def test_normals_of_shared_vertices_are_refused():
    knot = geometry.knot(300)
    mesh = jax.make_mesh((2,), ("rows",), axis_types=(AxisType.Explicit,))
    vertices = jax.device_put(knot.vertices, NamedSharding(mesh, ROWS))
    with pytest.raises(ValueError, match="need all vertices on each device"):
        geometry.vertex_normals(vertices, knot.faces)


@pytest.mark.slow
def test_what_runs_on_the_host_takes_shared_arrays(scene, rng):
    """Ray scenes, neighbors and topology are NumPy: they read the whole of what is shared out."""
    knot = geometry.knot(300)
    mesh = jax.make_mesh((2,), ("rows",), axis_types=(AxisType.Auto,))
    shared = jax.device_put(knot, NamedSharding(mesh, ROWS))
    np.testing.assert_array_equal(geometry.neighbors(shared), geometry.neighbors(knot))
    assert geometry.topology(shared) == geometry.topology(knot)
    rays = rng.normal(size=(2, 64, 3)).astype(np.float32)
    placed = jax.device_put(rays, NamedSharding(mesh, P(None, "rows")))
    for one, other in zip(scene.closest_hit(*placed), scene.closest_hit(*rays), strict=True):
        np.testing.assert_array_equal(one, other)


def test_carry_keeps_the_sharding_of_texels(held, rng):
    values = rng.normal(size=(len(held.mesh.vertices), 2)).astype(np.float32)

    def carry(rows, values):
        return dataclasses.replace(held, **rows).carry(values)

    names = "positions", "normals", "uv", "face", "barycentric"
    rows = {name: getattr(held, name) for name in names}
    check_sharded(carry, (rows, values), (ROWS, WHOLE), ROWS)


def test_images_keep_the_rows_of_the_picture(held, rng):
    values = rng.normal(size=(held.num_points, 2)).astype(np.float32)

    def image(source, values):
        return dataclasses.replace(held, source=source).image(values, 0.5)

    check_sharded(image, (held.source, values), (ROWS, WHOLE), ROWS)


@pytest.mark.parametrize("kind", [AxisType.Auto, AxisType.Explicit])
def test_values_shared_out_by_texel_make_a_whole_picture(held, kind):
    """As after a bake and shading whose rows are shared out."""
    mesh = jax.make_mesh((2,), ("rows",), axis_types=(kind,))
    shared = jax.device_put(held.positions, NamedSharding(mesh, ROWS))

    def loss(values):
        image = held.image(values)
        return jnp.sum(image**2), image

    step = jax.jit(jax.value_and_grad(loss, has_aux=True))
    (_, image), gradient = step(shared)
    (_, whole), expected = step(held.positions)
    np.testing.assert_array_equal(image, whole)
    np.testing.assert_allclose(gradient, expected, rtol=0, atol=1e-6)
    assert image.sharding.is_fully_replicated
