"""Typed configs: frozen dataclasses filled from TOML, overridden on the command line."""

import dataclasses
import functools
import types
import typing
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any, TypeVar

from .errors import UserError, unknown

C = TypeVar("C")

# The runner's own options, which no config's field may take.
_RESERVED = ("preset", "data", "out", "seed", "no_progress", "help")


def check(config: type) -> None:
    """Refuse a config type that the runner could not fill, override or write back."""
    if not dataclasses.is_dataclass(config) or not config.__dataclass_params__.frozen:  # pyright: ignore[reportAttributeAccessIssue]
        raise TypeError(f"a config is a frozen dataclass, not {config!r}")
    hints = typing.get_type_hints(config)
    for field in dataclasses.fields(config):
        if {field.name, f"no_{field.name}"} & set(_RESERVED):
            raise TypeError(f"{config.__name__}.{field.name} is the runner's own option")
        if types.NoneType in typing.get_args(hints[field.name]) and field.default is not None:
            # TOML has no null: a key left out has to mean None.
            raise TypeError(f"{config.__name__}.{field.name} is optional: its default is None")


def fill(config: type[C], values: Mapping[str, Any], where: str) -> C:
    """Structure TOML values into the config; what is left out keeps the dataclass's default."""
    import cattrs

    hints = typing.get_type_hints(config)
    for key, value in values.items():
        if key not in hints:
            raise unknown("key", key, hints, where)
        if isinstance(value, str) and typing.get_origin(hints[key]) is tuple:
            raise UserError(f"{where}: {key} should be a list, not {value!r}")
    try:
        return _converter().structure(values, config)
    except cattrs.BaseValidationError as error:
        message, _, key = cattrs.transform_error(error, format_exception=_sentence)[0].rpartition(
            " @ $"
        )
        raise UserError(" ".join([f"{where}:", *([key[1:]] if key else []), message])) from None


def override(config: C, arguments: Sequence[str], prog: str, description: str) -> C:
    """Replace the fields that the command line names (``--image-size 256``)."""
    import tyro

    try:
        config, rest = tyro.cli(
            type(config),
            prog=prog,
            description=description,
            args=arguments,
            default=config,
            return_unknown_args=True,
        )
    except ValueError as error:  # from __post_init__, where this tyro does not catch it
        raise UserError(f"{prog}: {error}") from None
    if rest:
        word = rest[0].partition("=")[0]
        if not word.startswith("-"):
            raise UserError(f"{prog}: unexpected argument {word!r}")
        flags = [f"--{name.replace('_', '-')}" for name in (*_names(config), *_RESERVED)]
        raise unknown("option", word, flags, prog)
    return config


def to_toml(config: Any, preset: str) -> str:
    """Write the config as a table that `fill` reads back; a field that is None is left out."""
    import tomli_w

    values = _converter().unstructure(config)
    return tomli_w.dumps({preset: {k: v for k, v in values.items() if v is not None}})


@functools.cache
def _converter():
    """The converter of TOML's types: exact ones, lists for tuples, names for enum members."""
    import cattrs

    converter = cattrs.Converter()
    for kind in (bool, int, float, str):
        converter.register_structure_hook(kind, _exactly)
    converter.register_structure_hook(Enum, _member)
    converter.register_unstructure_hook(Enum, lambda member: member.name)
    return converter


def _exactly(value: Any, hint: type) -> Any:
    if hint is float and type(value) is int:
        return float(value)
    if type(value) is not hint:  # true is no int
        raise ValueError(f"should be {hint.__name__}, not {value!r}")
    return value


def _member(name: Any, hint: type[Enum]) -> Enum:
    if name not in hint.__members__:
        raise ValueError(str(unknown("name", str(name), hint.__members__)))
    return hint[name]


def _sentence(error: BaseException, _: type | None) -> str:
    return "is missing" if isinstance(error, KeyError) else str(error)


def _names(config: Any) -> list[str]:
    return [field.name for field in dataclasses.fields(config)]
