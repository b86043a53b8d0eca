"""What a run leaves behind, however it ends."""

import csv
import io
import json
import shlex

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.runner import Column, Context, Data, Table, UserError
from experiments.runner.findings import fill
from experiments.runner.registry import entries
from experiments.runner.report import plain, to_csv, to_json, to_markdown, write


def test_a_run_leaves_everything(toys):
    code, stdout, _ = toys.run("toy", "--seed", "7")
    assert code == 0
    assert stdout.strip() == str(toys.out / "toy/quick/table.md")
    assert sorted(path.name for path in (toys.out / "toy/quick").iterdir()) == [
        *("config.toml", "dot.png", "environment.json", "metrics.csv", "metrics.json", "table.md"),
    ]
    assert not (toys.out / "toy/quick.partial").exists()

    metrics = toys.read("toy/quick/metrics.json")
    assert metrics == [
        {"degree": 1, "sum": 6.0, "dtype": "float64"},
        {"degree": 2, "sum": 12.0, "dtype": "float64", "sum_paper": 12.5},
    ]
    rows = list(csv.DictReader(io.StringIO(toys.read("toy/quick/metrics.csv"))))
    assert [row["sum_paper"] for row in rows] == ["", "12.5"]

    table = toys.read("toy/quick/table.md")
    assert "# toy · quick\n\nA sum of powers\n\nReproduces: Nobody 1900, table 1\n" in table
    assert "| degree | sum: paper | sum: ours | sum: difference |" in table
    assert "| 1 | – | 6.00 | – |\n| 2 | 12.50 | 12.00 | -0.50 |" in table
    assert "![A dot](dot.png)" in table
    assert f"JAX {jax.__version__}" in table
    command = f"python -m experiments run toy --preset quick --seed 7 --out {toys.out}"
    assert f"```\n{command}\n```" in table

    environment = toys.read("toy/quick/environment.json")
    assert environment["status"] == "complete"
    assert environment["command"] == command
    assert environment["seed"] == 7
    assert environment["versions"]["jax"] == jax.__version__
    assert environment["device"]["platform"] == "cpu"
    assert environment["cpu"]["count"] >= 1
    seconds = environment["seconds"]
    assert 0 < seconds["compile"] < seconds["total"]
    assert seconds["run"] == pytest.approx(seconds["total"] - seconds["compile"])
    assert set(environment["times"]) == {"power 1", "power 2", "sum"}
    assert environment["times"]["power 1"]["repeats"] == 5
    assert environment["times"]["power 1"]["compile_seconds"] > 0


def test_the_command_runs_it_again(toys):
    toys.run("toy", "--preset", "paper", "--degrees", "2", "--mood", "in a hurry")
    command = toys.read("toy/paper/environment.json")["command"]
    before = toys.read("toy/paper/config.toml")
    code, *_ = toys(*shlex.split(command)[3:])
    assert code == 0
    assert toys.read("toy/paper/config.toml") == before


def test_x64_is_the_experiments_and_afterwards_as_before(toys):
    toys.run("toy", "toy.second")
    assert toys.read("toy/quick/environment.json")["dtype"] == "float64"
    assert toys.read("toy.second/quick/environment.json")["x64"] is False
    assert jnp.zeros(1).dtype == jnp.float64  # the session's own choice


def test_the_seed_decides_the_draw(toys):
    draws = []
    for seed in "0", "1", "0":
        toys.run("toy.second", "--seed", seed)
        draws.append(toys.read("toy.second/quick/metrics.json")[0]["draw"])
    assert draws[0] == draws[2] != draws[1]


@pytest.mark.parametrize("mood", ["angry", "hasty"])
def test_a_run_that_ends_early_keeps_its_rows_and_the_last_results(toys, mood):
    toys.run("toy")
    old = toys.read("toy/quick/table.md")
    code, _, stderr = toys.run("toy", "--degrees", "1", "2", "4", "--mood", mood)
    assert code == {"angry": 1, "hasty": 130}[mood]
    assert "rows kept: 2, in" in stderr
    assert toys.read("toy/quick/table.md") == old
    assert [row["degree"] for row in toys.read("toy/quick.partial/metrics.json")] == [1, 2]
    environment = toys.read("toy/quick.partial/environment.json")
    assert environment["status"] == {"angry": "failed", "hasty": "interrupted"}[mood]
    assert environment["seconds"]["total"] > 0
    assert toys.run("toy")[0] == 0
    assert not (toys.out / "toy/quick.partial").exists()


def test_a_folder_that_no_run_has_written_is_left_alone(toys):
    theirs = toys.out / "toy" / "quick" / "thesis.tex"
    theirs.parent.mkdir(parents=True)
    theirs.write_text("years of work")
    code, _, stderr = toys.run("toy")
    assert code == 2
    assert "holds no results of a run" in stderr
    assert theirs.read_text() == "years of work"


def test_out_that_cannot_be_written(toys):
    toys.out.write_text("a file")
    code, _, stderr = toys.run("toy")
    assert code == 2
    assert "error: cannot write to" in stderr


def test_write_replaces_all_or_nothing(tmp_path, monkeypatch):
    path = tmp_path / "metrics.json"
    write(path, "old")
    with pytest.raises(UnicodeEncodeError):
        write(path, "new \ud800")
    assert path.read_text() == "old"
    write(path, "new")
    assert [one.name for one in tmp_path.iterdir() if one.suffix == ".json"] == ["metrics.json"]
    assert path.read_text() == "new"


def test_numbers_that_are_not_finite_stay_valid_json():
    row = plain({"a": np.float32(np.nan), "b": jnp.inf, "c": [-np.inf, 1.0], "d": jnp.arange(2)})

    def refuse(constant):
        raise AssertionError(constant)

    text = to_json([row])
    [read] = json.loads(text, parse_constant=refuse)
    assert read == {"a": "NaN", "b": "Infinity", "c": ["-Infinity", 1.0], "d": [0, 1]}
    assert np.isnan(float(read["a"]))
    assert to_csv([row]).splitlines() == ["a,b,c,d", 'NaN,Infinity,"[\'-Infinity\', 1.0]","[0, 1]"']
    assert "| nan |" in to_markdown(Table("t", [Column("a", "a")]), [row])


def test_a_metric_of_another_kind_is_refused():
    with pytest.raises(TypeError, match="not object"):
        plain({"a": object()})


def test_table_forms():
    rows = [{"mesh": "a|b", "n": 52_000, "psnr": 31.23456, "none": None}]
    columns = [
        Column("mesh", "mesh"),
        Column("n", "n", paper="n_paper"),
        Column("psnr", "PSNR"),
        Column("none", "none"),
    ]
    text = to_markdown(Table("T", columns, note="A note."), rows)
    # No paper's figure in any row: no columns for it.
    assert "| mesh | n | PSNR | none |\n| --- | ---: | ---: | ---: |" in text
    assert "| a\\|b | 52000 | 31.23 | – |" in text
    assert text.endswith("\nA note.\n")

    compared = to_markdown(Table("T", columns[:2], rows=[{"mesh": "m", "n": 5, "n_paper": 0}]), [])
    assert "| m | 0 | 5 | +5 |" in compared
    with pytest.raises(ValueError, match="unknown column 'psnrr'; did you mean 'psnr'"):
        to_markdown(Table("T", [Column("psnrr", "PSNR")]), rows)


def test_measure_takes_jitted_functions_and_trees(tmp_path):
    context = Context(tmp_path, Data())
    function = jax.jit(lambda tree: {"y": tree["x"] * 2})
    measured = context.measure("double", function, {"x": jnp.ones(3)}, repeats=2)
    np.testing.assert_array_equal(measured.value["y"], 2 * np.ones(3))
    assert measured.compile_seconds > 0
    assert context.times["double"]["run_seconds"] == measured.run_seconds


def test_progress_is_quiet_off_a_terminal(tmp_path, capsys):
    context = Context(tmp_path, Data(), progress=True)
    assert list(context.progress(range(3), "three")) == [0, 1, 2]
    assert capsys.readouterr().err == ""


def test_progress_on_a_terminal(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    list(Context(tmp_path, Data(), progress=True).progress(range(3), "three"))
    assert "three: 100%" in capsys.readouterr().err
    list(Context(tmp_path, Data(), progress=False).progress(range(3), "three"))
    assert capsys.readouterr().err == ""


def test_path_makes_folders(tmp_path):
    context = Context(tmp_path, Data())
    context.path("probes/grace.png", "Grace").write_bytes(b"")
    context.path("raw.npz").write_bytes(b"")
    assert context.pictures == {"probes/grace.png": "Grace"}


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ("{first | degree=2 | sum | .1f}", "12.0"),
        ("{first | | max sum | .0f}", "12"),
        ("{first | | count sum | d}", "2"),
    ],
)
def test_places_of_findings(toys, place, said):
    toys.run("toy")
    (toys.folder / "toy" / "findings.md").write_text(f"So: {place}.")
    ours = {name: entry for name, entry in entries().items() if name.startswith("toy")}
    [path] = fill(ours, toys.out, "quick")
    text = path.read_text()
    assert text.startswith(f"So: {said}.")
    assert "`toy`: " in text


@pytest.mark.parametrize(
    "place", ["{first | | sum | .1f}", "{first | degree=9 | sum | .1f}", "{x | | sum | d}"]
)
def test_places_that_name_no_number_are_refused(toys, place):
    toys.run("toy")
    (toys.folder / "toy" / "findings.md").write_text(place)
    ours = {name: entry for name, entry in entries().items() if name.startswith("toy")}
    with pytest.raises(UserError, match=r"toy/findings\.md"):
        fill(ours, toys.out, "quick")
