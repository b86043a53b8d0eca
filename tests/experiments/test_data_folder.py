"""Data by name: a folder's, or the embedded default."""

import numpy as np
import pytest

from experiments.runner import Data, UserError

TETRAHEDRON = """\
ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
0 0 1
3 0 2 1
3 0 1 3
3 0 3 2
3 1 2 3
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "tetrahedron.ply").write_text(TETRAHEDRON)
    (tmp_path / "meshes" / "broken.ply").write_text("no mesh")
    return tmp_path


def test_embedded(monkeypatch):
    monkeypatch.setenv("JAXSH_DATA", "")
    data = Data.find(None)
    assert (data.meshes(), data.environments()) == (["knot"], ["studio"])
    assert data.mesh("knot").vertices.shape[1] == 3
    image = np.asarray(data.environment("studio"))
    assert image.shape[2] == 3
    assert image.min() >= 0


def test_folder(folder):
    data = Data(folder)
    assert data.meshes() == ["broken", "tetrahedron"]
    assert data.environments() == []
    assert data.mesh("tetrahedron").vertices.shape == (4, 3)


def test_names_are_refused_with_the_nearest(folder):
    with pytest.raises(UserError, match="unknown mesh 'tetrahedra'; did you mean 'tetrahedron'"):
        Data(folder).mesh("tetrahedra")
    with pytest.raises(UserError, match="unknown environment 'grace'; known: none"):
        Data(folder).environment("grace")
    with pytest.raises(UserError, match="the embedded data: unknown mesh 'armadillo'; known: knot"):
        Data().mesh("armadillo")


def test_a_broken_file_is_the_users_to_mend(folder):
    with pytest.raises(UserError, match=r"broken\.ply") as error:
        Data(folder).mesh("broken")
    assert "\n" not in str(error.value)


def test_folders_that_hold_no_data(tmp_path):
    with pytest.raises(UserError, match="there is no data folder"):
        Data(tmp_path / "nowhere")
    with pytest.raises(UserError, match=r"neither meshes/\*\.ply nor envmaps/\*\.exr"):
        Data(tmp_path)


def test_option_before_variable(folder, monkeypatch):
    monkeypatch.setenv("JAXSH_DATA", str(folder / "nowhere"))
    assert Data.find(folder).folder == folder
    with pytest.raises(UserError, match="nowhere"):
        Data.find(None)
