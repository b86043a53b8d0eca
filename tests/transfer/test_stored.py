"""Transfer on disk gives what transfer in memory gives."""

import weakref

import jax
import numpy as np
import pytest

from jaxsh.geometry import knot
from jaxsh.transfer import Material, bake, shade_diffuse, shade_glossy
from jaxsh.transfer import open as open_store
from jaxsh.transfer._store import BlockStore

MESH = knot(300)
RNG = np.random.default_rng(17)


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    path = tmp_path_factory.mktemp("store") / "knot"
    baked = bake(MESH, 2, directions=32, store=path, progress=False)
    return open_store(path), baked


def test_all_is_as_in_memory(both):
    stored, baked = both
    assert (stored.num_points, stored.degree, stored.dtype) == (300, 2, baked.dtype)
    read = stored.load()
    jax.tree.map(np.testing.assert_array_equal, read, baked)
    assert jax.tree.map(lambda x: x.dtype, read) == jax.tree.map(lambda x: x.dtype, baked)


def test_blocks_hold_the_vertices_in_order(both):
    stored, baked = both
    seen = []
    for rows, block in stored.blocks():
        seen += range(rows.start, rows.stop)
        for name in ("coefficients", "positions", "normals"):
            np.testing.assert_array_equal(getattr(block, name), getattr(baked, name)[rows])
        # By hand: what lies in another block is the vertex itself.
        for i, row in enumerate(np.asarray(baked.neighbors)[rows]):
            expected = [n - rows.start if rows.start <= n < rows.stop else i for n in row]
            assert block.neighbors[i].tolist() == expected
    assert seen == list(range(300))


def lights():
    return {
        "one": RNG.normal(size=(3, 9)),
        "lower": RNG.normal(size=(3, 4)),
        "batch": RNG.normal(size=(5, 1, 3, 9)),
        "one each": RNG.normal(size=(2, 300, 3, 9)),
    }


@pytest.mark.parametrize(
    "name",
    ["one", "one each", *(pytest.param(n, marks=pytest.mark.slow) for n in ("lower", "batch"))],
)
def test_colors_are_those_of_the_transfer_in_memory(both, name):
    stored, baked = both
    light = lights()[name].astype(np.float32)
    albedo = RNG.random((300, 3), np.float32)
    got = shade_diffuse(light, stored, albedo)
    assert isinstance(got, np.ndarray)
    expected = shade_diffuse(light, baked, albedo)
    np.testing.assert_allclose(got, expected, rtol=0, atol=3e-7)  # 1.2e-7 measured
    eye = np.array([3, 2, 1], np.float32)
    material = Material(albedo, RNG.random(3, np.float32), 5 + RNG.random(300, np.float32))
    got = shade_glossy(light, stored, eye, material)
    assert isinstance(got, np.ndarray)
    expected = shade_glossy(light, baked, eye, material)
    np.testing.assert_allclose(got, expected, rtol=0, atol=3e-7)  # 1.2e-7 measured


def test_no_more_than_two_blocks_a_device_are_in_memory(both, monkeypatch):
    stored, _ = both
    alive, most = weakref.WeakValueDictionary(), []
    read = BlockStore.read

    class Watched(np.ndarray):
        pass

    def watched(self, name, block, room=None):
        array = read(self, name, block, room).view(Watched)
        if name == "coefficients":
            alive[block] = array
            most.append(len(alive))
        return array

    monkeypatch.setattr(BlockStore, "read", watched)
    monkeypatch.setattr(jax, "local_devices", lambda: jax.devices()[:1])
    for _, block in stored.blocks():
        block.coefficients.block_until_ready()
    assert len(most) == 5
    assert max(most) <= 2


def test_doubles_are_stored_and_shaded_in_what_jax_computes_in(tmp_path):
    mesh = jax.tree.map(lambda x: x.astype(float) if x.dtype == np.float32 else x, MESH)
    baked = bake(mesh, 1, store=tmp_path, shadows=False, progress=False)
    light = RNG.normal(size=(3, 4))
    stored = open_store(tmp_path)
    assert stored.dtype == np.float64
    np.testing.assert_array_equal(stored.load().coefficients, baked.coefficients)
    exact = shade_diffuse(light, stored, 0.5)
    assert exact.dtype == np.float64
    with jax.enable_x64(False):
        stored = open_store(tmp_path)
        colors = shade_diffuse(light.astype(np.float32), stored, 0.5)
        read = stored.load()
        assert stored.dtype == colors.dtype == read.coefficients.dtype == read.positions.dtype
        assert stored.dtype == np.float32
    np.testing.assert_allclose(colors, exact, rtol=0, atol=1e-7)  # 7e-8 measured
