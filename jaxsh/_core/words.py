"""Words of errors: what was given, what was meant, and what others said."""

import difflib
from collections.abc import Iterable
from typing import Any

import jax.numpy as jnp
import numpy as np


def reason(said: BaseException | str, most: int = 200) -> str:
    """Give the first line of a message, printable and of `most` characters at most.

    What a parser says of a damaged file may quote any bytes of it. An error without a message
    gives its type's name.
    """
    text = str(said).strip()
    if not text:
        return "" if isinstance(said, str) else type(said).__name__
    text = "".join(c if c.isprintable() else " " for c in text.splitlines()[0]).strip()
    return text if len(text) <= most else f"{text[: most - 3]}..."


def described(value: Any) -> str:
    """Says in a few words what was given."""
    if isinstance(value, int) and value.bit_length() > 1024:  # Python does not write the longest
        return f"an integer of {value.bit_length()} bits"
    if value is None or isinstance(value, str | bool | int | float | complex | np.number):
        text = repr(value)
        return text if len(text) <= 60 else f"{text[:57]}…"
    kind = type(value).__name__
    if hasattr(value, "shape") and hasattr(value, "dtype"):
        return f"an array of shape {value.shape} and dtype {value.dtype}"
    if isinstance(value, list | tuple | dict | set):
        return f"a {kind} of {len(value)}"
    if isinstance(value, type):
        return f"the class {value.__name__} itself"
    if callable(value) and hasattr(value, "__name__"):
        return f"the function {value.__name__}"
    return f"{article(kind)} {kind}"


def said_dtype(dtype: Any) -> str:
    """Names a dtype; that of a picture's codes with the way to decode them."""
    if dtype in (jnp.uint8, jnp.uint16):
        return (
            f"{dtype}: the codes of a picture, to be decoded to light by "
            f"imaging.srgb_decode(image / {jnp.iinfo(dtype).max})"
        )
    return f"{dtype}"


def nearest(value: Any, options: Iterable[Any]) -> str:
    """Says which option was meant, or nothing."""
    if not isinstance(value, str):
        return ""
    known = [option for option in options if isinstance(option, str)]
    near = difflib.get_close_matches(value.lower(), known, n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


def article(noun: str) -> str:
    """Gives the indefinite article of a noun."""
    return "an" if noun[:1] in "AEIOUaeiou" else "a"
