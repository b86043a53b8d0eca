"""Bakes that are stopped go on where they were, and end the same."""

import bodies
import numpy as np
import pytest

from jaxsh.geometry import knot, ray_scene
from jaxsh.transfer import bake
from jaxsh.transfer._bake import _passes

MESH = knot(700)


class Stopping:
    """A ray scene that counts questions, and is interrupted at one of them."""

    def __init__(self, after=10**9):
        self._scene, self.asked, self._after = ray_scene(MESH), 0, after

    def occluded(self, origins, directions, max_distance=np.inf):
        self._count()
        return self._scene.occluded(origins, directions, max_distance)

    def closest_hit(self, origins, directions):
        self._count()
        return self._scene.closest_hit(origins, directions)

    def _count(self):
        self.asked += 1
        if self.asked > self._after:
            raise KeyboardInterrupt


def run(scene, path=None, mesh=MESH, **options):
    options = {"directions": 128, "bounces": 1, "chunk": 64, "progress": False} | options
    return np.asarray(bake(mesh, 2, scene=scene, checkpoint=path, **options).coefficients)


@pytest.fixture(scope="module")
def whole():
    scene = Stopping()
    return run(scene), scene.asked


@pytest.mark.parametrize("share", [0.05, 0.3, 0.8, 0.97])
def test_a_stopped_bake_goes_on_and_ends_the_same(tmp_path, monkeypatch, whole, share):
    monkeypatch.setattr(_passes, "cores", lambda: 1)
    expected, questions = whole
    path = tmp_path / "folder" / "bake.part"
    first = Stopping(after=int(share * questions))
    with pytest.raises(KeyboardInterrupt):
        run(first, path)
    second = Stopping()
    np.testing.assert_array_equal(run(second, path, chunk=128), expected)
    # Two questions to a block of shadows; larger blocks need fewer.
    assert second.asked < questions - int(share * questions) + 4
    assert not path.exists()


@pytest.mark.parametrize("after", [18, 30])  # questions: in the first pass, and in the second
@pytest.mark.parametrize("damage", ["cut", "flip", "flip the first pass"])
def test_what_is_damaged_is_computed_again(tmp_path, whole, damage, after):
    path = tmp_path / "bake.part"
    with pytest.raises(KeyboardInterrupt):
        run(Stopping(after=after), path)
    data = bytearray(path.read_bytes())
    if damage == "cut":
        del data[-100:]
    elif damage == "flip":
        data[-100] ^= 1
    else:
        data[data.index(b"\n") + 5000] ^= 1
    path.write_bytes(data)
    np.testing.assert_array_equal(run(Stopping(), path), whole[0])


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"seed": 1}, "seed is 0, and 1 here"),
        ({"directions": 64}, "directions is 128, and 64 here"),
        ({"albedo": 0.3}, "albedo is"),
        ({"bounces": 2}, "bounces is 1, and 2 here"),
        ({"ray_bias": 1e-3}, "ray_bias is"),
        ({"mesh": knot(800)}, "mesh is"),
    ],
)
def test_the_checkpoint_of_another_bake_is_refused_and_kept(tmp_path, options, name):
    path = tmp_path / "bake.part"
    with pytest.raises(KeyboardInterrupt):
        run(Stopping(after=8), path)
    before = path.read_bytes()
    with pytest.raises(
        ValueError, match=rf"bake\.part: the checkpoint of another bake: its {name}"
    ):
        run(Stopping(), path, **options)
    assert path.read_bytes() == before


@pytest.mark.parametrize("content", [b"", b"hello\n", b"[]\n", b'{"format": 1}\n', b"\xff" * 999])
def test_another_file_is_refused_and_kept(tmp_path, content):
    path = tmp_path / "thesis.txt"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"thesis\.txt: not the checkpoint of a bake"):
        run(Stopping(), path)
    assert path.read_bytes() == content


def test_a_checkpoint_changes_nothing(tmp_path):
    mesh = bodies.cube()
    with_one = bake(mesh, 2, checkpoint=tmp_path / "a", directions=64, progress=False)
    without = bake(mesh, 2, directions=64, progress=False)
    np.testing.assert_array_equal(with_one.coefficients, without.coefficients)
