"""Changes to the bytes or the text of any file."""

import re
import struct
from random import Random

import numpy as np
from fuzz_files import seeds

BYTES = [0, 1, 9, 10, 13, 32, 34, 45, 47, 92, 127, 128, 254, 255]
NUMBERS = [
    "nan", "-nan(ind)", "inf", "-inf", "1e39", "-1e308", "1e309", "1e-46", "1e-320", "-0", "00",
    "+1", "1.", ".5", "1e", "1e+", "1.2.3", "--1", "0x10", "1_0", "1,5", "1d3", "", "-1", "0", "1",
    "2", "12", "13", "-12", "-13", "255", "256", "32767", "65535", "65536", "2147483647",
    "2147483648", "4294967295", "4294967296", "9223372036854775807", "9223372036854775808",
    "1" * 400, "9" * 5000, "0." + "3" * 300, "٣", "１", "²", "∞", "1\u00a0", "a", "true", "null",
    "1e9", "3.5", "16777217",
]  # fmt: skip
WORDS = [
    b"#", b"\\", b"\\\n", b"\0", b"\xef\xbb\xbf", b"\xff\xfe", b"\xc2\xa0", b"\xe2\x80\xa8",
    b"\x85", b"\x0b", b"\x0c", b"\x1c", b"\x1a", b"\xf0\x9f\x92\xa1", b"\xc3", b"\xed\xa0\x80",
    b"\t", b" ", b"\n", b"\r", b"\r\n", b"\n\n", b"/", b"//", b"%s", b"{}", b"\x1b[31m",
    b"\xe2\x80\xae", b"A" * 5000,
]  # fmt: skip
WHOLE = [
    0,
    1,
    2,
    3,
    127,
    128,
    255,
    256,
    32767,
    32768,
    65535,
    65536,
    2**24,
    2**31 - 1,
    2**31,
    2**32 - 1,
]
_NUMBER = re.compile(rb"(?<![\w.])[-+]?\d[\w.+-]*")


def _place(data: bytes, rng: Random) -> int:
    """Draw a place in a file; half of the time near its start, where headers are."""
    end = len(data) if rng.random() < 0.5 else min(len(data), 200)
    return rng.randrange(end + 1)


def _put_byte(data: bytes, rng: Random, kind: str) -> bytes:
    at = _place(data, rng)
    return data[:at] + bytes([rng.choice(BYTES)]) + data[at + 1 :]


def _flip_bit(data: bytes, rng: Random, kind: str) -> bytes:
    if not data:
        return data
    at = min(_place(data, rng), len(data) - 1)
    return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]


def put_number(data: bytes, rng: Random, kind: str) -> bytes:
    """Overwrite by a whole number in binary, in either order of bytes."""
    at = _place(data, rng)
    size = rng.choice([1, 2, 4, 4, 8])
    value = rng.choice([rng.choice(WHOLE), -rng.choice(WHOLE), rng.getrandbits(64)]) % 256**size
    return data[:at] + value.to_bytes(size, rng.choice(["little", "big"])) + data[at + size :]


def _put_float(data: bytes, rng: Random, kind: str) -> bytes:
    at = _place(data, rng)
    at -= at % 4 if rng.random() < 0.5 else 0
    value = rng.choice([np.nan, np.inf, -np.inf, 3e38, 1e-45, -0.0, -1.0, 1e9, 0.5])
    new = struct.pack(rng.choice(["<f", ">f", "<d"]), value)
    return data[:at] + new + data[at + len(new) :]


def _truncate(data: bytes, rng: Random, kind: str) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _insert(data: bytes, rng: Random, kind: str) -> bytes:
    at = _place(data, rng)
    new = rng.choice(
        [rng.choice(WORDS), bytes(rng.randrange(256) for _ in range(rng.randrange(9)))]
    )
    return data[:at] + new + data[at:]


def _cut(data: bytes, rng: Random, kind: str) -> bytes:
    at = _place(data, rng)
    return data[:at] + data[at + rng.choice([1, 1, 2, 4, 12, 50]) :]


def _copy(data: bytes, rng: Random, kind: str) -> bytes:
    """Put a part of the file, or all of it, somewhere else."""
    start = rng.randrange(len(data) + 1)
    part = data[start : start + rng.choice([1, 4, 12, 80, len(data)])]
    at = _place(data, rng)
    return data[:at] + part + data[at:]


def _splice(data: bytes, rng: Random, kind: str) -> bytes:
    """Go on as another file of the format does."""
    other = rng.choice(seeds(kind))
    return data[: rng.randrange(len(data) + 1)] + other[rng.randrange(len(other) + 1) :]


OF_BYTES = [_put_byte, _flip_bit, put_number, _put_float, _truncate, _insert, _cut, _copy, _splice]


def swap_number(data: bytes, rng: Random, kind: str) -> bytes:
    """Replace one number in the text by an odd one, or by one nearby."""
    found = list(_NUMBER.finditer(data[:20000]))
    if not found:
        return data
    # The first numbers are the header's counts.
    one = rng.choice(found[:4] if rng.random() < 0.4 else found)
    new = rng.choice(NUMBERS).encode()
    if rng.random() < 0.3 and one[0].isdigit() and len(one[0]) < 10:
        new = str(int(one[0]) + rng.choice([-2, -1, 1, 2])).encode()
    return data[: one.start()] + new + data[one.end() :]


def _swap_ends(data: bytes, rng: Random, kind: str) -> bytes:
    ends = [b"\n", b"\r\n", b"\r", b"\n\r", b"\n\n", b" \n", b"\x0b", b"\xc2\x85", b"\xe2\x80\xa8"]
    return data.replace(b"\n", rng.choice(ends), rng.choice([-1, -1, 1, 5]))


def _move_line(data: bytes, rng: Random, kind: str) -> bytes:
    """Drop, double, swap, join, lengthen or comment out a line."""
    lines = data.split(b"\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(7):
        case 0:
            del lines[i]
        case 1:
            lines.insert(j, lines[i])
        case 2:
            lines[i], lines[j] = lines[j], lines[i]
        case 3:
            lines[i : i + 2] = [b" ".join(lines[i : i + 2])]
        case 4:
            lines[i] += b" " + rng.choice(lines)
        case 5:
            lines[i] = b"#" + lines[i]
        case 6:
            lines.insert(i, rng.choice([b"", b"# \xc3\xa9 comment", b"comment format ascii 1.0"]))
    return b"\n".join(lines)


def _move_word(data: bytes, rng: Random, kind: str) -> bytes:
    """Drop, double, swap or change the case of a word."""
    words = re.split(rb"(\s+)", data)
    i, j = rng.randrange(0, len(words), 2), rng.randrange(0, len(words), 2)
    match rng.randrange(5):
        case 0:
            words[i] = b""
        case 1:
            words[i] += b" " + words[i]
        case 2:
            words[i], words[j] = words[j], words[i]
        case 3:
            words[i] = words[i].swapcase()
        case 4:
            words[i] = rng.choice(WORDS)
    return b"".join(words)


OF_TEXT = [swap_number, swap_number, swap_number, _swap_ends, _move_line, _move_line, _move_word]
