"""Arrays on disk in blocks of rows: a Zarr group whose chunks are written whole, with a checksum.

A chunk is one file of little-endian numbers and their CRC-32C, and holds all columns of a block of
rows. So any reader of Zarr 3 reads the group, and a chunk that is missing, cut off or damaged is
told from one that is right without any record of what has been written: several processes may
write at once.
"""

import contextlib
import functools
import math
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .._core.host import aligned
from .._core.words import reason

FORMAT, VERSION = "jaxsh transfer store", 1
# Rows of a block: about a hundredth of the mesh, so that little is lost when a bake is stopped, and
# a power of two, so that it is whole tiles of the bake. With more a task of a cluster would take
# too long, with fewer the opening of files would show.
_PARTS, _FEWEST, _MOST = 128, 64, 32_768
_SUM = 4  # bytes of a chunk's checksum


class DamagedError(ValueError):
    """Says which chunk of a store is missing or damaged."""


def block_rows(count: int) -> int:
    """Choose how many vertices of `count` a block holds: nothing else may decide it."""
    wanted = 1 << max(-(-count // _PARTS) - 1, 0).bit_length()
    return min(max(wanted, _FEWEST), _MOST)


class BlockStore:
    """Reads and writes the arrays of a store that exists, block by block, from any process."""

    def __init__(self, path: Path, *, read_only: bool = False):
        self.path = path
        self._arrays: dict[str, Any] = {}
        self._read_only = read_only
        self._group, self.attributes = _opened(path, "r" if read_only else "r+")
        coefficients = self._array("coefficients")
        self.num_points, self.width = coefficients.shape
        self.block_rows: int = coefficients.chunks[0]
        self.num_blocks = -(-self.num_points // self.block_rows)

    def __reduce__(self):
        return functools.partial(type(self), read_only=self._read_only), (self.path,)

    @property
    def dtype(self) -> np.dtype:
        return self._array("coefficients").dtype

    def rows(self, block: int) -> slice:
        """Tell which vertices a block holds."""
        start = block * self.block_rows
        return slice(start, min(start + self.block_rows, self.num_points))

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
        """Read one block, read-only; raises `DamagedError` where it is not right.

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
        data.setflags(write=False)
        numbers, expected = data[:-_SUM], data[-_SUM:]
        if not whole or crc32c(numbers) != int.from_bytes(expected, "little"):
            raise DamagedError(self._problem(file, "damaged"))
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
        array = self._array(name)
        first = block * array.chunks[0]
        with _written(self._file(name, block)):
            array[first : first + len(values)] = values

    def put(self, name: str, values: np.ndarray) -> None:
        """Write an array's blocks, those that are there and right already excepted."""
        size = self._array(name).chunks[0]
        for block in self.missing(name, check=True):
            self.write(name, block, values[block * size : (block + 1) * size])

    def add(self, later: dict[str, tuple[tuple[int, ...], np.dtype]]) -> None:
        """Make room for those arrays, of shapes and dtypes, that are not there."""
        with _written(self.path):
            for name, (shape, dtype) in later.items():
                if name not in self._group:
                    _make_array(self._group, name, shape, dtype, self.block_rows)

    def record(self, **values: Any) -> None:
        """Add to the attributes."""
        with _written(self.path):
            self._group.attrs.update(values)
        self.attributes |= values

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

    def _array(self, name: str) -> Any:
        if name not in self._arrays:
            self._arrays[name] = _checked(self.path, self._group, name)
        return self._arrays[name]

    def _file(self, name: str, block: int) -> Path:
        tail = ["0"] * (self._array(name).ndim - 1)
        return self.path.joinpath(name, "c", str(block), *tail)

    def _problem(self, file: Path, what: str) -> str:
        return f"{self.path}: {file.relative_to(self.path)} is {what}: bake into it again"


def make(
    path: Path,
    arrays: dict[str, np.ndarray],
    later: dict[str, tuple[tuple[int, ...], np.dtype]],
    rows: int,
    attributes: dict[str, Any],
) -> BlockStore:
    """Write a store, which is put in its place complete, and open it.

    Of the arrays `later` only shapes and dtypes are known yet. Raises `OSError` where the store
    cannot be written.
    """
    import zarr

    temporary = path.with_name(f".{path.name}.{os.getpid()}.partial")
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        group = zarr.create_group(temporary, overwrite=True)
        for name, array in arrays.items():
            _make_array(group, name, array.shape, array.dtype, rows)
        for name, (shape, dtype) in later.items():
            _make_array(group, name, shape, dtype, rows)
        group.attrs.update({"format": FORMAT, "version": VERSION} | attributes)
        store = BlockStore(temporary)
        for name, array in arrays.items():
            store.put(name, array)
        temporary.replace(path)
    except OSError as error:
        first = error.__cause__ if isinstance(error.__cause__, OSError) else error
        raise _like(first, f"{path}: cannot be written: {reason(first)}") from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return BlockStore(path)


def _make_array(group: Any, name: str, shape: tuple[int, ...], dtype: np.dtype, rows: int) -> None:
    from zarr.codecs import BytesCodec, Crc32cCodec

    group.create_array(
        name,
        shape=shape,
        dtype=dtype,
        chunks=_chunks(shape, rows),
        serializer=BytesCodec(endian="little"),
        compressors=[Crc32cCodec()],
        filters=None,
        # What other readers of Zarr see where a chunk is missing: never what a bake could give.
        fill_value=float("nan") if dtype.kind == "f" else -1,
    )


def _chunks(shape: tuple[int, ...], rows: int) -> tuple[int, ...]:
    return (rows, *(max(size, 1) for size in shape[1:]))


def _opened(path: Path, mode: Any) -> tuple[Any, dict[str, Any]]:
    """Open the group of a store; raises `ValueError` for another thing or version."""
    import zarr

    try:
        group = zarr.open_group(path, mode=mode, zarr_format=3)
        attributes = dict(group.attrs)
    except Exception as error:  # damaged metadata may raise anything
        raise ValueError(f"{path}: not a transfer store; it is left as it is") from error
    if attributes.get("format") != FORMAT:
        raise ValueError(f"{path}: not a transfer store; it is left as it is")
    version = attributes.get("version")
    if version != VERSION:
        said = reason(str(version), 40)
        raise ValueError(f"{path}: written as version {said}, but this jaxsh reads {VERSION}")
    return group, attributes


def _checked(path: Path, group: Any, name: str) -> Any:
    """Find an array of a store; raises `ValueError` unless it is stored as `make` does."""
    try:
        array = group[name]
        codecs = [type(codec).__name__ for codec in array.metadata.codecs]
    except Exception as error:  # damaged metadata may raise anything
        raise ValueError(f"{path}: damaged: it holds no {name}: {reason(error)}") from error
    if codecs != ["BytesCodec", "Crc32cCodec"] or array.chunks != _chunks(
        array.shape, array.chunks[0]
    ):
        raise ValueError(f"{path}: {name} are not in the chunks that jaxsh writes")
    return array


@contextlib.contextmanager
def _written(path: Path) -> Iterator[None]:
    """Say what could not be written."""
    try:
        yield
    except OSError as error:
        raise _like(
            error,
            f"{path}: cannot be written: {reason(error)}; the blocks that are finished are kept, "
            "and the same call goes on from them",
        ) from error


def _like(error: OSError, said: str) -> OSError:
    return OSError(said) if error.errno is None else OSError(error.errno, said)


def _blocks(array: Any) -> int:
    return -(-array.shape[0] // array.chunks[0]) if array.size else 0


def _bytes(array: Any) -> int:
    """Give the size of a chunk's file; the last chunk is filled up."""
    return math.prod(array.chunks) * array.dtype.itemsize + _SUM
