"""README.md says what its sources say; no experiment is run for that."""

import json
import re
import shutil

import numpy as np
import pytest

from experiments.runner import UserError, readme
from experiments.runner.registry import entries
from experiments.runner.sources import ROOT

TEXT = (ROOT / "README.md").read_text("utf-8")


def test_figures_tables_and_pictures_are_those_of_their_sources():
    """Where this fails, `make readme` fills README.md again; summary.json names the pictures."""
    assert readme.unlike(TEXT) == []


def test_every_experiment_is_in_a_command_and_every_command_is_there():
    commands = re.findall(r"experiments run ([\w. ]+?)(?= --preset|`|\n)", TEXT)
    named = {name for command in commands for name in command.split()}
    assert named <= set(entries())
    # No table or figure of a paper: numbers that are inputs of the package, what devices do, and
    # what is made of the user's surfaces.
    folders = {"devices", "dataset", "surfaces"}
    others = {name for name, entry in entries().items() if entry.path.parent.name in folders}
    assert set(entries()) - named <= others | {"inverse.prior"}


def measured(name):
    return json.loads((ROOT / "benchmarks" / "measured" / f"{name}.json").read_text("utf-8"))


def test_bounds_that_README_states():
    rows = measured("rows")
    assert "float32 error under 2e-4 at degree 30" in " ".join(TEXT.split())
    assert [row["ours"] < 2e-4 for row in rows["errors"] if row["degree"] == 30] == [True]
    assert "closed form of sun and turbidity in 24 kB" in " ".join(TEXT.split())
    with np.load(ROOT / "jaxsh" / "sky" / "preetham.npz") as stored:
        assert round(stored["small"].nbytes / 1000) == 24


def test_where_README_says_that_sphericart_is_faster():
    version = measured("environment")["versions"]["sphericart-jax"]
    assert f"sphericart {version} (C++ kernels)" in TEXT
    basis = measured("rows")["basis"]

    def theirs(**wanted):
        """Where sphericart is faster."""
        of = [row for row in basis if wanted.items() <= row.items()]
        return [row["sphericart"] < 1 for row in of if row.get("sphericart")]

    table = {"dtype": "float32", "count": 10_000, "quantity": "values"}

    def ratios(cores, degrees, *keys):
        of = [row for row in basis if table.items() <= row.items() and row["cores"] == cores]
        return np.array([row[key] for row in of if row["degree"] in degrees for key in keys])

    assert "as fast at degrees 2 and 3, and ours is faster from 4 on" in TEXT
    even = ratios("one", {2, 3}, "sphericart", "last")
    assert 0.85 < even.min() < even.max() < 1.25
    assert ratios("one", {4, 6, 10, 13}, "sphericart", "last").min() > 1
    assert "in most of float64 on two cores it is the faster" in " ".join(TEXT.split())
    assert np.mean(theirs(dtype="float64", cores="all")) > 0.5


def test_what_differs_is_told():
    line = next(line for line in TEXT.splitlines() if line.startswith("| values, one core |"))
    [said] = readme.unlike(TEXT.replace(line, f"{line[:-6]}9.94 |"))
    assert "9.94" in said
    assert line in said
    said = readme.unlike(TEXT + "\n![Another](docs/images/layouts_cubes.png)\n")
    assert "does not say which command draws docs/images/layouts_cubes.png" in said[-1]


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A root with a README.md of one number and one picture, and results for both."""
    (tmp_path / "experiments").mkdir()
    (tmp_path / "experiments" / "summary.md").write_text(
        "About.\n\n## speed\n\nSo: {toy | degree>=2 | max sum | .0e} on {about toy}.\n"
    )
    picture = {"from": "toy/quick/dot.png", "command": "python -m experiments run toy"}
    summary = {"figures": {}, "pictures": {"dot.png": picture}}
    (tmp_path / "experiments" / "summary.json").write_text(json.dumps(summary))
    (tmp_path / "README.md").write_text(
        "# A\n![Dot](dot.png)\n<!-- block speed -->\n<!-- end -->\n"
    )
    folder = tmp_path / "results" / "toy" / "quick"
    folder.mkdir(parents=True)
    (folder / "dot.png").write_bytes(b"png")
    (folder / "metrics.json").write_text('[{"degree": 2, "sum": 3e-05}, {"degree": 1, "sum": 9}]')
    environment = {
        "command": "python -m experiments run toy --out elsewhere --data mine",
        "date": "2026-11-30T12:00:00+00:00",
        "cpu": {"model": "EPYC", "count": 2},
        "versions": {"jax": "0.10", "embreex": None},
    }
    (folder / "environment.json").write_text(json.dumps(environment))
    monkeypatch.setattr(readme, "ROOT", tmp_path)
    monkeypatch.setattr(readme, "_HERE", tmp_path / "experiments")
    return tmp_path


def test_numbers_and_pictures_are_taken_up_and_stay(checkout):
    results = checkout / "results"
    readme.renew(results, "quick")
    text = (checkout / "README.md").read_text()
    assert "\nSo: 3e-5 on two cores of an EPYC, JAX 0.10, 2026-11-30.\n<!-- end -->" in text
    assert (checkout / "dot.png").read_bytes() == b"png"
    taken = json.loads((checkout / "experiments" / "summary.json").read_text())
    assert taken["figures"]["toy"]["command"] == "python -m experiments run toy"
    assert taken["figures"]["toy"]["versions"] == {"jax": "0.10"}
    assert readme.unlike(text) == []
    shutil.rmtree(results)
    readme.renew(results, "quick")  # nothing at hand: all stays
    assert (checkout / "README.md").read_text() == text
    (checkout / "dot.png").write_bytes(b"another")
    assert readme.unlike(text) == ["dot.png has changed since `make readme`"]


def test_what_has_no_source_is_refused(checkout):
    with pytest.raises(UserError, match=r"README\.md: no results of toy in"):
        readme.renew(checkout / "nowhere", "quick")
    (checkout / "README.md").write_text("<!-- block sped -->\n<!-- end -->\n")
    with pytest.raises(UserError, match="has no block 'sped'"):
        readme.renew(checkout / "results", "quick")
