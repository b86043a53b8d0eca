"""Bakes on a cluster: the bits of a bake in one process, whatever happens on the way."""

import os

import bodies
import numpy as np
import pytest

from jaxsh.geometry import Points, knot
from jaxsh.transfer import bake, bake_on
from jaxsh.transfer._bake import _worker
from jaxsh.transfer._bake._kept import BakeStore

dask, distributed = (
    pytest.importorskip(name, reason="needs the extra scale") for name in ("dask", "distributed")
)
MESH, DEGREE = knot(700), 2
ALIKE = {"directions": 128, "progress": False}


@pytest.fixture(scope="module")
def client():
    """Two workers in this process: what they do is the same as in their own."""
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=False, dashboard_address=":0"
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as one,
    ):
        yield one


def rows(store):
    return BakeStore(store).whole("coefficients")


def test_a_cluster_gives_the_bits_of_one_process(tmp_path, client):
    """With bounces and an albedo per vertex; the scheduler holds nothing of it afterwards."""
    albedo = np.linspace(0.2, 0.8, 700)
    options = ALIKE | {"bounces": 2, "albedo": albedo, "seed": 5}
    expected = bake(MESH, DEGREE, **options)
    stored = bake_on(client, MESH, DEGREE, store=tmp_path / "knot", chunk=64, **options)
    np.testing.assert_array_equal(rows(tmp_path / "knot"), expected.coefficients)
    assert stored.num_points == 700
    assert not _worker._held  # the tree is let go of
    assert not client.who_has()


def test_points_under_a_mesh_have_the_bits_of_one_process(tmp_path, client):
    """Of a volume, with the bounces of a mesh that is baked first, in blocks of its own."""
    some, folder = Points(1.4 * MESH.vertices[:100]), tmp_path / "points"
    options = ALIKE | {"bounces": 1, "scene": MESH}
    with pytest.warns(UserWarning, match="of 100 points see nothing") as said:
        expected = bake(some, DEGREE, **options)
    with pytest.warns(UserWarning, match="of 100 points see nothing") as again:
        stored = bake_on(client, some, DEGREE, store=folder, **options)
    assert [str(one.message) for one in said] == [str(one.message) for one in again]
    np.testing.assert_array_equal(rows(folder), expected.coefficients)
    assert (stored.num_points, stored.surface, stored.cosine) == (100, "points", False)


@pytest.mark.slow
def test_rays_may_be_cast_by_jax(tmp_path, client):
    options = ALIKE | {"device": True}
    expected = bake(MESH, DEGREE, **options)
    bake_on(client, MESH, DEGREE, store=tmp_path / "knot", **options)
    np.testing.assert_array_equal(rows(tmp_path / "knot"), expected.coefficients)


def test_a_store_that_one_process_began_is_finished_on_a_cluster(tmp_path, client):
    """What is missing or damaged is baked again, and nothing else."""
    path = tmp_path / "knot"
    expected = bake(MESH, DEGREE, store=path, **ALIKE)
    files = sorted((path / "coefficients" / "c").glob("*/0"))
    assert len(files) == 11
    before = [file.stat().st_mtime_ns for file in files]
    files[3].unlink()
    files[5].write_bytes(files[5].read_bytes()[:-9])
    damaged = bytearray(files[8].read_bytes())
    damaged[100] ^= 1
    files[8].write_bytes(damaged)
    bake_on(client, MESH, DEGREE, store=path, **ALIKE)
    np.testing.assert_array_equal(rows(path), expected.coefficients)
    after = [file.stat().st_mtime_ns for file in files]
    assert [i for i in range(11) if before[i] != after[i]] == [3, 5, 8]


def test_vertices_without_light_are_counted_as_by_bake(tmp_path, client):
    """A body inside out beside one that is right: its vertices see nothing."""
    vertices, faces = bodies.sphere(8, 12)
    mesh = bodies.joined(
        bodies.by_hand(vertices, faces, vertices),
        bodies.by_hand(vertices + np.array([5.0, 0, 0]), faces[:, ::-1], -vertices),
    )
    with pytest.warns(UserWarning, match="vertices see nothing") as alone:
        expected = bake(mesh, DEGREE, **ALIKE)
    for _ in range(2):  # again from the finished store
        with pytest.warns(UserWarning, match="vertices see nothing") as here:
            bake_on(client, mesh, DEGREE, store=tmp_path / "two", **ALIKE)
        assert str(here[0].message) == str(alone[0].message)
    np.testing.assert_array_equal(rows(tmp_path / "two"), expected.coefficients)


@pytest.mark.slow
def test_another_bake_s_store_is_refused(tmp_path, client):
    path = tmp_path / "knot"
    bake_on(client, MESH, DEGREE, store=path, **ALIKE)
    before = rows(path)
    with pytest.raises(ValueError, match="another bake: its seed is 0, and 1 here"):
        bake_on(client, MESH, DEGREE, store=path, seed=1, **ALIKE)
    np.testing.assert_array_equal(rows(path), before)


def test_a_worker_s_trouble_is_the_caller_s(tmp_path, client, monkeypatch):
    """A disk that is full for some blocks: the others stay, and nothing is left to run."""

    def full(self, number, block, values, write=BakeStore.write_pass):
        if block == 4:
            raise OSError(28, "No space left on device", f"{self.path}")
        write(self, number, block, values)

    path = tmp_path / "knot"
    with monkeypatch.context() as patch:
        patch.setattr(BakeStore, "write_pass", full)
        with pytest.raises(OSError, match="No space left on device"):
            bake_on(client, MESH, DEGREE, store=path, **ALIKE)
    assert not client.futures
    assert not _worker._held
    assert 4 in BakeStore(path).missing()
    bake_on(client, MESH, DEGREE, store=path, **ALIKE)
    np.testing.assert_array_equal(rows(path), bake(MESH, DEGREE, **ALIKE).coefficients)


def test_workers_that_do_not_see_the_store_say_so(tmp_path, client, monkeypatch):
    monkeypatch.setattr(os.path, "isdir", lambda path: False)
    with pytest.raises(ValueError, match="all workers see under one path"):
        bake_on(client, MESH, DEGREE, store=tmp_path / "knot", **ALIKE)


def test_what_is_no_client_is_refused(tmp_path):
    with pytest.raises(TypeError, match=r"client as a distributed.Client, an address or None"):
        bake_on(3, MESH, DEGREE, store=tmp_path / "knot", **ALIKE)
    with (
        dask.config.set({"distributed.comm.timeouts.connect": "50ms"}),
        pytest.raises(ConnectionError, match="no scheduler at tcp://127"),
    ):
        bake_on("tcp://127.0.0.1:1", MESH, DEGREE, store=tmp_path / "knot", **ALIKE)
    assert not (tmp_path / "knot").exists()
