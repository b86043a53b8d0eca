"""The experiment on daylight recovered from one picture, end to end and small."""

import pytest
from pictures import assert_picture
from runs import run


@pytest.mark.slow
def test_known_shadows_find_the_sun(tmp_path):
    options = ["--skies", "preetham", "--settings", "1", "--height", "24", "--directions", "512"]
    folder, (ignored, traced) = run(tmp_path, "inverse.daylight", *options)
    assert ignored["converged"]
    assert traced["converged"]
    assert traced["sun_error"] < 0.5 < 1.5 < ignored["sun_error"]
    assert traced["turbidity_error"] < 0.1
    assert traced["ground_error"] < 0.01
    assert 0.005 < traced["residual"] < 0.03 < ignored["residual"]
    assert_picture(folder / "recovered.png")
