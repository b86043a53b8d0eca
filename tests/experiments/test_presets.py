"""TOML to frozen dataclass and back."""

import dataclasses
import tomllib
from enum import Enum
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.runner import UserError
from experiments.runner.config import check, fill, to_toml

Colour = Enum("Colour", ["RED", "GREEN"])


@dataclasses.dataclass(frozen=True)
class Config:
    name: str
    count: int = 3
    scale: float = 1.0
    loud: bool = False
    kind: Literal["a", "b", 3] = "a"
    colour: Colour = Colour.RED
    sizes: tuple[float, ...] = ()
    pair: tuple[int, str] = (1, "one")
    grid: tuple[tuple[int, int], ...] = ()
    limit: float | None = None


configs = st.builds(
    Config,
    name=st.text(st.characters(exclude_categories=["Cs"])),
    count=st.integers(-(2**63), 2**63 - 1),
    scale=st.floats(allow_nan=False),
    loud=st.booleans(),
    kind=st.sampled_from(["a", "b", 3]),
    colour=st.sampled_from(Colour),
    sizes=st.lists(st.floats(allow_nan=False)).map(tuple),
    pair=st.tuples(st.integers(0, 9), st.text("ab\\\"'\n\x7f")),
    grid=st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9))).map(tuple),
    limit=st.none() | st.floats(allow_nan=False),
)


@given(configs)
def test_round_trip(config):
    values = tomllib.loads(to_toml(config, "quick"))["quick"]
    assert fill(Config, values, where="quick") == config


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({}, "here: name is missing"),
        ({"nam": "x"}, "here: unknown key 'nam'; did you mean 'name'?"),
        ({"name": 1}, "here: name should be str, not 1"),
        ({"name": "x", "count": True}, "count should be int, not True"),
        ({"name": "x", "count": 1.0}, "count should be int, not 1.0"),
        ({"name": "x", "scale": "1"}, "scale should be float, not '1'"),
        ({"name": "x", "loud": 1}, "loud should be bool, not 1"),
        ({"name": "x", "kind": "c"}, "kind c not in literal"),
        ({"name": "x", "colour": "GREN"}, "colour unknown name 'GREN'; did you mean 'GREEN'?"),
        ({"name": "x", "sizes": 1.0}, "sizes 'float' object is not iterable"),
        ({"name": "x", "sizes": "1"}, "sizes should be a list, not '1'"),
        ({"name": "x", "sizes": ["1"]}, "sizes[0] should be float, not '1'"),
        ({"name": "x", "pair": [1]}, "pair Not enough values in [1]"),
        ({"name": "x", "limit": "none"}, "limit should be float, not 'none'"),
    ],
)
def test_refusals(values, sentence):
    with pytest.raises(UserError) as error:
        fill(Config, values, where="here")
    assert sentence in str(error.value)


def test_configs_that_the_runner_could_not_serve():
    thawed = dataclasses.make_dataclass("Thawed", [("a", int)])
    with pytest.raises(TypeError, match="frozen dataclass"):
        check(thawed)
    seeded = dataclasses.make_dataclass("Seeded", [("seed", int)], frozen=True)
    with pytest.raises(TypeError, match=r"Seeded\.seed is the runner's own option"):
        check(seeded)
    optional = dataclasses.make_dataclass("Optional", [("a", int | None, 3)], frozen=True)
    with pytest.raises(TypeError, match=r"Optional\.a is optional: its default is None"):
        check(optional)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("reproduces =", "toy/first.toml: Invalid value"),
        (
            "descripton = ''",
            "first.toml: unknown key 'descripton'; did you mean 'description'?",
        ),
        ("description = 'x'", "first.toml: 'reproduces' should be a line of text"),
        (
            "description = 'x'\nreproduces = 3",
            "first.toml: 'reproduces' should be a line of text",
        ),
    ],
)
def test_toml_files_that_are_not_an_experiment(toys, text, sentence):
    (toys.folder / "toy" / "first.toml").write_text(text)
    assert sentence in toys.refused("list")


def test_unknown_key_in_a_preset_names_file_and_preset(toys):
    path = toys.folder / "toy" / "first.toml"
    path.write_text(path.read_text().replace("scale", "scael"))
    sentence = toys.refused("run", "toy", "--preset", "paper")
    assert "toy/first.toml [paper]: unknown key 'scael'; did you mean 'scale'?" in sentence


def test_a_toml_file_without_its_function_is_a_bug(toys):
    path = toys.folder / "toy" / "third.toml"
    path.write_text("description = 'x'\nreproduces = 'y'\n[quick]")
    path.with_suffix(".py").touch()
    with pytest.raises(LookupError, match=r"registers no experiment 'toy\.third'"):
        toys("run", "toy.third")
