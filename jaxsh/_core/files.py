"""Put files in their place once they are complete."""

import contextlib
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import BinaryIO

from .words import reason

Content = bytes | Callable[[BinaryIO], object]


def check_place(path: Path) -> None:
    """Raise `IsADirectoryError` where a folder stands in the place of a file to be written."""
    if path.is_dir():
        raise IsADirectoryError(f"{path}: cannot be written: it is a folder")


def put_in_place(files: Mapping[Path, Content]) -> None:
    """Write files, given as bytes or as what writes into an open file: all of them, or none.

    Makes missing folders. Existing files are replaced, in the order given, once the new ones are
    complete. Raises `OSError`, of the kind that the system gave, where a file cannot be written.
    """
    unfinished = {path: path.with_name(f"{path.name}.{os.getpid()}.tmp") for path in files}
    path = None
    try:
        for path, content in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            if isinstance(content, bytes):
                unfinished[path].write_bytes(content)
                continue
            with unfinished[path].open("wb") as file:
                content(file)
        for path, temporary in unfinished.items():
            temporary.replace(path)
    except OSError as error:
        # The system names what was to become the file, and numbers its reasons.
        why = error.strerror or reason(error)
        if isinstance(error, FileExistsError | NotADirectoryError):
            text = f"{path}: cannot be written: a file stands in the place of a folder"
            raise NotADirectoryError(text) from error
        raise type(error)(f"{path}: cannot be written: {why}") from error
    finally:
        for temporary in unfinished.values():
            with contextlib.suppress(OSError):  # below what is no folder, or in one without rights
                temporary.unlink(missing_ok=True)
