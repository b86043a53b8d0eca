"""Small valid pictures of every format that is read, as bytes."""

import io
import struct
import tempfile
import zlib
from pathlib import Path

import numpy as np

HEIGHT, WIDTH = 8, 16


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


PNG = (
    b"\x89PNG\r\n\x1a\n"
    + _chunk(b"IHDR", struct.pack(">IIBBBBB", 2, 2, 8, 2, 0, 0, 0))
    + _chunk(b"IDAT", zlib.compress(b"\0" + bytes(range(6)) + b"\0" + bytes(range(100, 106))))
    + _chunk(b"IEND", b"")
)


def picture() -> np.ndarray:
    """A lat-long picture (8, 16, 3), float32, all its values exact in a half and in RGBE."""
    i, j, c = np.meshgrid(np.arange(HEIGHT), np.arange(WIDTH), np.arange(3), indexing="ij")
    return (2.0 ** ((i + j) % 5 - 2) * (1 + (i * j + c) % 4 / 4)).astype(np.float32)


def _hdr() -> list[bytes]:
    pixels = picture()
    largest = pixels.max(axis=2)
    exponent = np.frexp(largest)[1]
    scaled = pixels / np.exp2(exponent - 8.0)[..., None]
    rgbe = np.concatenate([scaled, exponent[..., None] + 128.0], axis=2).astype(np.uint8)
    head = b"#?RADIANCE\n# made by hand\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1.0\n\n-Y 8 +X 16\n"
    rows = []
    for row in rgbe:
        rows.append(struct.pack(">BBH", 2, 2, WIDTH))
        for channel in row.T:
            rows.append(bytes([4, *channel[:4], 128 + 1, channel[4], 11, *channel[5:]]))
    return [head + rgbe.tobytes(), head + b"".join(rows)]


def _exr() -> list[bytes]:
    import OpenImageIO as oiio

    files = []
    with tempfile.TemporaryDirectory() as folder:
        for kind, compression, tile in [
            ("half", "none", 0), ("float", "zip", 0), ("half", "piz", 0), ("float", "rle", 8),
            ("half", "zips", 0), ("half", "pxr24", 0), ("half", "b44", 4), ("half", "dwaa", 0),
        ]:  # fmt: skip
            path = str(Path(folder) / "a.exr")
            spec = oiio.ImageSpec(WIDTH, HEIGHT, 3, kind)
            spec.attribute("compression", compression)
            spec.attribute("DateTime", "2020:02:20 20:20:20")  # or it is that of writing
            if tile:
                spec.tile_width = spec.tile_height = tile
            out = oiio.ImageOutput.create(path)
            out.open(path, spec)
            out.write_image(picture())
            out.close()
            files.append(Path(path).read_bytes())
    return files


def codes() -> np.ndarray:
    """A picture (8, 16, 3) of 8-bit codes."""
    i, j, c = np.meshgrid(np.arange(HEIGHT), np.arange(WIDTH), np.arange(3), indexing="ij")
    return (20 + 10 * i + 5 * j + 40 * c).astype(np.uint8)


def _display(suffix: str, *options: dict) -> list[bytes]:
    """Write the picture of codes by Pillow."""
    from PIL import Image

    files = []
    for one in options:
        out, image = io.BytesIO(), Image.fromarray(codes())
        if "mode" in one:
            image = image.convert(one["mode"])
        image.save(out, suffix, **{key: value for key, value in one.items() if key != "mode"})
        files.append(out.getvalue())
    return files


def _png() -> list[bytes]:
    return _display("png", {}, {"mode": "L"}, {"mode": "P"}, {"mode": "RGBA"})


def _jpg() -> list[bytes]:
    return _display("jpeg", {"quality": 95}, {"mode": "L"}, {"progressive": True})


def _tif() -> list[bytes]:
    return _display("tiff", {}, {"compression": "tiff_lzw"}, {"compression": "tiff_adobe_deflate"})


def _pfm() -> list[bytes]:
    pixels = picture()[::-1]
    size = f"{WIDTH} {HEIGHT}"
    return [
        f"PF\n{size}\n-1.0\n".encode() + pixels.astype("<f4").tobytes(),
        f"PF\n{size}\n1.0\n".encode() + pixels.astype(">f4").tobytes(),
        f"Pf\n{size}\n-2.5e1\n".encode() + pixels[..., 1].astype("<f4").tobytes(),
    ]


def npy(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def _npy() -> list[bytes]:
    pixels = picture()
    arrays = [
        pixels,
        pixels.astype(">f8"),
        np.asfortranarray(pixels),
        pixels[..., 0],
        pixels.astype("f2"),
    ]
    return [npy(array) for array in arrays]


# Of 8 or 16 bits, which want an encoding.
CODES = ("png", "jpg", "tif")
MAKERS = {
    "hdr": _hdr,
    "exr": _exr,
    "pfm": _pfm,
    "npy": _npy,
    "png": _png,
    "jpg": _jpg,
    "tif": _tif,
}
