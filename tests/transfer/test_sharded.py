"""Points shared out over devices: filled up to a multiple of these, and nothing else changed."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.sharding import AxisType, Mesh, NamedSharding
from jax.sharding import PartitionSpec as P
from sharding import collectives

from jaxsh import geometry, inverse, midrange, sphere, transfer
from jaxsh.transfer import Material
from jaxsh.transfer._store import BlockStore

V, W, DEGREE = 33, 34, 2
DEVICES = jax.devices()[:2]
OVER = {
    "list": DEVICES,
    "auto": Mesh(np.array(DEVICES), ("rows",)),
    "explicit": Mesh(np.array(DEVICES), ("rows",), axis_types=(AxisType.Explicit,)),
}


@pytest.fixture
def made(rng):
    """Points inside a box, with normals all around and coefficients that none of them share."""
    normals = sphere.fibonacci(V).directions.astype(jnp.float32)
    made = transfer.unshadowed(0.3 * normals, normals, DEGREE)
    noise = jnp.asarray(0.01 * rng.normal(size=made.coefficients.shape), jnp.float32)
    table = jnp.asarray(rng.integers(V, size=(V, 2)), jnp.int32)
    return transfer.Transfer(made.coefficients + noise, made.positions, normals, table)


@pytest.fixture
def light(rng):
    return jnp.asarray(rng.normal(size=(3, 9)), jnp.float32)


def per_vertex(rng, *shape):
    return rng.uniform(0.1, 1, size=shape).astype(np.float32)


@pytest.mark.slow
def test_what_fills_up_sees_nothing(made):
    shared = made.sharded(DEVICES)
    assert (shared.num_points, made.num_points) == (W, V)
    for name in ("coefficients", "positions", "normals", "neighbors"):
        array = getattr(shared, name)
        np.testing.assert_array_equal(array[:V], getattr(made, name))
        assert array.sharding.is_equivalent_to(NamedSharding(OVER["auto"], P("rows")), 2)
        assert array.dtype == getattr(made, name).dtype
    assert not np.any(shared.coefficients[V:])
    assert not np.any(shared.normals[V:])
    np.testing.assert_array_equal(shared.positions[V:], made.positions[-1:])
    np.testing.assert_array_equal(shared.neighbors[V:], [[V, V]])


def check_same(function, shared, plain):
    """Calls it with arguments that are shared out, and with what they were before."""
    compiled = jax.jit(function).lower(*shared).compile()
    assert not collectives(compiled)
    colors, expected = compiled(*shared), function(*plain)
    assert colors.shape == (W, 3)
    assert tuple(colors.sharding.spec)[:1] == ("rows",)
    # Of colors up to 1.3, by sums in another order; 1.2e-7 was met.
    np.testing.assert_allclose(np.asarray(colors)[:V], expected, rtol=0, atol=3e-7)
    assert not np.asarray(colors)[V:].any()


def test_what_fills_up_a_compressed_transfer_is_of_a_black_cluster(made):
    small = transfer.compress(made, clusters=3, components=2)
    shared = small.sharded(DEVICES)
    assert (shared.num_points, shared.num_clusters) == (W, 4)
    np.testing.assert_array_equal(shared.cluster[V:], 3)
    assert not np.any(shared.scales[3])
    np.testing.assert_array_equal(shared.codes[:3], small.codes)
    np.testing.assert_array_equal(shared.weights[:, :V], small.weights)


@pytest.mark.slow
def test_a_compressed_transfer_is_shaded_on_devices(made, light):
    small = transfer.compress(made, clusters=3, components=2)
    check_same(transfer.shade_diffuse, (light, small.sharded(DEVICES), 0.5), (light, small, 0.5))


EYE = np.array([0.3, -2.0, 1.5], np.float32)
ALL = "list", *(pytest.param(over, marks=pytest.mark.slow) for over in ("auto", "explicit"))


@pytest.mark.parametrize("over", ALL)
def test_shading_is_that_of_one_device(made, light, rng, over):
    albedo = per_vertex(rng, V, 3)
    material = Material(albedo, per_vertex(rng, V, 1), 10 * per_vertex(rng, V))
    shared, rows = made.sharded(OVER[over]), transfer.shard_rows(albedo, OVER[over])
    check_same(transfer.shade_diffuse, (light, shared, rows), (light, made, albedo))
    painted = material.sharded(OVER[over])
    both = (light, shared, EYE, painted), (light, made, EYE, material)
    check_same(transfer.shade_glossy, *both)


@pytest.mark.slow
@pytest.mark.parametrize("over", OVER)
def test_so_is_that_of_other_forms(made, light, rng, over):
    def check(function, *arguments):
        shared = [a.sharded(OVER[over]) if hasattr(a, "sharded") else a for a in arguments]
        check_same(function, shared, arguments)

    check(transfer.shade_glossy, light, transfer.sample(made), EYE, Material(0.5, 0.3, 8.0))
    check(transfer.shade_diffuse, light, transfer.quantize(made), 0.5)
    suns = sphere.Suns(
        *(jnp.asarray(a, jnp.float32) for a in ([[0, 0.6, 0.8]], [0.1], [[1, 2, 3]]))
    )
    seen, draw = rng.random((V, 1, 4)) < 0.5, rng.integers(2**32, size=V, dtype=np.uint32)
    visibility = transfer.SunVisibility(
        jnp.asarray(seen), jnp.asarray(draw), suns.direction, suns.solid_angle
    )
    check(transfer.shade_sun, suns, made, visibility, 0.5)


@pytest.mark.slow
def test_slopes_are_those_of_one_device(made, light, rng):
    material = Material(per_vertex(rng, V, 3), 0.3, 10 * per_vertex(rng, V))

    def loss(light, made, material):
        return jnp.sum(transfer.shade_glossy(light, made, EYE, material) ** 2)

    slopes = jax.jit(jax.grad(loss, (0, 1, 2), allow_int=True))
    expected = slopes(light, made, material)
    found = slopes(light, made.sharded(DEVICES), material.sharded(DEVICES))
    for name in ("coefficients", "positions", "normals"):
        one, other = (np.asarray(getattr(g[1], name)) for g in (found, expected))
        # 1.2e-7 of the largest was met, and 1.8e-7 of the light's.
        np.testing.assert_allclose(one[:V], other, rtol=0, atol=5e-7 * abs(other).max())
        assert np.isfinite(one).all()
    np.testing.assert_allclose(found[0], expected[0], rtol=0, atol=5e-7 * abs(expected[0]).max())


def fits(observed, made):
    yield inverse.fit_light(observed, made, 0.5, 1, prior=None)
    yield inverse.fit_light(observed, made.normals, 0.5, 1, prior=None)
    corners = np.array([[-0.2, -0.2, 1.5], [-0.2, 0.2, 1.5], [0.2, 0.2, 1.5], [0.2, -0.2, 1.5]])
    lamp = midrange.Polygon(corners.astype(np.float32), np.ones(3, np.float32))
    yield inverse.fit_colors(observed, made, 0.5, [lamp])


@pytest.mark.slow
def test_fits_skip_what_fills_up(made, light):
    """Their deviations too, which count the observations."""
    observed = np.asarray(transfer.shade_diffuse(light, made, 0.5))
    shared = transfer.shard_rows(observed, DEVICES)
    for found, expected in zip(
        fits(shared, made.sharded(DEVICES)), fits(observed, made), strict=True
    ):
        # Of values up to 8; 1.9e-6 was met.
        np.testing.assert_allclose(found.value, expected.value, rtol=0, atol=4e-6)
        one, other = found.confidence.deviation, expected.confidence.deviation
        np.testing.assert_allclose(one, other, rtol=1e-6)  # 2.3e-7 was met


def test_places_of_a_number_that_fits_already_and_of_more_devices_than_points(made):
    again = made.sharded(DEVICES).sharded(DEVICES[:1])  # 34 points: they are not taken away again
    assert again.num_points == W
    assert made.sharded(DEVICES[:1]).num_points == V
    one = jax.tree.map(lambda array: array[:1], made).sharded(DEVICES)
    np.testing.assert_array_equal(one.positions, np.repeat(made.positions[:1], 2, 0))
    np.testing.assert_array_equal(one.neighbors[1:], [[1, 1]])
    shared = transfer.shard_rows(np.arange(4), OVER["explicit"])
    np.testing.assert_array_equal(transfer.shard_rows(shared, DEVICES), np.arange(4))
    np.testing.assert_array_equal(transfer.shard_rows(np.ones(3, bool)), [1, 1, 1, 0])


@pytest.mark.parametrize("over", ALL)
def test_a_store_is_read_as_a_transfer_is_shared_out(over, tmp_path, monkeypatch):
    knot = geometry.knot(300)
    faces = knot.faces[np.all(knot.faces < 299, axis=1)]
    mesh = geometry.Mesh(knot.vertices[:299], faces, knot.normals[:299])
    store = tmp_path / "knot.zarr"
    baked = transfer.bake(mesh, 1, directions=16, shadows=False, store=store, progress=False)
    reads, read = [], BlockStore.read
    monkeypatch.setattr(
        BlockStore, "read", lambda *arguments: (reads.append(arguments[1:]), read(*arguments))[1]
    )
    found = transfer.open(store).sharded(OVER[over])
    for array, expected in zip(
        jax.tree.leaves(found), jax.tree.leaves(baked.sharded(OVER[over])), strict=True
    ):
        np.testing.assert_array_equal(array, expected)
        assert array.dtype == expected.dtype
        assert array.sharding == expected.sharding
    # Blocks of 64: the third is in both parts, and the last row has been looked at before.
    blocks = [block for name, block in reads if name == "coefficients"]
    assert blocks == [4, 0, 1, 2, 2, 3, 4]


def test_a_mesh_of_two_axes_is_shared_out_over_both(made):
    mesh = Mesh(np.array(DEVICES).reshape(1, 2), ("hosts", "devices"))
    assert made.sharded(mesh).positions.sharding.spec == P(("hosts", "devices"))


def test_wrong_devices_are_refused(made, unchecked):
    for wrong in (DEVICES[0], [], ["cpu"], 2, [DEVICES[0], DEVICES[0]]):
        with pytest.raises(ValueError, match="expected devices"):
            made.sharded(wrong)
    with pytest.raises(ValueError, match=r"expected values \(V, \.\.\.\), a row for each point"):
        transfer.shard_rows(0.5)
    with pytest.raises(ValueError, match="expected known values for transfer"):
        jax.jit(lambda made: made.sharded(DEVICES))(made)
