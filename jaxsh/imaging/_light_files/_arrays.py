"""Read and write lights as NumPy's arrays: ours, which say their convention, and others'."""

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..._core.json_fields import parse_object
from ..._core.npy import from_npy, from_npz, npz_names, text_of
from ..._core.words import reason
from ...harmonics import Convention, conventions
from ._stored import Stored, choose

_FORMAT, _VERSION = "jaxsh light", 1
_SAID = ("format", "version", "convention", "facts")


def read_npy(path: Path, which: str | int | None) -> Stored:
    """Read a bare array, which does not say its convention."""
    if which is not None:
        raise ValueError(f"a .npy holds one array: which must be None, got {which!r}")
    return Stored(from_npy(path.read_bytes()), None)


def read_npz(path: Path, which: str | int | None) -> Stored:
    """Read the array "coefficients", or the only one, or the one that is asked for.

    "facts" (ours, a `Convention` in JSON) or "convention" (a name) say what it is.
    """
    try:
        names = npz_names(path)
        words = {name: text_of(array) for name, array in from_npz(path, _SAID).items()}
    except Exception as error:  # a damaged archive may raise anything
        raise ValueError(f"damaged: {reason(error)}") from error
    kind, version = words.get("format", _FORMAT), words.get("version", str(_VERSION))
    if kind != _FORMAT or (version != str(_VERSION) and "format" in words):
        raise ValueError(
            f"it is a file {reason(kind, 40)!r} of version {reason(version, 40)!r}, expected "
            f"{_FORMAT!r} of version {_VERSION}"
        )
    held = [name for name in names if name not in _SAID]
    default = held.index("coefficients") if "coefficients" in held else None
    name = held[choose("arrays", held, which, default)]
    try:
        values = from_npz(path, [name])[name]
    except Exception as error:
        raise ValueError(f"damaged: {reason(error)}") from error
    return Stored(values, _convention(words))


def _convention(words: dict[str, str]) -> str | Convention | None:
    if "facts" in words:
        facts = parse_object(words["facts"].encode())
        known = {field.name for field in dataclasses.fields(Convention)}
        if unknown := sorted(set(facts) - known):
            raise ValueError(f"its convention has unknown facts {reason(', '.join(unknown), 60)}")
        try:
            return Convention(**{name: _tuples(fact) for name, fact in facts.items()})
        except (TypeError, ValueError) as error:
            raise ValueError(f"its facts are no convention: {reason(error)}") from error
    name = words.get("convention")
    if name is not None and name not in conventions():
        raise ValueError(
            f"its convention {reason(name, 40)!r} is none of harmonics.conventions(): say "
            "convention="
        )
    return name


def _tuples(fact: Any) -> Any:
    """Give tuples for JSON's lists."""
    return tuple(map(_tuples, fact)) if isinstance(fact, list) else fact


def npz_file(
    values: np.ndarray, name: str | None, convention: Convention
) -> Callable[[BinaryIO], None]:
    """Give what writes an archive with the coefficients, their convention's name and its facts."""
    arrays = {
        "format": np.array(_FORMAT),
        "version": np.array(_VERSION),
        "convention": np.array(name or "see facts"),
        "facts": np.array(json.dumps(dataclasses.asdict(convention))),
        "coefficients": values,
    }
    return lambda file: np.savez(file, allow_pickle=False, **arrays)
