"""Making a store: complete beside its place, then moved there, so that none is there by half."""

import contextlib
import os
import shutil
import socket
import uuid
from pathlib import Path
from typing import Any

import numpy as np

from .._core.words import reason
from ._store import BlockStore
from ._store_files import like
from ._store_layout import FORMAT, VERSIONS, make_array

# Rows of a block: about a hundredth of the mesh, so that little is lost when a bake is stopped, and
# a power of two, so that it is whole tiles of the bake. With more a task of a cluster would take
# too long, with fewer the opening of files would show.
_PARTS, _FEWEST, _MOST = 128, 64, 32_768


def block_rows(count: int) -> int:
    """Choose how many vertices of `count` a block holds: nothing else may decide it."""
    wanted = 1 << max(-(-count // _PARTS) - 1, 0).bit_length()
    return min(max(wanted, _FEWEST), _MOST)


def make(
    path: Path,
    arrays: dict[str, np.ndarray],
    later: dict[str, tuple[tuple[int, ...], np.dtype]],
    rows: int,
    attributes: dict[str, Any],
    apart: dict[str, int],
) -> bool:
    """Write a store, which is put in its place complete, unless another process was faster.

    Of the arrays `later` only shapes and dtypes are known yet. All are in blocks of `rows`, but
    those `apart`, for which it says how many. Returns whether this is the store
    that is there now. Raises `OSError` where it cannot be written.
    """
    import zarr

    path = path.resolve()  # a link stays one
    sweep(path)
    by = f"{socket.gethostname()}-{os.getpid()}-{uuid.uuid4().hex}"
    temporary = path.with_name(f".{path.name}.{by}.partial")
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        group = zarr.create_group(temporary, overwrite=True)
        for name, array in arrays.items():
            make_array(group, name, array.shape, array.dtype, apart.get(name, rows))
        for name, (shape, dtype) in later.items():
            make_array(group, name, shape, dtype, apart.get(name, rows))
        version = VERSIONS["surface" in attributes]
        group.attrs.update({"format": FORMAT, "version": version} | attributes)
        store = BlockStore(temporary)
        store.put(**arrays)
        try:
            temporary.replace(path)
        except OSError:
            if not (path / "zarr.json").exists():
                raise
            return False
    except OSError as error:
        first = error.__cause__ if isinstance(error.__cause__, OSError) else error
        raise like(first, f"{path}: cannot be written: {reason(first)}") from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return True


def sweep(path: Path) -> None:
    """Delete what processes of this machine that were killed in `make` have left beside a path."""
    path, found = path.resolve(), []
    start = f".{path.name}.{socket.gethostname()}-"
    if os.name == "posix":
        with contextlib.suppress(OSError):
            found = [left for left in path.parent.iterdir() if left.name.startswith(start)]
    for left in found:
        try:
            os.kill(int(left.name[len(start) :].partition("-")[0]), 0)  # asks whether it lives
        except ProcessLookupError:
            shutil.rmtree(left, ignore_errors=True)
        except (OSError, ValueError, OverflowError):
            pass
