"""The command line: listing, refusals in one sentence, overrides, exit codes."""

import ast
import dataclasses
import string
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest

import experiments
from experiments.runner.registry import entries, load

ROOT = Path(experiments.__file__).parent.parent


def test_list_is_quick_and_light():
    script = (
        "import sys, runpy; sys.argv = ['experiments', 'list']\n"
        "try: runpy.run_module('experiments', run_name='__main__')\n"
        "except SystemExit as stop: assert stop.code == 0\n"
        "assert not {'jax', 'numpy', 'tyro', 'tqdm'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", script], cwd=ROOT, check=True, capture_output=True)
    start = time.perf_counter()
    listed = subprocess.run(
        [sys.executable, "-m", "experiments", "list"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    assert time.perf_counter() - start < 1.5
    assert listed.stderr == ""
    assert listed.stdout.splitlines()[0].split() == [
        *("experiment", "presets", "description", "reproduces"),
    ]


def test_list_shows_every_experiment(toys):
    code, stdout, _ = toys("list")
    assert code == 0
    lines = [line.split("  ") for line in stdout.splitlines()]
    assert [line[0] for line in lines[1:]] == list(entries())
    assert "quick paper" in stdout
    assert "Nobody 1900, table 2" in stdout


def test_every_experiment_is_registered_and_its_presets_fill():
    from experiments.runner.config import fill

    for entry in entries().values():
        assert set(entry.presets) >= {"quick", "paper"}
        for preset, values in entry.presets.items():
            fill(load(entry).config, values, where=preset)


def test_notes_belong_to_tables_and_name_fields_of_the_config():
    from experiments.runner.report import sections

    for entry in entries().values():
        notes = sections(entry.path.with_suffix(".md"))
        code = "".join(path.read_text() for path in entry.path.parent.glob("*.py"))
        for title, lines in notes.items():
            assert f'"{title}"' in code or f"'{title}'" in code, (entry.file, title)
            for _, field, _, _ in string.Formatter().parse(" ".join(lines)):
                if (field or "").startswith("config."):
                    name = field.removeprefix("config.").partition("[")[0]
                    fields = {one.name for one in dataclasses.fields(load(entry).config)}
                    assert name in fields, (entry.file, name)


@pytest.mark.parametrize("words", [[], ["--help"], ["run", "--help"]])
def test_help(toys, words):
    code, stdout, stderr = toys(*words)
    assert (code, stderr) == (0, "")
    assert "python -m experiments run NAME" in stdout


def test_help_of_an_experiment_shows_fields_and_preset(toys, capsys):
    with pytest.raises(SystemExit) as stop:
        toys("run", "toy", "--preset", "paper", "--help")
    assert stop.value.code == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "--degrees [INT" in text
    assert "degrees to sum (default: 1 2 4)" in text
    assert "{exact,rough}" in text


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["lst"], "unknown command 'lst'; did you mean 'list'?"),
        (["list", "all"], "list: unexpected argument 'all'"),
        (["run"], "names of the experiments come first"),
        (["run", "--preset", "quick", "toy"], "names of the experiments come first"),
        (["run", "toi"], "unknown experiment 'toi'; did you mean 'toy'?"),
        (["run", "toy", "--preset", "papr"], "unknown preset 'papr'; did you mean 'paper'?"),
        (["run", "toy", "--seed", "x"], "--seed: invalid int value: 'x'"),
        (["run", "toy", "--degress", "1"], "unknown option '--degress'; did you mean '--degrees'?"),
        (["run", "toy", "--sed", "1"], "unknown option '--sed'; did you mean '--seed'?"),
        (["run", "toy", "--image-sise=4"], "did you mean '--image-size'?"),
        (["run", "toy", "--shadows", "no"], "unexpected argument 'no'"),
        (["run", "toy", "toy.second", "--scale", "2"], "overrides and --help are for one"),
        (["run", "toy", "--data", "nowhere"], "there is no data folder 'nowhere'"),
    ],
)
def test_mistakes_are_refused_in_one_sentence(toys, words, sentence):
    assert sentence in toys.refused(*words)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["run", "toy", "--degrees", "1", "x"], "--degrees"),
        (["run", "toy", "--image-size", "big"], "--image-size"),
        (["run", "toy", "--kind", "exat"], "exact"),
        (["run", "toy", "--scale", "-1"], "scale should be positive, not -1.0"),
    ],
)
def test_overrides_of_another_type_are_refused(toys, words, sentence):
    """By tyro, which prints its own words."""
    try:
        code, _, stderr = toys(*words)
    except SystemExit as stop:
        code, stderr = stop.code, toys.capsys.readouterr().err
    assert code == 2
    assert sentence in stderr
    assert not toys.out.exists()


def test_overrides_are_typed(toys):
    words = "--degrees 1 --sun -1 0 0.5 --image-size 256 --no-shadows --window HANN --scale 3"
    code, _, _ = toys.run("toy", "--preset", "paper", *words.split())
    assert code == 0
    assert tomllib.loads(toys.read("toy/paper/config.toml")) == {
        "paper": {
            "degrees": [1],
            "scale": 3.0,
            "kind": "exact",
            "window": "HANN",
            "image_size": 256,
            "sun": [-1.0, 0.0, 0.5],
            "shadows": False,
            "mood": "calm",
        }
    }


def test_the_others_run_when_one_fails(toys):
    config = toys.folder / "toy" / "first.toml"
    config.write_text(config.read_text().replace("degrees = [1, 2]", "degrees = [4]\nmood='angry'"))
    code, stdout, stderr = toys.run("toy", "toy.second")
    assert code == 1
    assert stdout.split() == [str(toys.out / "toy.second/quick/table.md")]
    assert "RuntimeError: a bug" in stderr
    assert "1 of 2 failed: toy" in stderr


def test_a_mistake_met_while_running_is_a_sentence_too(toys):
    code, _, stderr = toys.run("toy", "--degrees", "4", "--mood", "knit")
    assert code == 2
    assert "unknown mesh 'knit'; did you mean 'knot'?" in stderr
    assert "Traceback" not in stderr


def test_ctrl_c_stops_all_and_says_what_is_kept(toys):
    code, stdout, stderr = toys.run("toy", "--degrees", "1", "4", "--mood", "hasty")
    assert (code, stdout) == (130, "")
    assert f"rows kept: 1, in {toys.out / 'toy/quick.partial'}" in stderr
    assert "Traceback" not in stderr


def test_papers_import_what_is_shared_and_public_names_alone():
    """A paper's folder imports the runner and what is shared, never another paper or a file of
    jaxsh's own; what is shared imports the runner, which imports neither.
    """
    below = {"runner": set(), "shared": {"runner"}}
    for path in (ROOT / "experiments").glob("*/*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.ImportFrom) or node.module is None:
                continue
            names = node.module.split(".")
            if node.level == 2:
                assert names[0] in below.get(path.parent.name, {"runner", "shared"}), path
            if names[0] == "jaxsh":
                assert not any(name.startswith("_") for name in names), path
