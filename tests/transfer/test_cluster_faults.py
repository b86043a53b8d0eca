"""Bakes on a cluster of processes that are killed, lose their scheduler, or fill the disk."""

import contextlib
import os
import resource
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from jaxsh.geometry import knot
from jaxsh.transfer import bake, bake_on
from jaxsh.transfer._bake._kept import BakeStore

dask, distributed = (
    pytest.importorskip(name, reason="needs the extra scale") for name in ("dask", "distributed")
)
pytestmark = pytest.mark.slow
# 94 blocks of 64 vertices, each of which takes some hundredths of a second.
VERTICES, DEGREE = 6000, 2
MESH = knot(VERTICES)
ALIKE = {"directions": 1024, "seed": 3, "progress": False}
CLIENT = f"""
import sys
from jaxsh import geometry, transfer

if __name__ == "__main__":
    print("started", flush=True)
    transfer.bake_on(None, geometry.knot({VERTICES}), {DEGREE}, store=sys.argv[1], **{ALIKE})
"""


@pytest.fixture(scope="module")
def expected():
    return np.asarray(bake(MESH, DEGREE, **ALIKE).coefficients)


@contextlib.contextmanager
def processes(count=2):
    """Workers of one thread, each a process that is started again where it dies."""
    with (
        distributed.LocalCluster(
            n_workers=count, threads_per_worker=1, dashboard_address=":0"
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.fixture
def cluster():
    with processes() as client:
        yield client


def files(path):
    return sorted((path / "coefficients" / "c").glob("*/0"))


def wait_for(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


def right(path, expected):
    np.testing.assert_array_equal(BakeStore(path).whole("coefficients"), expected)
    return True


def during(path, blocks, act):
    """Start a thread that acts when a bake has written so many blocks; says how many were left."""
    left = []

    def watch():
        wait_for(lambda: len(files(path)) >= blocks)
        act()
        left.append(len(BakeStore(path).missing()))

    thread = threading.Thread(target=watch)
    thread.start()
    return thread, left


def test_a_killed_worker_changes_no_bit(tmp_path, cluster, expected):
    """Its block is done again by another; it is started again and needs nobody's help."""
    path = tmp_path / "knot"
    killed, *_ = cluster.run(os.getpid).values()
    thread, left = during(path, 10, lambda: os.kill(killed, signal.SIGKILL))
    bake_on(cluster, MESH, DEGREE, store=path, **ALIKE)
    thread.join()
    assert left[0] > 0
    assert right(path, expected)
    assert not list(path.rglob("*.partial"))


def test_a_killed_client_is_no_loss(tmp_path, expected):
    """Its own workers end with it, and the same call goes on where it was."""
    import psutil

    path, script = tmp_path / "knot", tmp_path / "client.py"
    script.write_text(CLIENT)
    with subprocess.Popen([sys.executable, script, path], env=environment()) as process:
        wait_for(lambda: len(files(path)) >= 10)
        workers = psutil.Process(process.pid).children(recursive=True)
        process.kill()
    _, alive = psutil.wait_procs(workers, timeout=30)
    assert not alive
    before = {file: file.stat().st_mtime_ns for file in files(path)}
    assert 10 <= len(before) < 94
    with inside() as client:
        bake_on(client, MESH, DEGREE, store=path, **ALIKE)
    assert right(path, expected)
    assert all(file.stat().st_mtime_ns == when for file, when in before.items())
    assert not list(path.rglob("*.partial"))


def test_a_scheduler_that_goes_away_is_said(tmp_path, expected):
    path = tmp_path / "knot"
    with (
        dask.config.set({"distributed.comm.timeouts.connect": "1s"}),
        scheduler() as (process, address),
        worker(address),
    ):
        thread, left = during(path, 10, process.kill)
        with pytest.raises(ConnectionError, match=r"scheduler went away.*the same call goes on"):
            bake_on(address, MESH, DEGREE, store=path, **ALIKE)
        thread.join()
        assert left[0] > 0
    with inside() as client:
        bake_on(client, MESH, DEGREE, store=path, **ALIKE)
    assert right(path, expected)


def test_workers_that_cannot_write_say_so(tmp_path, cluster, expected):
    """A disk that takes no more: a limit on a file's size stands in for it."""
    path = tmp_path / "knot"
    size = 64 * (DEGREE + 1) ** 2 * 4

    def limit(most):
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))

    cluster.run(limit, size // 2)
    with pytest.raises(OSError, match=r"knot.*File too large"):
        bake_on(cluster, MESH, DEGREE, store=path, **ALIKE)
    assert len(BakeStore(path).missing()) == 94
    assert not list(path.rglob("*.partial"))
    cluster.run(limit, resource.RLIM_INFINITY)
    bake_on(cluster, MESH, DEGREE, store=path, **ALIKE)
    assert right(path, expected)


def test_a_block_that_workers_die_of_is_given_up(tmp_path, expected):
    """Not tried for ever: here it is given up with the first worker that dies."""
    path = tmp_path / "knot"
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        processes(1) as client,
    ):
        [pid] = client.run(os.getpid).values()
        thread, left = during(path, 10, lambda: os.kill(pid, signal.SIGKILL))
        with pytest.raises(RuntimeError, match="was given up, as each worker that had it died"):
            bake_on(client, MESH, DEGREE, store=path, **ALIKE)
        thread.join()
        assert left[0] > 0
        client.wait_for_workers(1, timeout=60)
        bake_on(client, MESH, DEGREE, store=path, **ALIKE)
    assert right(path, expected)


def environment():
    root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    return os.environ | {"PYTHONPATH": root}


@contextlib.contextmanager
def inside():
    """A client of workers in this process, which start at once."""
    with (
        distributed.LocalCluster(processes=False, dashboard_address=":0") as threads,
        distributed.Client(threads) as client,
    ):
        yield client


@contextlib.contextmanager
def scheduler():
    code = [
        "import asyncio, distributed",
        "async def main():",
        "    async with distributed.Scheduler(host='127.0.0.1', port=0, dashboard=False) as one:",
        "        print(one.address, flush=True)",
        "        await one.finished()",
        "asyncio.run(main())",
    ]
    command = [sys.executable, "-c", "\n".join(code)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process, process.stdout.readline().strip()
        finally:
            process.kill()


@contextlib.contextmanager
def worker(address):
    command = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--no-dashboard"]
    with subprocess.Popen(
        [*command, "--nthreads", "1", "--no-nanny"], env=environment(), stderr=subprocess.DEVNULL
    ) as process:
        try:
            yield
        finally:
            process.kill()
