"""The file of a bake under way: a line that says which bake, then one record per finished tile."""

import hashlib
import json
import os
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Array

_FORMAT = {"format": "jaxsh bake checkpoint", "version": 1}


class Checkpoint:
    """Tiles of one shape and dtype, appended in order; each with a checksum, so that one cut off
    half-way counts as not there.
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

    def read(self) -> list[np.ndarray]:
        """The tiles finished so far; what follows them is cut off."""
        size = int(np.prod(self._shape)) * self._dtype.itemsize
        tiles = []
        with self._path.open("r+b") as file:
            file.seek(self._start)
            while len(record := file.read(size + 4)) == size + 4:
                if zlib.crc32(record[:size]).to_bytes(4, "little") != record[size:]:
                    break
                tiles.append(np.frombuffer(record[:size], self._dtype).reshape(self._shape))
            file.truncate(self._start + len(tiles) * (size + 4))
        return tiles

    def append(self, tiles: np.ndarray) -> None:
        """Add finished tiles; they are on disk before this returns."""
        with self._path.open("ab") as file:
            for tile in tiles:
                data = tile.tobytes()
                file.write(data + zlib.crc32(data).to_bytes(4, "little"))
            file.flush()
            os.fsync(file.fileno())

    def remove(self) -> None:
        self._path.unlink()


def fingerprint(*arrays: Array | np.ndarray) -> str:
    """Hexadecimal digits that tell arrays from others."""
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
            raise ValueError(
                f"{path}: the checkpoint of another bake: its {name} is {found.get(name)}, and "
                f"{value} here; it is left as it is"
            )
