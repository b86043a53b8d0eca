"""Read the accessors of a glTF file: views of bytes as arrays, sparse or not."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Integer, Shaped

from ..._core.gltf import Document
from ..._core.json_fields import Fields, extension, flag, inner, shown, text, whole
from ._gltf_meshopt import unpack

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_UNSIGNED = {5121, 5123, 5125}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
# Elements that an accessor may announce without storing them: zeros, but for its sparse part.
_MOST_UNSTORED = 2**20


class Accessor(NamedTuple):
    """Holds the elements of an accessor as stored, mostly a view of the file's own bytes."""

    raw: Shaped[np.ndarray, "n k"]
    normalized: bool = False

    def rows(self, which: Integer[np.ndarray, " m"]) -> Float[np.ndarray, "m k"]:
        """Take rows in float64, normalized integers as [0, 1] or [-1, 1]."""
        values = self.raw[which].astype(np.float64)
        if self.normalized and self.raw.dtype.kind in "iu":
            values /= np.iinfo(self.raw.dtype).max
            np.maximum(values, -1, out=values)
        return values

    def all(self) -> Float[np.ndarray, "n k"]:
        """Take all rows, as `rows` does."""
        return self.rows(np.arange(len(self.raw)))


def read_accessor(document: Document, index: int, owner: str, types: tuple[str, ...]) -> Accessor:
    """Read an accessor that should be of one of the `types`, such as "VEC3".

    Bounds are checked before anything is allocated; `min` and `max` are not looked at.
    """
    fields, name = document.item("accessors", index, owner), f"accessor {index}"
    kind = text(fields, "type", name)
    if kind not in types:
        raise ValueError(f"{owner} should be {' or '.join(types)}, but {name} is {shown(kind)}")
    dtype, width = _component(fields, name), WIDTHS[kind]
    count = whole(fields, "count", name)
    sparse = inner(fields, "sparse", name)
    if fields.get("bufferView") is not None:
        raw = _strided(document, fields, name, dtype, count, width)
    else:
        if count > _MOST_UNSTORED + document.size:
            raise ValueError(
                f"{name} announces {shown(count)} elements without a bufferView, out of "
                f"proportion to the file's {document.size} bytes"
            )
        raw = np.broadcast_to(np.zeros(width, dtype), (count, width))
    if sparse:
        if index not in document.sparse:
            document.spend(count * width)
            document.sparse[index] = _with_sparse(document, raw, sparse, name)
        raw = document.sparse[index]
    return Accessor(raw, flag(fields, "normalized", name))


def read_indices(document: Document, index: int, owner: str) -> Integer[np.ndarray, " n"]:
    """Read the vertex indices of a primitive, as stored."""
    raw = read_accessor(document, index, owner, ("SCALAR",)).raw[:, 0]
    if raw.dtype.kind != "u":
        raise ValueError(f"{owner} should be of an unsigned type, but accessor {index} is not")
    return raw


def view_bytes(document: Document, index: int, owner: str) -> tuple[memoryview, int]:
    """Give the bytes of a bufferView, decompressed where they are, and its stride (0: none)."""
    fields, name = document.item("bufferViews", index, owner), f"bufferView {index}"
    stride = whole(fields, "byteStride", name, 0)
    for compression in ("KHR_meshopt_compression", "EXT_meshopt_compression"):
        packed = extension(fields, compression, name)
        if packed is not None:
            if index not in document.views:
                title = f"{compression} of {name}"
                source = _slice(document, packed, title)
                document.views[index] = unpack(document, source, packed, title)
            return document.views[index], stride
    return _slice(document, fields, name), stride


def _slice(document: Document, fields: Fields, name: str) -> memoryview:
    number = whole(fields, "buffer", name)
    buffer = document.buffer(number, name)
    start, length = whole(fields, "byteOffset", name, 0), whole(fields, "byteLength", name)
    if start + length > len(buffer):
        raise ValueError(
            f"{name} needs bytes {shown(start)} to {shown(start + length)} of buffer {number}, "
            f"which has {len(buffer)}"
        )
    return buffer[start : start + length]


def _component(fields: Fields, name: str) -> np.dtype:
    code = whole(fields, "componentType", name)
    if code not in _COMPONENTS:
        raise ValueError(f"{name} has components of type {shown(code)}, which glTF 2 does not know")
    return np.dtype(_COMPONENTS[code])


def _strided(
    document: Document, fields: Fields, name: str, dtype: np.dtype, count: int, width: int
) -> Shaped[np.ndarray, "n k"]:
    """View `count` elements of `width` components where the fields say."""
    number = whole(fields, "bufferView", name)
    view, stride = view_bytes(document, number, name)
    offset, size = whole(fields, "byteOffset", name, 0), dtype.itemsize * width
    stride = stride or size
    if stride < size:
        raise ValueError(
            f"{name} has elements of {size} bytes, but the stride of bufferView {number} is "
            f"{stride}"
        )
    end = offset + stride * (count - 1) + size if count else 0
    if end > len(view):
        raise ValueError(
            f"{name} needs {shown(end)} bytes of bufferView {number}, which has {len(view)}"
        )
    if count == 0:
        return np.zeros((0, width), dtype)
    return np.ndarray((count, width), dtype, view, offset, (stride, dtype.itemsize))


def _with_sparse(
    document: Document, raw: Shaped[np.ndarray, "n k"], sparse: Fields, name: str
) -> Shaped[np.ndarray, "n k"]:
    owner = f"the sparse part of {name}"
    count = whole(sparse, "count", owner)
    places, values = inner(sparse, "indices", owner), inner(sparse, "values", owner)
    if whole(places, "componentType", owner) not in _UNSIGNED:
        raise ValueError(f"{owner} should have indices of an unsigned type")
    where = _strided(document, places, owner, _component(places, owner), count, 1)[:, 0]
    what = _strided(document, values, owner, raw.dtype, count, raw.shape[1])
    if count and where.max() >= len(raw):
        raise ValueError(f"{owner} names element {where.max()}, but there are {len(raw)}")
    raw = np.array(raw)
    raw[where] = what
    return raw
