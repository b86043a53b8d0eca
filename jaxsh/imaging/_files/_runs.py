"""Radiance's pixels, whatever their coding: flat, in old runs of pixels, in new runs of bytes.

Each row is coded on its own. A new one begins with 2, 2 and its length; red, green, blue and
exponent follow one after the other, each in runs (128 + count, byte) and literals (count, bytes).
In any other row a pixel 1, 1, 1, n repeats the one before it n times, n · 256 times where it
follows such a pixel, and so on.
"""

import numpy as np
from jaxtyping import Int, UInt8

# New runs announce rows of these lengths only.
_LEAST, _MOST = 8, 0x7FFF
# Bytes of a file, and decoded ones, that are worked on at a time.
_AT_ONCE = 1 << 24

Bytes = UInt8[np.ndarray, " bytes"]


def row_marker(width: int) -> bytes | None:
    """The four bytes that a row in new runs begins with; None for widths that have none."""
    return b"\2\2" + width.to_bytes(2, "big") if _LEAST <= width <= _MOST else None


def decode_rows(
    data: bytes, place: int, height: int, width: int
) -> tuple[UInt8[np.ndarray, "h 4 w"], int]:
    """Decode all rows, red, green, blue and exponent apart, and the place where the last one ends.

    Raises `ValueError` where a row cannot be read.
    """
    marker, numbers = row_marker(width), np.frombuffer(data, np.uint8)
    out, row, block, at_once = [], 0, None, 1
    while row < height:
        if marker and data.startswith(marker, place):
            block, place = _coded(data, numbers, marker, place, height - row, width)
        else:
            # Twice as many as before, where all were plain: no row is looked at often.
            at_once = 2 * at_once if block is not None and len(block) == at_once else 1
            block, place = _plain(numbers, marker, place, min(at_once, height - row), width)
            if block is None:
                block, place = _repeated(numbers, place, width)
        if block is None:
            raise ValueError(f"damaged or truncated: row {row + 1} of {height} cannot be read")
        out.append(block)
        row += len(block)
    return np.concatenate(out), place


def _plain(
    numbers: Bytes, marker: bytes | None, place: int, most: int, width: int
) -> tuple[np.ndarray | None, int]:
    """Rows of pixels, up to the first that is coded."""
    rows = min(most, (len(numbers) - place) // (4 * width))
    pixels = numbers[place : place + rows * 4 * width].reshape(rows, width, 4)
    coded = (pixels[..., :3] == 1).all(axis=-1).any(axis=-1)
    if marker:
        coded |= (pixels[:, 0] == np.frombuffer(marker, np.uint8)).all(axis=-1)
    rows = int(coded.argmax()) if coded.any() else rows
    return (pixels[:rows].swapaxes(1, 2) if rows else None), place + rows * 4 * width


def _repeated(numbers: Bytes, place: int, width: int) -> tuple[np.ndarray | None, int]:
    """One row of pixels and repeats."""
    pixels = numbers[place : place + 4 * width]
    pixels = pixels[: len(pixels) // 4 * 4].reshape(-1, 4)
    repeats, at = (pixels[:, :3] == 1).all(axis=1), np.arange(len(pixels))
    if not len(pixels) or repeats[0]:  # of no pixel
        return None, place
    last = np.maximum.accumulate(np.where(repeats, -1, at))
    digit = np.where(repeats, at - last - 1, 0)
    counts = pixels[:, 3].astype(np.int64) << 8 * np.minimum(digit, 4)
    ends = np.cumsum(np.where(repeats, counts, 1))
    end = int(np.searchsorted(ends, width))
    if end == len(ends) or ends[end] != width:
        return None, place
    source = np.repeat(last[: end + 1], np.diff(ends[: end + 1], prepend=0))
    return pixels[source].T[None], place + 4 * (end + 1)


def _coded(
    data: bytes, numbers: Bytes, marker: bytes, place: int, most: int, width: int
) -> tuple[np.ndarray | None, int]:
    """Decode rows in new runs, up to `most`, or as many of them as follow each other here.

    All rows are walked at the same time, code by code, from all places that look like a beginning;
    only those that lie end to end are real.
    """
    most = min(most, max(1, _AT_ONCE // (4 * width)))
    starts, at, limit = [], place, place + _AT_ONCE
    while 0 <= at < limit and len(starts) < most:
        starts.append(at)
        at = data.find(marker, at + 1)
    codes, ends = _walk(numbers, np.array(starts) + 4, width)
    lane_at, chain = {start: lane for lane, start in enumerate(starts)}, []
    while len(chain) < most and (lane := lane_at.get(place)) is not None and ends[lane] >= 0:
        chain.append(lane)
        place = int(ends[lane])
    if not chain:
        return None, place
    row_of = np.full(len(starts), -1)
    row_of[chain] = np.arange(len(chain))
    return _expand(numbers, codes, row_of, len(chain), width), place


def _walk(
    numbers: Bytes, place: Int[np.ndarray, " n"], width: int
) -> tuple[list[tuple[np.ndarray, ...]], Int[np.ndarray, " n"]]:
    """Each step's codes (lane, column, first byte, length, is a run), and where lanes end or -1."""
    ends, lane, column, codes = np.full(len(place), -1), np.arange(len(place)), 0 * place, []
    while len(lane):
        code = numbers[np.minimum(place, len(numbers) - 1)].astype(np.int64)
        run = code > 128
        length = np.where(run, code - 128, code)
        after = place + np.where(run, 2, 1 + length)
        good = (length > 0) & (after <= len(numbers)) & (column % width + length <= width)
        lane, column, place, length, run, after = (
            x[good] for x in (lane, column, place, length, run, after)
        )
        codes.append((lane, column, place + 1, length, run))
        column, place = column + length, after
        done = column == 4 * width
        ends[lane[done]] = place[done]
        lane, column, place = (x[~done] for x in (lane, column, place))
    return codes, ends


def _expand(
    numbers: Bytes,
    codes: list[tuple[np.ndarray, ...]],
    row_of: Int[np.ndarray, " n"],
    rows: int,
    width: int,
) -> UInt8[np.ndarray, "rows 4 w"]:
    lane, column, first, length, run = (np.concatenate(each) for each in zip(*codes, strict=True))
    used = row_of[lane] >= 0
    begin = (row_of[lane] * 4 * width + column)[used]
    order = np.argsort(begin)
    begin, first, length, run = (x[order] for x in (begin, first[used], length[used], run[used]))
    # A literal's bytes lie one after the other, a run's all in one place.
    source = np.repeat(np.where(run, first, first - begin), length)
    source += np.where(np.repeat(run, length), 0, np.arange(len(source)))
    return numbers[source].reshape(rows, 4, width)
