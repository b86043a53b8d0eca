"""Checkpoint file of a bake: a line that identifies the bake, one record per finished tile."""

import hashlib
import json
import os
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Array, Shaped

from ..._core.words import reason

_FORMAT = {"format": "jaxsh bake checkpoint", "version": 1}


class Checkpoint:
    """Keeps tiles of one shape and dtype in a file, in order of their number.

    Each has a checksum, so that one cut off half-way counts as missing. Nothing but the file
    remembers how many there are.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        identity: dict[str, Any],
        shape: tuple[int, int],
        dtype: np.dtype,
    ):
        self._path = Path(path)
        self._shape, self._dtype = shape, dtype
        header = json.dumps(_FORMAT | identity).encode() + b"\n"
        if not self._path.exists():
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._path.write_bytes(header)
        _check(self._path, _FORMAT | identity)
        self._start = len(header)

    def read(self, first: int, count: int) -> Shaped[np.ndarray, "tiles rows k"]:
        """Return those of `count` tiles that are finished, from number `first` on.

        At a missing or damaged one it stops, and cuts the file off there, so that the next tile
        appended has that number.
        """
        size = int(np.prod(self._shape)) * self._dtype.itemsize
        tiles = []
        with self._path.open("r+b") as file:
            file.seek(self._start + first * (size + 4))
            while len(tiles) < count:
                record = file.read(size + 4)
                if zlib.crc32(record[:size]).to_bytes(4, "little") != record[size:]:
                    file.truncate(self._start + (first + len(tiles)) * (size + 4))
                    break
                tiles.append(np.frombuffer(record[:size], self._dtype).reshape(self._shape))
        return np.array(tiles, self._dtype).reshape(-1, *self._shape)

    def append(self, tiles: np.ndarray) -> None:
        """Append finished tiles; they are on disk before this returns."""
        with self._path.open("ab") as file:
            for tile in tiles:
                data = tile.tobytes()
                file.write(data + zlib.crc32(data).to_bytes(4, "little"))
            file.flush()
            os.fsync(file.fileno())

    def remove(self) -> None:
        self._path.unlink()


def fingerprint(*arrays: Array | np.ndarray) -> str:
    """Hash dtypes, shapes and bits of arrays to hexadecimal digits."""
    digest = hashlib.sha256()
    for array in map(np.asarray, arrays):
        digest.update(f"{array.dtype}{array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:16]


def _check(path: Path, expected: dict[str, Any]) -> None:
    with path.open("rb") as file:
        line = file.readline(10_000)
    try:
        found = json.loads(line)
        known = found["format"] == expected["format"] and line.endswith(b"\n")
    except (ValueError, TypeError, KeyError, RecursionError):
        known, found = False, {}
    if not known:
        raise ValueError(f"{path}: not the checkpoint of a bake; it is left as it is")
    for name, value in expected.items():
        if found.get(name) != value:
            said = reason(str(found.get(name)))
            raise ValueError(
                f"{path}: the checkpoint of another bake: its {name} is {said}, and "
                f"{value} here; it is left as it is"
            )
