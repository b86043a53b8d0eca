"""Arrays on disk in blocks of rows: a Zarr group whose chunks are written whole, with a checksum.

A chunk is one file of little-endian numbers and their CRC-32C, and holds all columns of a block of
rows. So any reader of Zarr 3 reads the group, and a chunk that is missing, cut off or damaged is
told from one that is right.

A chunk that is right in itself may still be that of another block or store. So its checksum is kept
a second time: in a file of its own, as several processes may write at once, and among the
attributes once an array is complete.
"""

import contextlib
import functools
import math
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .._core.host import aligned
from .._core.words import reason
from ._store_files import SUM, put_beside, sum_of, written
from ._store_layout import checked, make_array, open_group

_SUMS = "sums"  # attribute: 8 hexadecimal digits a block, by array; also a folder in an array's


class DamagedError(ValueError):
    """Says which chunk of a store is missing or damaged."""


class BlockStore:
    """Reads and writes the arrays of a store that exists, block by block, from any process."""

    def __init__(self, path: Path, *, read_only: bool = False):
        self.path = path
        self._arrays: dict[str, Any] = {}
        self._read_only = read_only
        self._group, self.attributes = open_group(path, "r" if read_only else "r+")
        coefficients = self._array("coefficients")
        self.num_points, self.width = coefficients.shape
        self.block_rows: int = coefficients.chunks[0]
        self.num_blocks = -(-self.num_points // self.block_rows)

    def __reduce__(self):
        return functools.partial(type(self), read_only=self._read_only), (self.path,)

    @property
    def dtype(self) -> np.dtype:
        return self._array("coefficients").dtype

    def rows(self, block: int, name: str = "coefficients") -> slice:
        """Tell which rows of an array a block holds."""
        array = self._array(name)
        start = block * array.chunks[0]
        return slice(start, min(start + array.chunks[0], array.shape[0]))

    def blocks(self, name: str) -> int:
        """Count the blocks of an array."""
        return _blocks(self._array(name))

    def missing(self, name: str = "coefficients", *, check: bool = False) -> list[int]:
        """List the blocks of an array that are not there in full.

        With `check` also those whose checksum is wrong, which takes reading them all.
        """
        array, room, found = self._array(name), self.room(name), []
        for block in range(_blocks(array)):
            try:
                right = self._file(name, block).stat().st_size == _bytes(array)
                if right and check:
                    self.read(name, block, room)
            except (OSError, DamagedError):
                right = False
            if not right:
                found.append(block)
        return found

    def room(self, name: str) -> np.ndarray:
        """Make room for a block of an array with its checksum."""
        return aligned((_bytes(self._array(name)),), np.uint8)

    def read(self, name: str, block: int, room: np.ndarray | None = None) -> np.ndarray:
        """Read one block, read-only; raises `DamagedError` where it is not right, or another.

        It lies in memory of its own, or in what `room` gave.
        """
        # In one go, to where JAX takes it without a copy. Zarr's own reading copies more often, and
        # copies are most of what a stream of blocks takes.
        from google_crc32c import value as crc32c

        array, file = self._array(name), self._file(name, block)
        rows = min(array.chunks[0], array.shape[0] - block * array.chunks[0])
        if not array.size:
            return np.empty((rows, *array.shape[1:]), array.dtype)
        data = (self.room(name) if room is None else room)[:]
        try:
            with file.open("rb", buffering=0) as opened:
                whole = opened.readinto(data.data) == data.size and not opened.read(1)
        except FileNotFoundError:
            raise DamagedError(self._problem(file, "missing")) from None
        except OSError as error:
            problem = f"not readable ({reason(error)})"
            raise DamagedError(self._problem(file, problem)) from error
        data.setflags(write=False)
        numbers, expected = data[:-SUM], data[-SUM:]
        if not whole or crc32c(numbers) != int.from_bytes(expected, "little"):
            raise DamagedError(self._problem(file, "damaged"))
        if not self._known(name, block, expected.tobytes()):
            raise DamagedError(self._problem(file, "not what was written there"))
        stored = numbers.view(array.dtype.newbyteorder("<")).reshape(array.chunks)
        return stored[:rows].astype(array.dtype, copy=False)

    def whole(self, name: str) -> np.ndarray:
        """Read an array; raises `DamagedError` for the first block that is not right."""
        array, room = self._array(name), self.room(name)
        result, size = aligned(array.shape, array.dtype), array.chunks[0]
        for block in range(_blocks(array)):
            result[block * size : (block + 1) * size] = self.read(name, block, room)
        return result

    def stretch(self, name: str, start: int, stop: int) -> np.ndarray:
        """Read the vertices from one to another; raises `DamagedError` as `read` does."""
        array = self._array(name)
        size = array.chunks[0]
        parts = [np.empty((0, *array.shape[1:]), array.dtype)]
        for block in range(start // size, -(-stop // size) if stop > start else 0):
            first = block * size
            parts.append(self.read(name, block)[max(start - first, 0) : stop - first])
        return np.concatenate(parts)

    def write(self, name: str, block: int, values: np.ndarray) -> None:
        """Write one block: its file is there whole, or not at all.

        After a power cut a file may be there without its bytes, which its checksum tells.
        """
        checksum = self._write(name, block, values)
        with written(self._file(name, block)):
            put_beside(self._sum_file(name, block), checksum)

    def put(self, **arrays: np.ndarray) -> None:
        """Write complete arrays, but the blocks that are there and right already."""
        changed = {}
        for name, values in arrays.items():
            size, missing = self._array(name).chunks[0], self.missing(name, check=True)
            sums = [self._complete(name, block) for block in range(_blocks(self._array(name)))]
            for block in missing:
                sums[block] = self._write(name, block, values[block * size : (block + 1) * size])
            if missing:
                changed[name] = b"".join(sums).hex()
        if changed:
            self._record(changed, {})

    def add(
        self, later: dict[str, tuple[tuple[int, ...], np.dtype]], apart: dict[str, int]
    ) -> None:
        """Make room for those arrays, of shapes and dtypes, that are not there.

        Those `apart` have blocks of as many rows as it says. Raises `ValueError` where one is of
        another shape or dtype.
        """
        with written(self.path):
            for name, (shape, dtype) in later.items():
                if name not in self._group:
                    rows = apart.get(name, self.block_rows)
                    make_array(self._group, name, shape, dtype, rows)
        for name, expected in later.items():
            array = self._array(name)
            if (array.shape, array.dtype) != expected:
                raise ValueError(
                    f"{self.path}: damaged: {name} should be {expected[1]} of shape {expected[0]}, "
                    f"and are {array.dtype} of shape {array.shape}"
                )

    def check_rows(self, *names: str) -> None:
        """Raise `ValueError` unless arrays have one row for each vertex, in the same blocks."""
        for name in names:
            array = self._array(name)
            if (array.shape[0], array.chunks[0]) != (self.num_points, self.block_rows):
                raise ValueError(
                    f"{self.path}: damaged: {name} are {array.shape[0]} rows in blocks of "
                    f"{array.chunks[0]}, coefficients {self.num_points} in blocks of "
                    f"{self.block_rows}"
                )

    def settle(self, *names: str, **values: Any) -> None:
        """Record the checksums of arrays that are complete, and other attributes.

        Raises `DamagedError` where a block was lost since it was written.
        """
        sums = {}
        for name in names:
            found = []
            for block in range(_blocks(self._array(name))):
                file = self._file(name, block)
                try:
                    found.append(sum_of(file))
                except OSError:
                    raise DamagedError(self._problem(file, "missing")) from None
                if not self._known(name, block, found[-1]):
                    raise DamagedError(self._problem(file, "not what was written there"))
            sums[name] = b"".join(found).hex()
        self._record(sums, values)
        self.drop(*(f"{name}/{_SUMS}" for name in names))

    def tidy(self, name: str) -> None:
        """Finish what `settle` was stopped at."""
        if (self.path / name / _SUMS).exists():
            self.settle(name)

    def drop(self, *names: str) -> None:
        """Delete arrays or groups, and what writers that were killed have left behind."""
        for name in names:
            shutil.rmtree(self.path / name, ignore_errors=True)
            self._arrays = {
                known: array for known, array in self._arrays.items() if not known.startswith(name)
            }
        for left in self.path.rglob("*.partial"):
            with contextlib.suppress(OSError):
                left.unlink()

    def _known(self, name: str, block: int, checksum: bytes) -> bool:
        """Tell whether a block that was written here has a checksum."""
        if checksum in self._sums(name, block):
            return True
        _, self.attributes = open_group(self.path, "r")  # as another process may have finished
        return checksum in self._sums(name, block)

    def _sums(self, name: str, block: int) -> Iterator[bytes]:
        """Give the checksums that a block may have: of the complete array, and written since."""
        yield self._complete(name, block)
        with contextlib.suppress(OSError):
            yield self._sum_file(name, block).read_bytes()

    def _complete(self, name: str, block: int) -> bytes:
        try:
            digits = _sums_in(self.attributes)[name]
            return bytes.fromhex(digits[2 * SUM * block : 2 * SUM * (block + 1)])
        except (KeyError, TypeError, ValueError):  # not complete yet, or damaged
            return b""

    def _record(self, sums: dict[str, str], values: dict[str, Any]) -> None:
        _, now = open_group(self.path, "r")  # another process may have been here meanwhile
        values = values | {_SUMS: _sums_in(now) | sums}
        with written(self.path):
            self._group.attrs.update(values)
        self.attributes = now | values

    def _write(self, name: str, block: int, values: np.ndarray) -> bytes:
        array, file = self._array(name), self._file(name, block)
        part = slice(block * array.chunks[0], block * array.chunks[0] + len(values))
        with written(file):
            try:
                array[part] = values
            except FileNotFoundError:  # another process finished, and dropped what is half written
                array[part] = values
            return sum_of(file)

    def _sum_file(self, name: str, block: int) -> Path:
        return self.path.joinpath(name, _SUMS, str(block))

    def _array(self, name: str) -> Any:
        if name not in self._arrays:
            self._arrays[name] = checked(self.path, self._group, name)
        return self._arrays[name]

    def _file(self, name: str, block: int) -> Path:
        tail = ["0"] * (self._array(name).ndim - 1)
        return self.path.joinpath(name, "c", str(block), *tail)

    def _problem(self, file: Path, what: str) -> str:
        return f"{self.path}: {file.relative_to(self.path)} is {what}: bake into it again"


def _sums_in(attributes: dict[str, Any]) -> dict[str, Any]:
    sums = attributes.get(_SUMS)
    return sums if isinstance(sums, dict) else {}


def _blocks(array: Any) -> int:
    return -(-array.shape[0] // array.chunks[0]) if array.size else 0


def _bytes(array: Any) -> int:
    """Give the size of a chunk's file; the last chunk is filled up."""
    return math.prod(array.chunks) * array.dtype.itemsize + SUM
