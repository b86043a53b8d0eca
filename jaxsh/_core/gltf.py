"""Open a glTF file: its chunks, its JSON, what it requires, and its buffers; and close a GLB."""

import base64
import binascii
import posixpath
import struct
from collections import Counter
from pathlib import Path
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

import numpy as np

from .json_fields import Fields, inner, listed, parse_object, shown, text, whole

# What may be required: either handled here, or without a bearing on shape, UV and base color.
_KNOWN = {
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "EXT_mesh_gpu_instancing",
    "KHR_node_visibility",
    "EXT_texture_webp",
    # These pictures are not decoded, which is said.
    "KHR_texture_basisu",
    "EXT_texture_avif",
    "MSFT_texture_dds",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "EXT_lights_ies",
    "EXT_lights_image_based",
    "EXT_mesh_features",
    "EXT_instance_features",
    "EXT_structural_metadata",
}
_JSON, _BIN = 0x4E4F534A, 0x004E4942


class Document:
    """Holds an open glTF file: its JSON, where its bytes are, what it may cost and what was found.

    The memory that a file may ask for grows with its bytes, so that a few lines of JSON cannot
    fill it: `spend` counts corners that are about to be made.
    """

    def __init__(self, folder: Path, fields: Fields, chunk: memoryview | None, size: int):
        self.folder = folder
        self.fields = fields
        self.size = size  # bytes read or unpacked so far, of all files
        self.views: dict[int, memoryview] = {}  # decompressed bufferViews
        self.meshes: dict[int, Any] = {}  # bufferViews as Draco's meshes
        self.sparse: dict[int, np.ndarray] = {}  # accessors with their sparse part written in
        self._found: Counter[str] = Counter()
        self._chunk = chunk
        self._buffers: dict[int, memoryview] = {}
        self._files: dict[str, bytes] = {}
        self._spent = 0
        self._stored = size
        self._packed = self._unpacked = 0

    def note(self, what: str, count: int = 1) -> None:
        """Count something that was not read."""
        if count:
            self._found[what] += count

    @property
    def found(self) -> tuple[str, ...]:
        return tuple(f"{count} {what}" for what, count in self._found.items())

    def spend(self, corners: int) -> None:
        """Raise `ValueError` where the corners asked for so far are out of proportion."""
        self._spent += corners
        # 350,000 triangles of a small file, by instances or by index strips, are plausible.
        most = 2**20 + 4 * self.size
        if self._spent > most:
            raise ValueError(
                f"its instances and primitives give {shown(self._spent)} corners or more, out of "
                f"proportion to its {self.size} bytes (at most {most})"
            )

    def unpack(self, packed: int, unpacked: int, owner: str) -> None:
        """Count bytes that are about to be unpacked, and raise if they are out of proportion."""
        self._packed += packed
        self._unpacked += unpacked
        if self._packed > self._stored:
            raise ValueError(f"{owner} packs bytes that another bufferView packs as well")
        if self._unpacked > 2**25 + 16 * self._packed:
            raise ValueError(
                f"{owner} announces {shown(unpacked)} bytes, out of proportion to its {packed}"
            )
        self.size += unpacked

    def item(self, kind: str, index: int, owner: str) -> Fields:
        """Take an entry of one of the lists at the top, such as "accessors"."""
        entries = listed(self.fields, kind, "the file")
        if index >= len(entries):
            raise ValueError(
                f"{owner} names {kind} {shown(index)}, but the file has {len(entries)} of them"
            )
        if not isinstance(entries[index], dict):
            raise ValueError(f"{kind} {index} should be an object, got {shown(entries[index])}")
        return entries[index]

    def buffer(self, index: int, owner: str) -> memoryview:
        """Give the bytes of a buffer, read when they are first asked for."""
        if index not in self._buffers:
            self._buffers[index] = self._load(index, owner)
        return self._buffers[index]

    def _load(self, index: int, owner: str) -> memoryview:
        fields, name = self.item("buffers", index, owner), f"buffer {index}"
        length, uri = whole(fields, "byteLength", name), text(fields, "uri", name)
        if uri is not None:
            data = memoryview(self.resource(uri, name))
        elif index == 0 and self._chunk is not None:
            data = self._chunk
        else:
            raise ValueError(f"{owner} needs {name}, which has neither a uri nor a binary chunk")
        if len(data) < length:
            raise ValueError(f"{name} should have {shown(length)} bytes, but {len(data)} are there")
        return data[:length]

    def resource(self, uri: str, owner: str) -> bytes:
        """Read a data URI, or a file in the folder of the glTF file or below."""
        if uri[:5].lower() == "data:":
            return _data_uri(uri, owner)
        name = unquote(uri).replace("\\", "/")
        path = posixpath.normpath(name)
        # A colon in the first part makes it a URL, or a drive of Windows.
        if path.startswith(("/", "../")) or path in ("..", ".") or ":" in path.split("/")[0]:
            raise ValueError(
                f"{owner} is at {shown(uri)}, and only files in the folder of the glTF file or "
                "below are read"
            )
        if path in self._files:
            return self._files[path]
        try:
            there = (self.folder / path).is_file()
            data = (self.folder / path).read_bytes() if there else b""
        except (OSError, ValueError) as error:  # ValueError: a name that no file can have
            raise ValueError(f"{owner} cannot be read from {shown(path)}: {error}") from None
        if not there:
            raise ValueError(f"{owner} is in {shown(path)}, which is not there")
        self.size += len(data)
        self._stored += len(data)
        self._files[path] = data
        return data


def open_document(path: Path, data: bytes) -> Document:
    """Open a .glb or .gltf file, told apart by its first bytes; check version and extensions."""
    chunk, trailing = None, 0
    if data[:4] == b"glTF":
        source, chunk, trailing = _split(data)
    else:
        source = memoryview(data)
        if not data.removeprefix(b"\xef\xbb\xbf").lstrip().startswith((b"{", b"[")):
            raise ValueError(f"it begins with {data[:4]!r}: neither the mark glTF nor JSON")
    fields = parse_object(source)
    document = Document(path.parent, fields, chunk, len(data))
    document.note("bytes after its end ignored", trailing)
    _check_version(fields)
    required = listed(fields, "extensionsRequired", "the file")
    unknown = sorted({shown(name) for name in required if str(name) not in _KNOWN})
    if unknown:
        raise ValueError(f"it requires {', '.join(unknown)}, which cannot be read here")
    return document


def _split(data: bytes) -> tuple[memoryview, memoryview | None, int]:
    """Give the JSON chunk, the first binary chunk, and how many bytes follow the end."""
    if len(data) < 20:
        raise ValueError(f"it breaks off after {len(data)} bytes, within its header")
    version, length = struct.unpack_from("<2I", data, 4)
    if version != 2:
        raise ValueError(f"it is glTF {version} in binary form, and only glTF 2 can be read")
    if not 20 <= length <= len(data):
        raise ValueError(f"it announces {length} bytes, but has {len(data)}")
    content = memoryview(data)[:length]
    chunks: list[tuple[int, memoryview]] = []
    at = 12
    # Less than a chunk's header is padding.
    while at + 8 <= length:
        size, kind = struct.unpack_from("<2I", content, at)
        if at + 8 + size > length:
            raise ValueError(
                f"its chunk {len(chunks)} announces {size} bytes, but {length - at - 8} are left"
            )
        chunks.append((kind, content[at + 8 : at + 8 + size]))
        at += 8 + size
    if not chunks or chunks[0][0] != _JSON:
        raise ValueError("its first chunk is not JSON")
    binary = [chunk for kind, chunk in chunks[1:] if kind == _BIN]
    return chunks[0][1], binary[0] if binary else None, len(data) - length


def _check_version(fields: Fields) -> None:
    asset = inner(fields, "asset", "the file")
    version = asset.get("version")
    if isinstance(version, int | float):
        version = str(version)
    if not isinstance(version, str):
        raise ValueError("it names no version of glTF (asset.version)")
    if version.split(".")[0] != "2":
        raise ValueError(f"it is glTF {shown(version)}, and only glTF 2 can be read")
    least = text(asset, "minVersion", "the asset")
    if least not in (None, "2.0"):
        raise ValueError(f"it asks for glTF {shown(least)} at least, and 2.0 can be read")


def _data_uri(uri: str, owner: str) -> bytes:
    head, comma, body = uri.partition(",")
    if not comma:
        raise ValueError(f"{owner} has a data URI without a comma")
    try:
        if not head.lower().rstrip().endswith(";base64"):
            return unquote_to_bytes(body)
        plain = "".join((unquote(body) if "%" in body else body).split()).rstrip("=")
        # Of the URL-safe alphabet as well; padding is often left out.
        plain = plain.replace("-", "+").replace("_", "/")
        return base64.b64decode(plain + "=" * (-len(plain) % 4), validate=True)
    except (binascii.Error, ValueError) as error:
        raise ValueError(f"{owner} has a damaged data URI: {error}") from None


def glb(text: bytes, data: bytes | bytearray) -> bytes:
    """Put JSON and a buffer into the chunks of a GLB."""
    text += b" " * (-len(text) % 4)
    data = bytes(data) + bytes(-len(data) % 4)
    size = 12 + 8 + len(text) + 8 + len(data)
    return (
        struct.pack("<4sII", b"glTF", 2, size)
        + struct.pack("<I4s", len(text), b"JSON")
        + text
        + struct.pack("<I4s", len(data), b"BIN\0")
        + data
    )
