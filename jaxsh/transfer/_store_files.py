"""Files of a store: checksums of its chunks, and what is said where one cannot be written."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from .._core.words import reason

SUM = 4  # bytes of a chunk's checksum


@contextlib.contextmanager
def written(path: Path) -> Iterator[None]:
    """Say what could not be written."""
    try:
        yield
    except OSError as error:
        raise like(
            error,
            f"{path}: cannot be written: {reason(error)}; the blocks that are finished are kept, "
            "and the same call goes on from them",
        ) from error


def sum_of(file: Path) -> bytes:
    """Read the checksum at the end of a chunk's file."""
    with file.open("rb") as opened:
        opened.seek(-SUM, os.SEEK_END)
        return opened.read()


def put_beside(file: Path, content: bytes) -> None:
    """Write a small file into a folder that another process may delete at any time."""
    for last in (False, True):
        try:
            file.parent.mkdir(exist_ok=True)
            file.write_bytes(content)
            return
        except FileNotFoundError:
            if last:
                raise


def like(error: OSError, said: str) -> OSError:
    """Make an error of the same number that says something else."""
    return OSError(said) if error.errno is None else OSError(error.errno, said)
