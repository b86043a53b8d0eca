"""The experiments on near lights recovered from shading, end to end and small."""

import json

import pytest

from experiments.runner.cli import main


@pytest.fixture
def run(tmp_path, monkeypatch):
    """An experiment's folder and rows, without a data folder."""
    monkeypatch.delenv("JAXSH_DATA", raising=False)

    def run(name, *options):
        words = ["run", name, "--out", str(tmp_path), "--no-progress", *options]
        assert main(words) == 0
        folder = tmp_path / name / "quick"
        return folder, json.loads((folder / "metrics.json").read_text())

    return run


@pytest.mark.slow
def test_emitters_are_recovered(run):
    folder, (clean, noisy) = run("inverse.emitters", "--candidates", "8", "--height", "48")
    assert clean["converged"]
    assert noisy["converged"]
    for key in ("center", "size", "radiance"):
        assert max(clean[f"{key}_error"]) < 1e-5
        (error,), (expected,) = noisy[f"{key}_error"], noisy[f"{key}_deviation"]
        assert 0 < error < 4 * expected < 0.2
    assert (folder / "recovered.png").stat().st_size > 10_000


def test_bounds_keep_the_light_that_is_off_from_going_negative(run):
    _, rows = run("inverse.colors", "--repeats", "4", "--noise", "0.05")
    ours, free = (
        [row for row in rows if row["method"] == name] for name in ("ours (JAXopt)", "no bounds")
    )
    assert len(ours) == len(free) == 4
    assert min(row["least"] for row in free) < 0
    for bounded, unbounded in zip(ours, free, strict=True):
        assert bounded["least"] >= 0
        assert bounded["gap"] < 1e-8  # from SciPy's nnls
        assert bounded["off"] <= unbounded["off"]
