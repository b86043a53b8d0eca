"""Bakes that the machine stops: killed, out of room, or with a store that was changed on disk."""

import contextlib
import json
import os
import resource
import signal
import socket
import subprocess
import sys
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
import stopping

from jaxsh.transfer import bake, shade_diffuse
from jaxsh.transfer import open as open_store
from jaxsh.transfer._bake import _kept, _passes
from jaxsh.transfer._bake._kept import BakeStore
from jaxsh.transfer._store_make import sweep

OPTIONS = {"directions": 128, "bounces": 1, "progress": False}


@pytest.fixture(scope="module")
def whole():
    return np.asarray(bake(stopping.MESH, 2, **OPTIONS).coefficients)


def ends_as(path, whole):
    np.testing.assert_array_equal(bake(stopping.MESH, 2, store=path, **OPTIONS).coefficients, whole)
    np.testing.assert_array_equal(open_store(path).load().coefficients, whole)
    assert not list(path.rglob("*.partial"))
    assert not [file for file in path.parent.iterdir() if file.name.endswith(".partial")]


@contextlib.contextmanager
def files_of_at_most(size):
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        yield lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize(  # questions: before, in the first and second pass
    "after", [9, pytest.param(0, marks=pytest.mark.slow), pytest.param(28, marks=pytest.mark.slow)]
)
def test_what_cannot_be_written_is_said_and_the_rest_is_kept(tmp_path, whole, after):
    path = tmp_path / "knot"
    with files_of_at_most(1000) as no_room:
        if not after:
            no_room()
        scene = stopping.Scene(after, no_room)
        with pytest.raises(OSError, match=r"knot.*: cannot be written: .*File too large"):
            bake(stopping.MESH, 2, store=path, scene=scene, **OPTIONS, chunk=64)
    assert path.exists() == bool(after)
    if after:
        with pytest.raises(ValueError, match=r"knot: not finished: \d+ of 11 blocks of coeff"):
            open_store(path)
        scene = stopping.Scene()
        got = bake(stopping.MESH, 2, store=path, scene=scene, **OPTIONS).coefficients
        np.testing.assert_array_equal(got, whole)
    else:
        ends_as(path, whole)


@pytest.mark.slow
def test_a_full_disk_is_said_and_the_rest_is_kept(tmp_path, whole):
    """On a disk of 160 kB, where the mesh fits and the first pass does not."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=160k", "tmpfs", str(disk)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("no disk can be mounted here")
    try:
        path = disk / "knot"
        with pytest.raises(OSError, match=r"knot.*: cannot be written: .*No space left"):
            bake(stopping.MESH, 2, store=path, **OPTIONS)
        subprocess.run(["mount", "-o", "remount,size=1m", str(disk)], check=True)
        ends_as(path, whole)
    finally:
        subprocess.run(["umount", str(disk)], check=True)


KILLED = """
import os, signal, sys
sys.path.insert(0, {tests!r})
import stopping
from jaxsh.transfer import bake
scene = stopping.Scene({after}, lambda: os.kill(os.getpid(), signal.SIGKILL))
bake(stopping.MESH, 2, store={path!r}, scene=scene, chunk=64, **{options!r})
"""


@pytest.mark.slow
def test_a_bake_that_is_killed_goes_on_and_ends_the_same(tmp_path, whole):
    path = tmp_path / "knot"
    for after in (9, 24):  # questions: in the first pass, and then in the second
        script = KILLED.format(
            tests=str(Path(__file__).parent), after=after, path=str(path), options=OPTIONS
        )
        run = subprocess.run([sys.executable, "-c", script], capture_output=True, check=False)
        assert run.returncode == -signal.SIGKILL, run.stderr.decode()
    scene = stopping.Scene()
    got = bake(stopping.MESH, 2, store=path, scene=scene, **OPTIONS).coefficients
    np.testing.assert_array_equal(got, whole)
    assert 0 < scene.asked < 33


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    path = tmp_path_factory.mktemp("store") / "knot"
    bake(stopping.MESH, 1, store=path, shadows=False, progress=False)
    return path


def changed(path, file, change):
    content = (path / file).read_bytes()
    (path / file).write_bytes(change(content))
    return content


@pytest.mark.parametrize(
    ("file", "change", "said"),
    [
        ("zarr.json", lambda b: b[:50], "not a transfer store"),
        ("zarr.json", lambda b: b.replace(b"jaxsh transfer store", b"a thesis"), "not a transfer"),
        ("zarr.json", lambda b: b.replace(b'"version": 1', b'"version": 3'), "as version 3, but"),
        ("coefficients/zarr.json", lambda b: b[:50], "damaged: it holds no coefficients"),
        (
            "coefficients/zarr.json",
            lambda b: b.replace(b"700", b"650"),
            "700 rows .* 650 in blocks",
        ),
        ("normals/zarr.json", lambda b: b.replace(b"crc32c", b"gzip"), "holds no normals"),
        ("coefficients/c/3/0", lambda b: b[:-1], "1 of 11 blocks of coefficients are missing"),
        ("neighbors/c/0/0", lambda b: b + b" ", "1 of 11 blocks of neighbors are missing"),
    ],
)
def test_what_open_refuses(finished, file, change, said):
    before = changed(finished, file, change)
    try:
        with pytest.raises(ValueError, match=f"knot: .*{said}"):
            open_store(finished)
    finally:
        (finished / file).write_bytes(before)


def test_a_damaged_block_is_found_when_it_is_read(finished):
    file = "coefficients/c/3/0"
    before = changed(finished, file, lambda content: b"\0" + content[1:])
    try:
        stored = open_store(finished)
        for use in (stored.load, lambda: shade_diffuse(jnp.ones((3, 4)), stored, 0.5)):
            with pytest.raises(ValueError, match=rf"knot: {file} is damaged: bake into it again"):
                use()
    finally:
        (finished / file).write_bytes(before)


@pytest.mark.parametrize("name", ["coefficients", "normals"])
def test_a_block_of_another_place_is_found(finished, name):
    """Though it is whole, and its checksum right."""
    stored = open_store(finished)
    expected, other = stored.load(), (finished / name / "c/4/0").read_bytes()
    changed(finished, f"{name}/c/3/0", lambda content: other)
    with pytest.raises(ValueError, match=rf"knot: {name}/c/3/0 is not what was written there"):
        stored.load()
    bake(stopping.MESH, 1, store=finished, shadows=False, progress=False)
    np.testing.assert_array_equal(
        getattr(open_store(finished).load(), name), getattr(expected, name)
    )
    assert not list(finished.rglob("sums"))


def test_a_store_that_another_process_makes_meanwhile_is_gone_on_with(finished, monkeypatch):
    before = {file: file.stat().st_mtime_ns for file in finished.glob("*/c/*/*")}
    answers = iter([False, False])  # as it was when both looked
    monkeypatch.setattr(_kept, "_stands", lambda path: next(answers, True))
    bake(stopping.MESH, 1, store=finished, shadows=False, progress=False)
    assert {file: file.stat().st_mtime_ns for file in finished.glob("*/c/*/*")} == before
    answers = iter([False, False])
    with pytest.raises(ValueError, match="the store of another bake: its seed is 0, and 1 here"):
        bake(stopping.MESH, 1, store=finished, shadows=False, seed=1, progress=False)
    assert [file.name for file in finished.parent.iterdir()] == ["knot"]


@pytest.mark.parametrize("sums", [None, {"coefficients": 3}])
def test_checksums_that_were_lost_are_made_again(finished, sums):
    before = (finished / "zarr.json").read_text()
    content = json.loads(before)
    content["attributes"]["sums"] = sums
    (finished / "zarr.json").write_text(json.dumps(content))
    with pytest.raises(ValueError, match="is not what was written there: bake into it again"):
        open_store(finished).load()
    bake(stopping.MESH, 1, store=finished, shadows=False, progress=False)
    assert json.loads((finished / "zarr.json").read_text()) == json.loads(before)


def test_two_processes_may_finish_one_after_the_other(tmp_path, monkeypatch):
    monkeypatch.setattr(_passes, "cores", lambda: 1)  # so that block 0 is done before the others
    path = tmp_path / "knot"
    with pytest.raises(KeyboardInterrupt):
        bake(stopping.MESH, 2, store=path, scene=stopping.Scene(9), **OPTIONS, chunk=64)
    one, two = BakeStore(path), BakeStore(path)
    for store in one, two:
        for block in range(one.num_blocks):
            store.write_pass(1, block, np.full_like(one.read_pass(0, 0), 1)[: 700 - 64 * block])
    for store in one, two:
        store.finish("")
        assert not list(path.rglob("sums"))
    assert one.finished


def test_what_a_killed_process_began_is_deleted(tmp_path):
    with subprocess.Popen(["true"]) as ended:
        pass
    for pid, stays in (ended.pid, False), (os.getpid(), True):
        begun = tmp_path / f".knot.{socket.gethostname()}-{pid}-0.partial"
        begun.mkdir()
        sweep(tmp_path / "knot")
        assert begun.exists() == stays


def test_a_path_may_be_relative_or_a_link(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "link").symlink_to("target")
    bake(stopping.MESH, 1, store="link", shadows=False, progress=False)
    stored = open_store("link")
    monkeypatch.chdir("/")
    assert stored.load().coefficients.shape == (700, 4)
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").is_dir()


def test_nothing_is_opened_where_nothing_is(tmp_path):
    with pytest.raises(FileNotFoundError, match="there is no such transfer store"):
        open_store(tmp_path / "knot")
    (tmp_path / "knot").write_text("a thesis")
    with pytest.raises(ValueError, match=r"knot: not a transfer store, .* load reads files"):
        open_store(tmp_path / "knot")
    (tmp_path / "empty").mkdir()
    with pytest.raises(ValueError, match="empty: not a transfer store"):
        open_store(tmp_path / "empty")
    assert list((tmp_path / "empty").iterdir()) == []
