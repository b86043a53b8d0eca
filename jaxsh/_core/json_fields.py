"""Read JSON, and take fields from it, each checked for its type and range."""

import json
import math
from typing import Any, NoReturn

Fields = dict[str, Any]


def parse(source: bytes | memoryview) -> Any:
    """Read JSON in UTF-8; raises `ValueError` for what is none, and for NaN and Infinity."""

    def refuse(constant: str) -> NoReturn:
        raise ValueError(f"{constant} is no number of JSON")

    try:
        # Some writers pad with zeros instead of spaces.
        decoded = bytes(source).rstrip(b"\0").decode("utf-8-sig")
        return json.loads(decoded, parse_constant=refuse)
    except RecursionError:
        raise ValueError("its JSON is nested too deeply") from None
    except UnicodeDecodeError as error:
        raise ValueError(f"its JSON is not UTF-8 at byte {error.start}") from None
    except ValueError as error:
        raise ValueError(f"its JSON is damaged: {error}") from None


def parse_object(source: bytes | memoryview) -> Fields:
    """Read JSON that is an object, as `parse` does."""
    fields = parse(source)
    if not isinstance(fields, dict):
        raise ValueError(f"its JSON should be an object, got {shown(fields)}")
    return fields


def whole(fields: Fields, key: str, owner: str, default: int | None = None) -> int:
    """Take a whole number >= 0; required where there is no default."""
    value = fields.get(key)
    if value is None and default is not None:
        return default
    # JSON does not tell 3.0 from 3.
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise ValueError(f"{owner} should have a whole number as {key!r}, got {shown(value)}")
    return value


def numbers(
    fields: Fields, key: str, owner: str, length: int | None, default: list[float] | None
) -> list[float]:
    """Take a list of finite numbers, `length` of them where that is given."""
    value = fields.get(key)
    value = default if value is None else value
    if (
        not isinstance(value, list)
        or (length is not None and len(value) != length)
        or not all(isinstance(x, int | float) and not isinstance(x, bool) for x in value)
    ):
        count = "numbers" if length is None else f"{length} number{'s' * (length != 1)}"
        got = shown(value)
        if isinstance(value, list):
            others = (x for x in value if not isinstance(x, int | float) or isinstance(x, bool))
            got += next((f" with {shown(x)} in it" for x in others), "")
        raise ValueError(f"{owner} should have {count} as {key!r}, got {got}")
    try:
        value = [float(x) for x in value]
    except OverflowError:
        value = [math.inf]
    if not all(map(math.isfinite, value)):
        raise ValueError(f"{owner} should have finite numbers as {key!r}, got {shown(value)}")
    return value


def number(fields: Fields, key: str, owner: str, default: float) -> float:
    """Take a finite number."""
    value = fields.get(key)
    if value is None:
        return default
    try:
        return numbers({key: [value]}, key, owner, 1, None)[0]
    except ValueError:
        raise ValueError(
            f"{owner} should have a finite number as {key!r}, got {shown(value)}"
        ) from None


def indices(fields: Fields, key: str, owner: str) -> list[int]:
    """Take a list of whole numbers >= 0; empty where there is none."""
    value = listed(fields, key, owner)
    return [whole({key: x}, key, owner) for x in value]


def listed(fields: Fields, key: str, owner: str) -> list[Any]:
    """Take a list; empty where there is none."""
    value = fields.get(key)
    if value is None:
        return []
    if not isinstance(value, list):
        raise ValueError(f"{owner} should have a list as {key!r}, got {shown(value)}")
    return value


def inner(fields: Fields, key: str, owner: str) -> Fields:
    """Take an object; empty where there is none."""
    value = fields.get(key)
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise ValueError(f"{owner} should have an object as {key!r}, got {shown(value)}")
    return value


def extension(fields: Fields, name: str, owner: str) -> Fields | None:
    """Take the fields of an extension, None where the object does not have it."""
    extensions = inner(fields, "extensions", owner)
    return inner(extensions, name, owner) if name in extensions else None


def text(fields: Fields, key: str, owner: str) -> str | None:
    """Take a string, None where there is none."""
    value = fields.get(key)
    if value is not None and not isinstance(value, str):
        raise ValueError(f"{owner} should have text as {key!r}, got {shown(value)}")
    return value


def flag(fields: Fields, key: str, owner: str, default: bool = False) -> bool:
    """Take true or false."""
    value = fields.get(key)
    value = default if value is None else value
    if not isinstance(value, bool):
        raise ValueError(f"{owner} should have true or false as {key!r}, got {shown(value)}")
    return value


def shown(value: Any) -> str:
    """Print a value of a file in one short line."""
    if value is None:
        return "none"
    if isinstance(value, dict | list):
        return f"{'an object' if isinstance(value, dict) else 'a list'} of {len(value)}"
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) > 10**18:
        return f"{'-' if value < 0 else ''}a number of {value.bit_length()} bits"
    printed = repr(value)
    return printed if len(printed) <= 60 else f"{printed[:57]}..."
