"""Typed configs: frozen dataclasses filled from TOML, overridden on the command line."""

import contextlib
import dataclasses
import io
import itertools
import json
import re
import types
import typing
from collections.abc import Iterable, Mapping, Sequence
from enum import Enum
from typing import Any, Literal, TypeVar

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
        if _is_optional(hints[field.name]) and field.default is not None:
            # TOML has no null: a key left out has to mean None.
            raise TypeError(f"{config.__name__}.{field.name} is optional: its default is None")


def fill(config: type[C], values: Mapping[str, Any], where: str) -> C:
    """The config with these TOML values; what is left out keeps the dataclass's default."""
    hints = typing.get_type_hints(config)
    fields = {field.name: field for field in dataclasses.fields(config)}  # pyright: ignore[reportArgumentType]
    for key in values:
        if key not in fields:
            raise unknown("key", key, fields, where)
    for key, field in fields.items():
        default = (field.default, field.default_factory)
        if key not in values and default == (dataclasses.MISSING, dataclasses.MISSING):
            raise UserError(f"{where}: the key {key!r} is missing")
    typed = {key: _convert(value, hints[key], key, where) for key, value in values.items()}
    try:
        return config(**typed)
    except ValueError as error:  # from the config's own __post_init__
        raise UserError(f"{where}: {error}") from None


def override(config: C, arguments: Sequence[str], prog: str, description: str) -> C:
    """The config with the fields that the command line names replaced (``--image-size 256``)."""
    import tyro

    box = io.StringIO()
    try:
        with contextlib.redirect_stderr(box):
            config, rest = tyro.cli(
                type(config),
                prog=prog,
                description=description,
                args=arguments,
                default=config,
                return_unknown_args=True,
            )
    except SystemExit as stop:
        if stop.code:
            raise UserError(f"{prog}: {_unboxed(box.getvalue())}") from None
        raise  # --help has been printed
    except ValueError as error:  # from __post_init__, where this tyro does not catch it
        raise UserError(f"{prog}: {error}") from None
    if rest:
        word = rest[0].partition("=")[0]
        if not word.startswith("-"):
            raise UserError(f"{prog}: unexpected argument {word!r}")
        raise unknown("option", word, _flags(config), prog)
    return config


def to_toml(config: Any, preset: str) -> str:
    """The config as a table that `fill` reads back; a field that is None is left out."""
    values = {field.name: getattr(config, field.name) for field in dataclasses.fields(config)}
    lines = [f"{key} = {_literal(value)}" for key, value in values.items() if value is not None]
    return "\n".join([f"[{preset}]", *lines, ""])


def _convert(value: Any, hint: Any, key: str, where: str) -> Any:
    """`value` as TOML gives it, as `hint` wants it: lists become tuples, names enum members."""
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if _is_optional(hint):
        [hint] = [one for one in inner if one is not types.NoneType]
        return _convert(value, hint, key, where)
    if origin is Literal:
        if not any(value == one and type(value) is type(one) for one in inner):
            raise unknown(key, str(value), map(str, inner), where)
        return value
    if isinstance(hint, type) and issubclass(hint, Enum):
        if value not in hint.__members__:
            raise unknown(key, str(value), hint.__members__, where)
        return hint[value]
    if origin is tuple and isinstance(value, list):
        hints = inner[:1] * len(value) if inner[-1] is Ellipsis else inner
        if len(hints) == len(value):
            return tuple(
                _convert(one, hint, key, where) for one, hint in zip(value, hints, strict=True)
            )
    if hint is float and type(value) is int:
        return float(value)
    if type(value) is not hint:  # exactly: true is no int
        wanted = hint.__name__ if type(hint) is type else str(hint)
        raise UserError(f"{where}: {key} should be {wanted}, not {value!r}")
    return value


def _is_optional(hint: Any) -> bool:
    union = typing.get_origin(hint) in (typing.Union, types.UnionType)
    return union and types.NoneType in typing.get_args(hint)


def _literal(value: Any) -> str:
    if isinstance(value, Enum):
        return json.dumps(value.name)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, tuple):
        return f"[{', '.join(map(_literal, value))}]"
    # A JSON string is a TOML string, but for the one character that TOML wants escaped.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _flags(config: Any) -> Iterable[str]:
    names = (*(field.name for field in dataclasses.fields(config)), *_RESERVED)
    return [f"--{name.replace('_', '-')}" for name in names]


def _unboxed(box: str) -> str:
    """The sentence in the box that tyro draws around an error, without help and frame."""
    text = re.sub(r"\x1b\[[\d;]*m", "", box)
    lines = [line.strip("│╭╮╰╯ ") for line in text.strip().splitlines()[1:]]
    rule = re.compile(r"[─-]{3,}")
    lines = itertools.dropwhile(rule.fullmatch, lines)  # where the frame is plain text
    return " ".join(itertools.takewhile(lambda line: not rule.fullmatch(line), lines))
