"""Bakes that are stopped go on where they were, and end the same."""

import bodies
import jax
import numpy as np
import pytest
import zarr
from stopping import MESH, Scene

from jaxsh.geometry import knot
from jaxsh.transfer import bake
from jaxsh.transfer._bake import _passes
from jaxsh.transfer._bake._kept import BakeStore


def run(scene, path=None, mesh=MESH, **options):
    options = {"directions": 128, "bounces": 1, "chunk": 64, "progress": False} | options
    return np.asarray(bake(mesh, 2, scene=scene, store=path, **options).coefficients)


@pytest.fixture(scope="module")
def whole():
    scene = Scene()
    return run(scene), scene.asked


@pytest.mark.parametrize(
    "share", [0.3, 0.8, *(pytest.param(s, marks=pytest.mark.slow) for s in (0.05, 0.97))]
)
def test_a_stopped_bake_goes_on_and_ends_the_same(tmp_path, monkeypatch, whole, share):
    monkeypatch.setattr(_passes, "cores", lambda: 1)
    expected, questions = whole
    path = tmp_path / "folder" / "knot"
    first = Scene(after=int(share * questions))
    with pytest.raises(KeyboardInterrupt):
        run(first, path)
    second = Scene()
    np.testing.assert_array_equal(run(second, path, chunk=128), expected)
    # Two questions to a block of shadows; larger blocks need fewer.
    assert second.asked < questions - int(share * questions) + 4
    assert not (path / "passes").exists()
    np.testing.assert_array_equal(zarr.open(path, mode="r")["coefficients"][:], expected)


@pytest.mark.parametrize(
    ("name", "damage", "after"),  # questions: in the first pass, and in the second
    [
        ("passes/0", "cut", 18),
        ("passes/0", "flip", 30),
        ("neighbors", "remove", 18),
        pytest.param("passes/0", "flip the sum", 30, marks=pytest.mark.slow),
        pytest.param("origins", "empty", 30, marks=pytest.mark.slow),
    ],
)
def test_what_is_damaged_is_computed_again(tmp_path, monkeypatch, whole, name, damage, after):
    monkeypatch.setattr(_passes, "cores", lambda: 1)  # so that block 1 is done before the others
    path = tmp_path / "knot"
    with pytest.raises(KeyboardInterrupt):
        run(Scene(after=after), path)
    file = path / name / "c" / "1" / "0"
    hurt(file, damage)
    np.testing.assert_array_equal(run(Scene(), path), whole[0])
    assert not BakeStore(path).missing("neighbors", check=True)
    assert not BakeStore(path).missing("origins", check=True)


def test_blocks_damaged_in_the_end_are_baked_again(tmp_path, whole):
    path = tmp_path / "knot"
    run(Scene(), path)
    for block in ("3", "10"):  # the last is not full
        hurt(path / "coefficients" / "c" / block / "0", "flip")
    assert BakeStore(path).missing(check=True) == [3, 10]
    np.testing.assert_array_equal(run(Scene(), path), whole[0])
    assert BakeStore(path).missing(check=True) == []
    (path / "passes" / "0").mkdir(parents=True)  # as where the last step was stopped
    asked = Scene()
    np.testing.assert_array_equal(run(asked, path), whole[0])
    assert asked.asked <= 2  # where rays start, and whether the mesh is the first
    assert not (path / "passes").exists()


def hurt(file, how):
    data = bytearray(file.read_bytes())
    if how == "cut":
        del data[-10:]
    elif how == "flip":
        data[500] ^= 1
    elif how == "flip the sum":
        data[-1] ^= 1
    elif how == "empty":
        del data[:]
    else:
        file.unlink()
        return
    file.write_bytes(data)


@pytest.fixture(scope="module")
def stopped(tmp_path_factory):
    path = tmp_path_factory.mktemp("store") / "knot"
    with pytest.raises(KeyboardInterrupt):
        run(Scene(after=8), path)
    return path


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"seed": 1}, "seed is 0, and 1 here"),
        ({"directions": 64}, "directions is 128, and 64 here"),
        ({"albedo": 0.3}, "albedo is 0.5, and 0.3 here"),
        ({"bounces": 2}, "bounces is 1, and 2 here"),
        ({"ray_bias": 1e-3}, "ray_bias is"),
        ({"shadows": False, "bounces": 0}, "shadows is True, and False here"),
        ({"mesh": knot(800)}, "mesh is"),
    ],
)
def test_the_store_of_another_bake_is_refused_and_kept(stopped, options, name):
    path = stopped
    before = content_of(path)
    with pytest.raises(ValueError, match=rf"knot: the store of another bake: its {name}"):
        run(Scene(), path, **options)
    assert content_of(path) == before


def content_of(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("content", [b"", b"hello\n", b"[]\n", b'{"format": 1}\n', b"\xff" * 999])
def test_another_file_is_refused_and_kept(tmp_path, content):
    path = tmp_path / "thesis.txt"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"thesis\.txt: not a transfer store"):
        run(Scene(), path)
    assert path.read_bytes() == content


@pytest.mark.parametrize(
    "content", [b"", b"[]", b"{}", b'{"zarr_format": 3, "node_type": "group"}']
)
def test_another_folder_is_refused_and_kept(tmp_path, content):
    (tmp_path / "zarr.json").write_bytes(content)
    with pytest.raises(ValueError, match="not a transfer store"):
        run(Scene(), tmp_path)
    assert content_of(tmp_path) == {tmp_path / "zarr.json": content}


def test_an_empty_folder_is_filled(tmp_path, whole):
    np.testing.assert_array_equal(run(Scene(), tmp_path), whole[0])
    assert not [path for path in tmp_path.parent.iterdir() if path.name.endswith(".partial")]


def test_a_bake_goes_on_in_single_precision(tmp_path, whole):
    path = tmp_path / "knot"
    with pytest.raises(KeyboardInterrupt):
        run(Scene(after=18), path)
    with jax.enable_x64(False):
        got = run(Scene(), path)
    np.testing.assert_array_equal(got, whole[0])


def test_an_albedo_of_another_dtype_is_the_same(tmp_path, whole):
    path = tmp_path / "knot"
    np.testing.assert_array_equal(run(Scene(), path, albedo=np.float32(0.5)), whole[0])
    scene = Scene()
    np.testing.assert_array_equal(run(scene, path), whole[0])
    assert scene.asked <= 2  # where rays start, and whether the mesh is the first


def test_a_store_changes_nothing(tmp_path):
    mesh = bodies.cube()
    for options in ({}, {"shadows": False}):
        options = {"directions": 64, "progress": False} | options
        with_one = bake(mesh, 2, store=tmp_path / str(len(options)), **options)
        without = bake(mesh, 2, **options)
        np.testing.assert_array_equal(with_one.coefficients, without.coefficients)
