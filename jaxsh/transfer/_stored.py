"""Transfer that stays on disk: opened, read block by block ahead of its use, or as a whole."""

import dataclasses
import functools
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import jax
import numpy as np
from jaxtyping import Array

from .._core.checks import as_path, check_choice, check_flag
from .._core.devices import Devices, last_of, mesh_of, own_numbers, place
from ..harmonics import degree_of
from ._store import BlockStore
from ._store_stream import stream
from ._surfaces import SurfaceKind
from ._transfer import Transfer

_ARRAYS = "coefficients", "positions", "normals", "neighbors"
_USUAL = {"surface": "vertices", "cosine": True}  # of a store that does not say


@dataclasses.dataclass(frozen=True)
class StoredTransfer:
    """Stands for the transfer in a store on disk, which may be larger than the memory.

    Made by `open`. `shade_diffuse`, `shade_glossy`, `fluence` and `compress` take it as they take a
    `Transfer`, and go through its blocks, the next of which is read while one is used; `blocks`
    does so for any other purpose. All other functions take the `Transfer` that `load` gives, or
    `sharded`.

    **Example**

    >>> import pathlib, tempfile
    >>> import jax.numpy as jnp
    >>> from jaxsh import geometry, transfer
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "knot.zarr"
    ...     baked = transfer.bake(geometry.knot(300), degree=1, directions=64, store=path)
    ...     stored = transfer.open(path)
    ...     colors = transfer.shade_diffuse(jnp.ones((3, 4)), stored, 0.5)
    >>> stored.num_points, stored.degree, type(colors).__name__, colors.shape
    (300, 1, 'ndarray', (300, 3))
    """

    path: Path
    num_points: int
    degree: int
    block_rows: int  # vertices in a block; the last may have fewer
    surface: SurfaceKind
    cosine: bool
    _store: BlockStore = dataclasses.field(repr=False, compare=False)

    @property
    def dtype(self) -> np.dtype:
        """The dtype of the colors that it shades: float32 where JAX's x64 is off."""
        return np.dtype(jax.dtypes.canonicalize_dtype(self._store.dtype))

    @property
    def kind(self) -> dict[str, Any]:
        """Give what tells a transfer of these points from others."""
        return {"surface": self.surface, "cosine": self.cosine}

    def blocks(self) -> Iterator[tuple[slice, Transfer]]:
        """Give each block with the vertices that it holds, the next being read meanwhile.

        Each is a `Transfer` of those vertices alone, on one of this process's devices in turn; its
        neighbors are numbered within the block, and one in another block is the vertex itself.
        Raises `ValueError` for a block that is missing or damaged.

        **Example**

        >>> import pathlib, tempfile
        >>> from jaxsh import geometry, transfer
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder) / "knot.zarr"
        ...     baked = transfer.bake(geometry.knot(300), degree=1, shadows=False, store=path)
        ...     counts = [part.num_points for _, part in transfer.open(path).blocks()]
        >>> counts
        [64, 64, 64, 64, 44]
        """

        def give(
            rows: slice, coefficients: Array, positions: Array, normals: Array, neighbors: Array
        ) -> tuple[slice, Transfer]:
            return rows, Transfer(coefficients, positions, normals, neighbors, **self.kind)

        yield from stream(self._store, _ARRAYS, give, keep=True)

    def load(self) -> Transfer:
        """Read the whole transfer into memory; raises `ValueError` for a damaged block."""
        arrays = (jax.device_put(self._store.whole(name)) for name in _ARRAYS)
        coefficients, positions, normals, neighbors = arrays
        return Transfer(coefficients, positions, normals, neighbors, **self.kind)

    def sharded(self, devices: Devices = None) -> Transfer:
        """Read the transfer shared out over devices, filled up as `Transfer.sharded` does.

        Each process reads what its own devices hold, one device after another, so that a transfer
        may be larger than the memory of each. Raises `ValueError` as `shard_rows` does, and for a
        damaged block.
        """
        mesh, count = mesh_of(devices), self.num_points
        last = {name: self._store.stretch(name, max(count - 1, 0), count) for name in _ARRAYS}
        fillings = {
            "positions": last_of(last["positions"]),
            "neighbors": own_numbers(last["neighbors"].shape[1]),
        }
        coefficients, positions, normals, neighbors = (
            place(
                functools.partial(self._store.stretch, name),
                (count, *last[name].shape[1:]),
                mesh,
                filling=fillings.get(name),
            )
            for name in _ARRAYS
        )
        return Transfer(coefficients, positions, normals, neighbors, **self.kind)


def open(path: str | os.PathLike[str]) -> StoredTransfer:
    """Open the store that `bake` or `bake_on` wrote, without reading the transfer itself.

    It is a Zarr 3 group of the arrays `coefficients` (V, K), `positions`, `normals` and `neighbors`
    of a `Transfer`, and `faces`, `unit_normals`, `origins` of rays and `albedo`, which bakes go on
    from; beside points that are not its vertices a mesh's `vertices`, `faces`, `normals` and
    `origins` in a group `occluder`. Each is in chunks of the same number of rows, those of the
    group of another, little-endian with a CRC-32C. Attributes say the format, its version (2 for
    points and texels, with what they are), the degree, the bake's arguments, fingerprints and all
    checksums, by which a chunk that took another's place is told.

    Raises `FileNotFoundError` where nothing is there, and `ValueError`, naming the path and the
    problem, for another thing, a newer version, and a bake that is not finished. Blocks whose bytes
    are wrong are found when they are read. Runs on the host.

    **Example**

    >>> import pathlib, tempfile
    >>> from jaxsh import geometry, transfer
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "knot.zarr"
    ...     baked = transfer.bake(geometry.knot(300), degree=1, shadows=False, store=path)
    ...     bool((transfer.open(path).load().coefficients == baked.coefficients).all())
    True
    """
    path = as_path(path).absolute()
    if not path.exists():
        raise FileNotFoundError(f"{path}: there is no such transfer store")
    if path.is_file():
        raise ValueError(f"{path}: not a transfer store, which is a folder: load reads files")
    store = BlockStore(path, read_only=True)
    store.check_rows(*_ARRAYS)
    for name in _ARRAYS:
        if missing := store.missing(name):
            raise ValueError(
                f"{path}: not finished: {len(missing)} of {store.num_blocks} blocks of {name} are "
                "missing or cut off; bake into it again with the same arguments"
            )
    surface, cosine = (store.attributes.get(name, usual) for name, usual in _USUAL.items())
    try:
        check_choice("surface", surface, get_args(SurfaceKind))
        check_flag("cosine", cosine)
    except ValueError as error:
        raise ValueError(f"{path}: damaged: {error}") from None
    return StoredTransfer(
        path=path,
        num_points=store.num_points,
        degree=degree_of(store.width),
        block_rows=store.block_rows,
        surface=surface,
        cosine=cosine,
        _store=store,
    )
