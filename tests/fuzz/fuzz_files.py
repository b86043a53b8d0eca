"""Small valid files of every format that is read, as bytes: what the fuzzer starts from."""

import functools
import struct
import zlib
from pathlib import Path

import fuzz_lights
import fuzz_meshes
import fuzz_pictures
import numpy as np
from fuzz_pictures import PNG, npy


def archive(members: dict[str, bytes]) -> bytes:
    """Put files into a zip archive as they are."""
    return _zip({name: (zlib.crc32(data), len(data), 0, data) for name, data in members.items()})


def compressed_archive(members: dict[str, bytes], zeros: dict[str, int]) -> bytes:
    """Put files into a zip archive, with arrays of so many rows of zeros, which pack well."""
    packed = {name: _packed(data) for name, data in members.items()}
    return _zip(packed | {name: _packed_zeros(rows) for name, rows in zeros.items()})


def _packed(data: bytes) -> tuple[int, int, int, bytes]:
    return zlib.crc32(data), len(data), 8, zlib.compress(data, 1, -15)


@functools.cache
def _packed_zeros(rows: int) -> tuple[int, int, int, bytes]:
    return _packed(npy(np.zeros((rows, 4), "f4")))


def _zip(members: dict[str, tuple[int, int, int, bytes]]) -> bytes:
    """Write an archive of (CRC, size, method, bytes), which zipfile would have to pack itself."""
    files, directory = b"", b""
    for name, (crc, size, method, data) in members.items():
        fields = (20, 0x800, method, 0, 0x21, crc, len(data), size, len(name.encode()), 0)
        directory += struct.pack("<4sH5HIIIHH", b"PK\1\2", 20, *fields)
        directory += struct.pack("<HHHII", 0, 0, 0, 0, len(files)) + name.encode()
        files += struct.pack("<4s5HIIIHH", b"PK\3\4", *fields) + name.encode() + data
    count = len(members)
    end = (b"PK\5\6", 0, 0, count, count, len(directory), len(files), 0)
    return files + directory + struct.pack("<4s4HIIH", *end)


def _transfer() -> list[bytes]:
    files = []
    for kind in ("<f4", "<f8"):
        arrays = {
            "format": np.array("jaxsh transfer"),
            "version": np.array(1),
            "coefficients": (np.arange(20, dtype=kind) / 8).reshape(5, 4),
            "positions": (np.arange(15, dtype=kind) / 4).reshape(5, 3),
            "normals": np.tile(np.array([0, 0.6, 0.8], kind), (5, 1)),
            "neighbors": np.arange(10).reshape(5, 2).astype("<i4") % 5,
        }
        files.append(archive({f"{name}.npy": npy(array) for name, array in arrays.items()}))
    return files


_MAKERS = fuzz_meshes.MAKERS | fuzz_pictures.MAKERS | {"npz": _transfer} | fuzz_lights.MAKERS
MESHES, PICTURES, FORMATS = tuple(fuzz_meshes.MAKERS), tuple(fuzz_pictures.MAKERS), tuple(_MAKERS)
LIGHTS = tuple(fuzz_lights.MAKERS)


@functools.cache
def seeds(kind: str) -> list[bytes]:
    """Give the valid files of a format."""
    return _MAKERS[kind]()


# What a file may name, beside it.
BESIDE = {
    "mtl": {"scene.obj": seeds("obj")[1], "red.png": PNG},
    "obj": {
        "scene.mtl": b"newmtl red\nKd 1 0 0\nmap_Kd red.png\nnewmtl blue\nKd 0 0 1\nd 0.5\n",
        "red.png": PNG,
    },
}


def put_beside(path: Path) -> None:
    """Write what a file names into its folder; beside materials, the mesh that has them."""
    for name, data in BESIDE.get(path.suffix[1:], {}).items():
        (path.parent / name).write_bytes(data.replace(b"scene.mtl", path.name.encode()))
