"""Decode what KHR_draco_mesh_compression packs, with DracoPy."""

from typing import Any

import numpy as np
from jaxtyping import Integer

from ..._core.gltf import Document
from ..._core.json_fields import Fields, extension, flag, inner, shown, text, whole
from ._gltf_accessors import WIDTHS, Accessor, view_bytes

_NAME = "KHR_draco_mesh_compression"


def decode_draco(
    document: Document, primitive: Fields, attributes: Fields, owner: str
) -> tuple[dict[str, Accessor], Integer[np.ndarray, " c"] | None]:
    """Give the attributes and the corners of a compressed primitive; none where it is not.

    Without DracoPy the uncompressed form is taken where the file has one as well. Raises
    `ValueError` where it has none, and where the packed bytes are damaged or do not hold what the
    accessors announce.
    """
    packed = extension(primitive, _NAME, owner)
    if packed is None:
        return {}, None
    position = document.item("accessors", whole(attributes, "POSITION", owner), owner)
    number = whole(packed, "bufferView", owner)
    if number not in document.meshes:
        try:
            document.meshes[number] = _decode(document, number, owner)
        except ImportError:
            if position.get("bufferView") is not None:
                return {}, None
            raise ValueError(
                f"{owner} is compressed by {_NAME}, which needs the package DracoPy "
                "(pip install jaxsh[draco])"
            ) from None
    mesh, corners, found = document.meshes[number]
    announced = whole(position, "count", owner)
    if found != announced or corners.max(initial=0) >= found:
        raise ValueError(
            f"{owner} announces {shown(announced)} vertices, but {_NAME} packs {found}"
        )
    unpacked = {}
    for name, number in inner(packed, "attributes", owner).items():
        stored = mesh.get_attribute_by_unique_id(whole({name: number}, name, owner))
        if stored is None or name not in attributes:
            raise ValueError(f"{owner} names an attribute {shown(name)} that {_NAME} does not pack")
        fields = document.item("accessors", whole(attributes, name, owner), owner)
        data = np.asarray(stored["data"]).reshape(found, -1)
        kind = text(fields, "type", name)
        if WIDTHS.get(kind or "") != data.shape[1]:
            raise ValueError(
                f"{name} of {owner} should be {shown(kind)}, but {_NAME} packs {data.shape[1]} "
                "components"
            )
        unpacked[name] = Accessor(data, flag(fields, "normalized", f"{name} of {owner}"))
    return unpacked, corners


def _decode(
    document: Document, number: int, owner: str
) -> tuple[Any, Integer[np.ndarray, " c"], int]:
    import DracoPy

    view, _ = view_bytes(document, number, owner)
    document.unpack(len(view), 0, owner)
    try:
        mesh = DracoPy.decode(bytes(view))
        corners = np.asarray(mesh.faces, np.int64).reshape(-1)
        if mesh.points is None:
            raise ValueError("no attribute is a position")
        unpacked = sum(stored["data"].nbytes for stored in mesh.attributes)
    except Exception as error:  # of any kind, where the bytes are damaged
        raise ValueError(f"{owner} has damaged bytes of {_NAME}: {error}") from None
    document.size += unpacked
    return mesh, corners, len(mesh.points)
