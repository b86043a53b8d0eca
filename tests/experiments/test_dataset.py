"""Datasets: cameras and lights as files tell them, folders that go on, pictures made again."""

import errno
import hashlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image
from runs import run

from experiments.dataset import dataset, pifu_bake, sources, views, writing
from experiments.runner import UserError
from jaxsh import geometry, harmonics, imaging, transfer

_SMALL = [
    *("--views", "2", "--turns", "2", "--suns", "0", "--size", "24", "--samples", "1"),
    *("--degree", "2", "--directions", "16", "--bounces", "1", "--mesh", "knot"),
]


def test_cameras_as_matrices():
    camera = imaging.Camera((3.0, -2.0, 1.0), (0.0, 0.5, 0.0), fov_y=50.0, width=6, height=4)
    told = views.told(camera)
    origins, directions = (np.asarray(x, np.float64) for x in camera.rays())
    points = origins + np.linspace(1, 4, len(origins))[:, None] * directions
    intrinsics, extrinsics = np.array(told["intrinsics"]), np.array(told["world_to_camera"])
    seen = (np.c_[points, np.ones(len(points))] @ extrinsics.T) @ intrinsics.T
    rows, columns = np.divmod(np.arange(24), 6)
    wanted = np.stack([columns + 0.5, rows + 0.5], axis=1)
    # 2e-15 measured.
    np.testing.assert_allclose(seen[:, :2] / seen[:, 2:], wanted, rtol=0, atol=1e-14)


def test_cameras_around():
    mesh = sources.vase(12, 12, 4)
    cameras = views.around(mesh, 3, (0.0, 60.0), fov_y=20.0, width=8, height=8, margin=0.05)
    points = np.c_[np.asarray(mesh.vertices), np.ones(len(mesh.vertices))]
    for camera in cameras:
        told = views.told(camera)
        x, y, z = np.array(told["intrinsics"]) @ np.array(told["world_to_camera"]) @ points.T
        assert 0 < min(x / z) < max(x / z) < 8
        assert 0 < min(y / z) < max(y / z) < 8
    centers = [np.asarray(camera.position) - np.asarray(camera.target) for camera in cameras]
    lengths = np.linalg.norm(centers, axis=1)
    np.testing.assert_allclose(lengths, lengths[0], rtol=1e-6, atol=0)
    assert centers[0][1] == pytest.approx(-lengths[0], rel=1e-6)


def take(folder, about):
    with writing.claimed(folder, about):
        pass


def test_folders(tmp_path):
    folder = tmp_path / "new"
    about = {"settings": {"views": 2, "mesh": "a.glb"}, "digests": {"mesh": "a"}}
    folder.mkdir()
    (folder / "dataset.json.7.part").touch()  # of a run that was killed at its start
    take(folder, about)
    (folder / "images").mkdir()
    part = folder / "images" / "0000.7.part.png"
    part.touch()
    take(folder, about)
    assert not part.exists()
    before = (folder / writing.ABOUT).read_bytes()
    with pytest.raises(UserError, match=r"other settings \(what mesh holds\): choose --folder"):
        take(folder, about | {"digests": {"mesh": "b"}})
    with pytest.raises(UserError, match=r"other settings \(views\): choose --folder"):
        take(folder, about | {"settings": {"views": 3, "mesh": "a.glb"}})
    assert (folder / writing.ABOUT).read_bytes() == before
    (tmp_path / "file").touch()
    with pytest.raises(UserError, match="holds no dataset"):
        take(tmp_path, about)
    with pytest.raises(UserError, match="is a file: choose another --folder"):
        take(tmp_path / "file", about)


def test_one_run_at_a_time_in_a_folder(tmp_path):
    pytest.importorskip("fcntl")
    about = {"settings": {"views": 2}}
    with writing.claimed(tmp_path / "new", about):
        part = tmp_path / "new" / "0000.7.part.png"
        part.touch()  # of the run that goes on
        with pytest.raises(UserError, match=r"another run is making .*new': wait for it"):
            take(tmp_path / "new", about)
        assert part.exists()
    take(tmp_path / "new", about)
    assert not part.exists()


def test_runs_that_start_together_do_not_share_a_folder(tmp_path):
    """Of eight that wait for each other one has it, in each of 20 folders."""
    pytest.importorskip("fcntl")
    about, runs = {"settings": {"views": 2}}, 8
    start, tried = (threading.Barrier(runs, timeout=20) for _ in range(2))

    def run(folder) -> bool:
        start.wait()
        try:
            with writing.claimed(folder, about):
                tried.wait()
                return True
        except UserError:
            tried.wait()
            return False

    with ThreadPoolExecutor(runs) as pool:
        for folder in (tmp_path / str(count) for count in range(20)):
            assert sum(pool.map(run, [folder] * runs)) == 1
            take(folder, about)


def test_a_file_system_without_locks_is_no_other_run(tmp_path, monkeypatch):
    fcntl = pytest.importorskip("fcntl")
    asked = []

    def refuse(file, _):
        asked.append(file.name)
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refuse)
    take(tmp_path, {"settings": {"views": 2}})
    assert asked == [str(tmp_path / writing.ABOUT)]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [({"elevations": (np.nan,)}, "elevations must be"), ({"degree": 7}, "at most 6 with suns")],
)
def test_settings_are_refused_before_a_bake(wrong, said):
    with pytest.raises(ValueError, match=said):
        dataset.Dataset(**wrong)
    assert dataset.Dataset(degree=7, suns=0).degree == 7


def test_a_picture_that_fails_is_told_and_leaves_nothing(tmp_path):
    def write() -> None:
        with writing.writer(1) as writer:
            writer.write(tmp_path / "good.png", np.zeros((2, 2)))
            writer.write(tmp_path / "bad.png", np.full((2, 2), np.nan))

    with pytest.raises(ValueError, match="NaN"):
        write()
    assert [path.name for path in tmp_path.iterdir()] == ["good.png"]


def test_pifu_directions_and_basis():
    for cells in (False, True):
        vectors = pifu_bake.directions(20, 3, stratified=cells)
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1, rtol=0, atol=1e-12)
    # In cells every strip of 1/20 of the height holds as many.
    assert set(np.bincount(((1 - vectors[:, 2]) * 10).astype(int))) == {20}
    ours = harmonics.evaluate(jnp.asarray(vectors[:8]), 2)
    np.testing.assert_allclose(pifu_bake.basis(vectors[:8]), ours, rtol=0, atol=1e-12)


@pytest.mark.slow
def test_pictures_follow_from_what_the_files_say(tmp_path):
    """Color by color: transfer and light from the files, in NumPy, at what a ray meets."""
    folder = tmp_path / "set"
    _, rows = run(tmp_path, "dataset", *_SMALL, "--folder", str(folder))
    assert (rows[0]["pictures"], rows[0]["made"]) == (4, 4)
    mesh, light = geometry.knot(), json.loads((folder / "lights.json").read_text())[0]
    about = json.loads((folder / "cameras.json").read_text())[1]
    coefficients = np.asarray(transfer.open(folder / "transfer").load().coefficients)
    radiance = np.maximum(coefficients @ np.array(light["coefficients"]).T / np.pi, 0)

    turn, shift = np.split(np.array(about["world_to_camera"]), [3], axis=1)
    x, y = np.meshgrid(np.arange(24) + 0.5, np.arange(24) + 0.5)
    pixels = np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3)
    towards = pixels @ np.linalg.inv(about["intrinsics"]).T @ turn
    hit = geometry.ray_scene(mesh).closest_hit((-turn.T @ shift)[:, 0], towards)
    seen = hit.face >= 0
    corners = np.asarray(mesh.faces)[hit.face[seen]]
    weights = hit.barycentric[seen][..., None]
    shown = (radiance[corners] * weights).sum(axis=1) * light["exposure"]
    low = 12.92 * shown
    signal = np.where(shown <= 0.0031308, low, 1.055 * np.maximum(shown, 1e-9) ** (1 / 2.4) - 0.055)
    wanted = np.zeros((576, 3))
    wanted[seen] = 255 * np.clip(signal, 0, 1)

    def stored(name: str) -> np.ndarray:
        return np.asarray(Image.open(folder / name)).reshape(576, -1)

    def exact(path: Path) -> np.ndarray:
        source = oiio.ImageInput.open(str(path))
        return source.read_image("float").reshape(576, -1)

    np.testing.assert_allclose(stored("images/0001/0000.png"), wanted, rtol=0, atol=0.51)
    np.testing.assert_array_equal(stored("views/0001/mask.png")[:, 0], 255 * seen)
    depth, normal = (exact(folder / f"views/0001/{name}.exr") for name in ("depth", "normal"))
    np.testing.assert_array_equal(depth[~seen], 0)
    along = hit.distance[seen] / np.linalg.norm(towards[seen], axis=1)
    # 3e-7 measured.
    np.testing.assert_allclose(depth[seen, 0], along, rtol=6e-7, atol=0)
    smooth = (np.asarray(mesh.normals)[corners] * weights).sum(axis=1)
    smooth /= np.linalg.norm(smooth, axis=1, keepdims=True)
    np.testing.assert_allclose(normal[seen], smooth, rtol=0, atol=3e-4)  # of 16 bits


@pytest.mark.slow
def test_a_run_that_was_killed_goes_on(tmp_path, monkeypatch):
    """Bit by bit as one that was not, and with less memory."""
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    run(tmp_path, "dataset", *_SMALL, "--folder", str(whole))
    command = [sys.executable, "-m", "experiments", "run", "dataset", *_SMALL, "--no-progress"]
    command += ["--folder", str(cut), "--out", str(tmp_path / "out")]
    environment = {name: value for name, value in os.environ.items() if name != "JAXSH_DATA"}
    with subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL) as process:
        try:
            until = time.monotonic() + 120
            while not list(cut.glob("images/*/*.png")) and process.poll() is None:
                assert time.monotonic() < until
                time.sleep(0.005)
        finally:
            process.send_signal(signal.SIGKILL)
    before = set(cut.glob("images/*/*.png"))
    assert before
    monkeypatch.setattr(dataset, "_HELD", 1)  # one light at a time
    _, rows = run(tmp_path, "dataset", *_SMALL, "--folder", str(cut))
    assert rows[0]["made"] == 4 - len(before)
    assert _digests(cut) == _digests(whole)


def _digests(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.mark.slow
def test_pifu_beside_ours(tmp_path):
    options = ["--side", "12", "--chosen", "100", "--reference", "1024", "--draws", "1"]
    _, rows = run(tmp_path, "dataset.pifu", *options, small=True)
    theirs, cells, *ours = rows
    assert cells["error"] < theirs["error"]
    assert [row["directions"] for row in ours] == [16, 64]
    assert ours[1]["error"] < ours[0]["error"] < theirs["error"]
    assert all(row["cpu"] > 0 and row["wall"] > 0 for row in (theirs, *ours))
