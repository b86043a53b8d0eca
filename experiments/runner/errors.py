"""Mistakes of the user's, told in one sentence."""

import difflib
from collections.abc import Iterable


class UserError(Exception):
    """A mistake of the user's: the runner prints its sentence, without a traceback."""


def unknown(kind: str, word: str, known: Iterable[str], where: str = "") -> UserError:
    """The refusal of a word that is not known: it names the nearest one, or else all of them."""
    known = list(known)
    near = difflib.get_close_matches(word, known, n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known) or 'none'}"
    return UserError(f"{where and where + ': '}unknown {kind} {word!r}; {hint}")
