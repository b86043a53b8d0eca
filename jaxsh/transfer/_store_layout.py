"""The layout of a store in Zarr: how arrays are made, and what is taken for one of ours."""

from pathlib import Path
from typing import Any

import numpy as np

from .._core.words import reason

FORMAT = "jaxsh transfer store"
# Version 1 is of vertices with the cosine, and what those are written as; 2 of any points.
VERSIONS = 1, 2


def make_array(group: Any, name: str, shape: tuple[int, ...], dtype: np.dtype, rows: int) -> None:
    """Add an array to a group, in chunks of so many rows."""
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


def open_group(path: Path, mode: Any) -> tuple[Any, dict[str, Any]]:
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
    if type(version) is not int or version not in VERSIONS:
        said = reason(str(version), 40)
        raise ValueError(
            f"{path}: written as version {said}, but this jaxsh reads 1 and {VERSIONS[-1]}"
        )
    return group, attributes


def checked(path: Path, group: Any, name: str) -> Any:
    """Find an array of a store; raises `ValueError` unless it is stored as `make` does."""
    try:
        array = group[name]
        codecs = [type(codec).__name__ for codec in array.metadata.codecs]
    except Exception as error:  # damaged metadata may raise anything
        raise ValueError(f"{path}: damaged: it holds no {name}: {reason(error)}") from error
    rows = array.chunks[0] if array.chunks else 0
    if (
        codecs != ["BytesCodec", "Crc32cCodec"]
        or not rows
        or array.chunks != _chunks(array.shape, rows)
    ):
        raise ValueError(f"{path}: {name} are not in the chunks that jaxsh writes")
    return array
