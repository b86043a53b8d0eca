"""Write a picture as PNG (ISO/IEC 15948), which textures of GLB and OBJ files are stored as."""

import struct
import zlib

import numpy as np
from jaxtyping import UInt8


def png(picture: UInt8[np.ndarray, "h w 4"]) -> bytes:
    """Give the bytes of an 8-bit PNG, without alpha where that is 255 throughout."""
    opaque = (picture[..., 3] == 255).all()
    pixels = picture[..., :3] if opaque else picture
    height, width = pixels.shape[:2]
    rows = np.ascontiguousarray(pixels).reshape(height, -1)
    # Each row but the first as the difference to the one above (filter 2), which packs better.
    filtered = np.zeros((height, 1 + rows.shape[1]), np.uint8)
    filtered[1:, 0] = 2
    filtered[:, 1:] = rows
    filtered[1:, 1:] -= rows[:-1]
    header = struct.pack(">IIBBBBB", width, height, 8, 2 if opaque else 6, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + _chunk(b"IHDR", header)
        + _chunk(b"IDAT", zlib.compress(filtered.tobytes()))
        + _chunk(b"IEND", b"")
    )


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
