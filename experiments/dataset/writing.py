"""Files of a dataset: each in its place once it is whole, so that a run goes on after another."""

import contextlib
import json
import os
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from jaxsh import imaging

from ..runner import UserError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

ABOUT = "dataset.json"
# Pictures that wait to be written, for each thread.
_WAITING = 4


def picture(path: Path, image: Any) -> int:
    """Write a picture beside its place and move it there; its size in bytes."""
    part = path.with_name(f"{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        imaging.write_image(part, np.asarray(image))
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    return path.stat().st_size


def _as_text(content: Any) -> str:
    """Say content as JSON."""
    return json.dumps(content, indent=1) + "\n"


def words(path: Path, content: Any) -> None:
    """Write JSON, put in place when it is whole."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    part.write_text(_as_text(content), encoding="utf-8")
    part.replace(path)


@contextlib.contextmanager
def claimed(folder: Path, about: dict[str, Any]) -> Iterator[None]:
    """Hold a folder for a dataset: a new one, or one of the same settings that a run has left.

    Raises `UserError` for anything else, which stays as it is, and where another run holds it
    (where system and file system have locks of files that end with the process; Windows has none).
    """
    path = folder / ABOUT
    if folder.exists() and not folder.is_dir():
        raise UserError(f"{str(folder)!r} is a file: choose another --folder")
    folder.mkdir(parents=True, exist_ok=True)
    others = any(".part" not in entry.name for entry in folder.iterdir())
    if others and not path.exists():  # in this order: another run may just have begun
        raise UserError(f"{str(folder)!r} holds no dataset: move it or choose --folder")
    # Made if need be and written once it is held, never replaced: of runs that start together all
    # open one file. NFS locks only what may be written.
    with open(path, "a+", encoding="utf-8") as file:
        if fcntl:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                busy = f"another run is making {str(folder)!r}: wait for it or choose --folder"
                raise UserError(busy) from error
            except OSError:  # a file system without locks
                pass
        file.seek(0)
        if found := file.read():
            _check_same(folder, found, about)
        else:
            file.write(_as_text(about))
            file.flush()
        for part in folder.rglob("*.part*"):  # of a run that was killed
            part.unlink(missing_ok=True)
        yield


def _check_same(folder: Path, text: str, about: dict[str, Any]) -> None:
    """Raises `UserError` unless a folder's dataset is of these settings."""
    try:
        found = json.loads(text)
    except ValueError as error:
        raise UserError(f"{folder / ABOUT}: no JSON ({error})") from error
    found, wanted = _flat(found), _flat(json.loads(json.dumps(about)))
    other = [key for key in wanted if found.get(key) != wanted[key]]
    if other or len(found) != len(wanted):
        raise UserError(
            f"{str(folder)!r} holds a dataset of other settings ({', '.join(other)}): choose "
            "--folder, or move it"
        )


def _flat(about: Any) -> dict[str, Any]:
    """What is said, with settings and digests one by one."""
    if not isinstance(about, dict):
        return {}
    found = {key: value for key, value in about.items() if not isinstance(value, dict)}
    for group, name in (("settings", "{}"), ("digests", "what {} holds")):
        parts = about.get(group)
        for key, value in (parts if isinstance(parts, dict) else {}).items():
            found[name.format(key)] = value
    return found


class Writer:
    """Writes pictures on threads, a few at a time: who gives one more waits for the first."""

    def __init__(self, pool: ThreadPoolExecutor, threads: int):
        self._pool, self._most = pool, _WAITING * threads
        self._waiting: deque[Future[int]] = deque()
        self.size = 0

    def write(self, path: Path, image: Any) -> None:
        """Write a picture, which may still be in the making, on a thread."""
        while len(self._waiting) >= self._most:
            self.size += self._waiting.popleft().result()
        self._waiting.append(self._pool.submit(picture, path, image))

    def finish(self) -> None:
        """Wait for all."""
        while self._waiting:
            self.size += self._waiting.popleft().result()


@contextlib.contextmanager
def writer(threads: int) -> Iterator[Writer]:
    """A writer whose pictures are all in place at the end, where nothing failed."""
    pool = ThreadPoolExecutor(threads)
    try:
        written = Writer(pool, threads)
        yield written
        written.finish()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
