"""The adaptive methods on a mesh of devices: they shard, or say why they do not."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.sharding import NamedSharding
from sharding import ROWS, WHOLE, P, check_sharded

from jaxsh import adaptive
from jaxsh.transfer import Material, Transfer

V, DEGREE, K = 16, 3, 16
METHODS = [
    adaptive.Levels(rings=1),
    adaptive.TwoStage(),
    adaptive.Anchors(),
    adaptive.Tiles(),
    adaptive.Masks(rings=1),
    adaptive.Masks(smoothing=True),
]


@pytest.fixture
def frame(rng):
    def array(*shape):
        return jnp.asarray(rng.uniform(0.1, 1, size=shape), np.float32)

    points = jnp.asarray(rng.normal(size=(V, 3)), np.float32)
    decay = jnp.asarray((1 + np.sqrt(np.arange(K))) ** -2, np.float32)
    made = Transfer(array(V, K) * decay[None], points, points, jnp.zeros((V, 1), np.int32))
    eye = jnp.asarray([0.3, -2.0, 1.5], np.float32)
    return array(3, K), made, eye, Material(array(V, 3), array(V, 1), 10 * array(V))


def test_masks_keep_the_sharding_of_vertices(frame):
    method = adaptive.Masks(threshold=0.02, diffuse_threshold=0.03, fallback="base")

    def color(light, made, eye, material):
        return adaptive.shade(light, made, eye, material, method).color

    for shown in adaptive.shade(*frame, method).shown_degree.values():
        assert set(np.asarray(shown).tolist()) == {2, DEGREE}  # some have left
    check_sharded(color, frame, (WHOLE, ROWS, WHOLE, ROWS), ROWS)


def test_levels_are_gathered_by_each_device(frame):
    method = adaptive.Levels(threshold=0.02, diffuse_threshold=0.03, fallback="base")

    def shown(light, made, eye, material):
        result = adaptive.shade(light, made, eye, material, method)
        again = adaptive.Levels(hysteresis=0.5, previous=result)
        return result.color, adaptive.shade(light, made, eye, material, again).color

    check_sharded(shown, frame, (WHOLE, ROWS, WHOLE, ROWS), ROWS)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["Auto", "Explicit"])
def test_levels_shares_are_means_over_devices(frame, kind):
    light, made, eye, material = frame
    method = adaptive.Levels(threshold=0.02, diffuse_threshold=0.03)
    expected = adaptive.shade(light, made, eye, material, method)
    kind = getattr(jax.sharding.AxisType, kind)
    mesh = jax.make_mesh((2,), ("rows",), axis_types=(kind,))
    made, material = jax.device_put((made, material), NamedSharding(mesh, P("rows")))
    light, eye = jax.device_put((light, eye), NamedSharding(mesh, P()))
    found = adaptive.shade(light, made, eye, material, method)
    assert 0 < float(expected.active_fraction["specular"][-1]) < 1
    for name, share in expected.active_fraction.items():
        np.testing.assert_array_equal(found.active_fraction[name], share)
        np.testing.assert_array_equal(found.shown_degree[name], expected.shown_degree[name])
    np.testing.assert_allclose(found.relative_cost, expected.relative_cost, rtol=1e-6)


def sharded(tree):
    mesh = jax.make_mesh((2,), ("rows",), axis_types=(jax.sharding.AxisType.Auto,))
    return jax.device_put(tree, NamedSharding(mesh, P("rows")))


@pytest.mark.parametrize("method", METHODS, ids=lambda method: type(method).__name__)
def test_methods_that_gather_refuse_several_devices(frame, method, unchecked):
    light, made, eye, material = frame
    made, material = sharded(made), Material(material.diffuse, material.specular, 8.0)

    def color(made):
        return adaptive.shade(light, made, eye, material, method).color

    for call in (color, jax.jit(color)):
        with pytest.raises(
            ValueError, match=r"gathers vertices .* take Masks\(\)|looks at the val"
        ):
            call(made)
    with pytest.raises(ValueError, match=r"gathers vertices .* take Masks\(\)"):
        color(made)


def test_sets_are_made_of_one_device_s_arrays(frame):
    made = sharded(frame[1])
    for make in (
        adaptive.stage,
        adaptive.make_anchors,
        lambda made: adaptive.make_tiling(made, frame[2]),
        lambda made: adaptive.make_tiles(made, frame[2]),
        lambda made: adaptive.arrange(made, adaptive.make_tiling(frame[1], frame[2])),
        lambda made: adaptive.make_tile_atlas(made, views=1),
    ):
        with pytest.raises(ValueError, match="gathers vertices from all over the mesh"):
            make(made)
