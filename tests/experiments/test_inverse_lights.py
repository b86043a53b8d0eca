"""The experiments on near lights recovered from shading, end to end and small."""

import pytest
from pictures import assert_picture
from runs import run


@pytest.mark.slow
def test_emitters_are_recovered(tmp_path):
    options = ["--candidates", "8", "--height", "48"]
    folder, (clean, noisy) = run(tmp_path, "inverse.emitters", *options)
    assert clean["converged"]
    assert noisy["converged"]
    for key in ("center", "size", "radiance"):
        assert max(clean[f"{key}_error"]) < 1e-5
        (error,), (expected,) = noisy[f"{key}_error"], noisy[f"{key}_deviation"]
        assert 0 < error < 4 * expected < 0.2
    assert_picture(folder / "recovered.png")


@pytest.mark.slow
def test_bounds_keep_the_light_that_is_off_from_going_negative(tmp_path):
    _, rows = run(tmp_path, "inverse.colors", "--repeats", "4", "--noise", "0.05", small=True)
    ours, free = (
        [row for row in rows if row["method"] == name] for name in ("ours (JAXopt)", "no bounds")
    )
    assert len(ours) == len(free) == 4
    assert min(row["least"] for row in free) < 0
    for bounded, unbounded in zip(ours, free, strict=True):
        assert bounded["least"] >= 0
        assert bounded["gap"] < 1e-8  # from SciPy's nnls
        assert bounded["off"] <= unbounded["off"]
