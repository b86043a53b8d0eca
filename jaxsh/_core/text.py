"""Words and numbers of text files, found for the whole file at once."""

import re
import warnings

import numpy as np
from jaxtyping import Bool, Int

from .ranges import ranges

_BLANK = np.zeros(256, bool)
_BLANK[list(b" \t\n\v\f\r")] = True
# What the C libraries of some systems print for a value that is none.
_ODD_NAN = re.compile(rb"[-+]?(?:nan\(\w*\)|1\.#(?:qnan|snan|ind|inf)\d*)", re.I)
_COMMENT = re.compile(r"\s#.*|^#(?=\s|$).*")
# A line that goes on in the next is joined to it by this blank, so that lines can be counted.
JOINT = b"\v"


def plain_text(data: bytes) -> bytes:
    """Give the text as UTF-8 without a byte-order mark, its lines ended by a line feed each."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        data = data.decode("utf-16", errors="replace").encode()
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return data


def decode(line: bytes) -> str:
    """Give a line as text: UTF-8, or Latin-1 where it is not that, so that names stay apart."""
    try:
        return line.decode()
    except UnicodeDecodeError:
        return line.decode("latin-1")


def without_comment(name: str) -> str:
    """Cut off what begins with # behind a blank; a name itself may begin so."""
    return _COMMENT.sub("", name).strip()


class Words:
    """Finds the words of a text and the lines that hold them; blank lines hold none.

    `first` and `counts` tell for each line with words its first word and how many there are.
    """

    def __init__(self, text: bytes):
        self.text = text
        self.bytes = np.frombuffer(text, np.uint8)
        blank = _BLANK[self.bytes]
        before = np.concatenate([[True], blank[:-1]])
        after = np.concatenate([blank[1:], [True]])
        self.starts = np.flatnonzero(~blank & before[: len(blank)])
        self.ends = np.flatnonzero(~blank & after[: len(blank)]) + 1
        newlines = np.flatnonzero(self.bytes == ord("\n"))
        line = np.searchsorted(newlines, self.starts)
        self.first = np.flatnonzero(np.diff(line, prepend=-1))
        self.counts = np.diff(self.first, append=len(line))

    def __len__(self) -> int:
        return len(self.starts)

    def word(self, at: int) -> str:
        """Give one word, cut where it is long."""
        text = self.text[self.starts[at] : self.ends[at]]
        return text[:40].decode(errors="replace") + "…" * (len(text) > 40)

    def line(self, at: int) -> int:
        """Count the lines up to that of a word, from 1."""
        before = self.text[: self.starts[at]]
        return 1 + before.count(b"\n") + before.count(JOINT)

    def equal(self, at: Int[np.ndarray, " n"], word: bytes) -> Bool[np.ndarray, " n"]:
        """Tell which of some words are the one given."""
        same = self.ends[at] - self.starts[at] == len(word)
        begin = self.starts[at[same]]
        alike = np.ones(len(begin), bool)
        for i, byte in enumerate(word):
            alike &= self.bytes[begin + i] == byte
        same[same] = alike
        return same

    def in_lines(self, lines: Bool[np.ndarray, " l"], *, skip: int = 0) -> Int[np.ndarray, " w"]:
        """Give the words of the lines marked, without the first `skip` of each."""
        return ranges(self.first[lines] + skip, np.maximum(self.counts[lines] - skip, 0))

    def joined(self, at: Int[np.ndarray, " w"]) -> bytes:
        """Give the text of some words in their order, with a blank behind each."""
        # +1 where a stretch to keep begins, -1 behind its end, with the blank that follows.
        change = np.zeros(len(self.bytes) + 2, np.int8)
        change[self.starts[at]] = 1
        change[self.ends[at] + 1] -= 1
        keep = np.cumsum(change[: len(self.bytes)], dtype=np.int8).astype(bool)
        return self.bytes[keep].tobytes()

    def numbers(self, at: Int[np.ndarray, " w"], kind: type = np.float64) -> np.ndarray:
        """Read some words, ascending, as numbers, or say which is none."""
        values = parse(self.joined(at), len(at), kind)
        if values is not None:
            return values
        while len(at) > 1:  # halve until one word is left that is no number
            half = at[: len(at) // 2]
            at = half if parse(self.joined(half), len(half), kind) is None else at[len(half) :]
        raise ValueError(self.refusal(int(at[0]), kind))

    def refusal(self, at: int, kind: type) -> str:
        """Say where a word stands that is no number."""
        what = "number" if kind is np.float64 else "whole number"
        return f"line {self.line(at)}: {self.word(at)!r} is no {what}"


def parse(text: bytes, count: int, kind: type = np.float64) -> np.ndarray | None:
    """Read so many numbers between blanks; None where the text is not that."""
    values = _parse(text, kind)
    if (values is None or len(values) != count) and kind is np.float64:
        values = _parse(_ODD_NAN.sub(b"nan", text), kind)
    return values if values is not None and len(values) == count else None


def _parse(text: bytes, kind: type) -> np.ndarray | None:
    with warnings.catch_warnings():
        # NumPy only warns when text stops making sense, and gives what it had read so far.
        warnings.simplefilter("error")
        try:
            return np.fromstring(text, kind, sep=" ")
        except (DeprecationWarning, ValueError):
            return None
