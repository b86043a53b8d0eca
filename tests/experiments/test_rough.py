"""The experiment `rough` end to end, small."""

import pytest
from pictures import assert_picture
from runs import run


@pytest.mark.slow
def test_rough(tmp_path):
    options = "--degrees 4 --roughness 0.5 --specular 1 --angles 0 60 --directions 64 --rays 6"
    folder, rows = run(tmp_path, "rough", *options.split(), "--size", "48", small=True)
    upright, aslant, mesh = rows
    assert upright["error"] < 2 < 30 < upright["phong_error"]
    assert aslant["error"] < 15 < 35 < aslant["phong_error"]
    assert max(upright["uniform"], aslant["uniform"]) < 0.3
    assert mesh["ggx"] < 0.5 * mesh["phong"]
    assert_picture(folder / "mesh.png")
