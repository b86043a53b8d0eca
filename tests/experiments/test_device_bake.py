"""Bakes on the device beside those on the host, as the experiment tells them apart."""

import pytest
from runs import run


@pytest.mark.slow
def test_the_bakes_differ_by_less_than_a_tenth_of_their_error(tmp_path):
    options = ["--meshes", "knot", "--vertices", "300", "--directions", "32", "--rounds", "1"]
    _, rows = run(tmp_path, "devices.bake", *options, small=True)
    assert [row["bounces"] for row in rows] == [0, 1]
    assert max(row["difference_to_sampling"] for row in rows) < 1e-6  # 1e-8 measured
    assert 0 < rows[0]["rays"] < rows[1]["rays"]
