"""Radiance pictures (.hdr, .pic): headers of every age, all orders of pixels, RGB or XYZ.

OpenImageIO (3.2) refuses old runs, XYZ and headers without FORMAT, misreads rows each coded in its
own way, takes no notice of rows after the last, and has no wheels for some machines: so the decoder
is our own. OpenImageIO's, four times as fast on 2048 × 1024 pixels, takes the large pictures that
it reads to the same.
"""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, UInt8

from ._color import REC709, XYZ, converted, to_rec709
from ._runs import decode_rows, row_marker
from ._turn import upright

_MAX_HEADER = 1 << 20
_MAX_PIXELS = 1 << 28  # 3 GB of them
# What twelve bytes can repeat at most in a row of 32767 pixels, the old way.
_MAX_PIXELS_PER_BYTE = 4096
# Pictures of more pixels are left to OpenImageIO, where it reads them to the same.
_LARGE = 1 << 20
# Primaries nearer to Rec. 709's than this are taken for them: Radiance's own are 0.01 away.
_NEAR = 0.02

_SIZE = re.compile(rb"([-+][XY]) +(\d{1,9}) +([-+][XY]) +(\d{1,9}) *\r?\n")
_SCALES = np.ldexp(1.0, np.arange(256) - 136).astype(np.float32)
_SCALES[0] = 0  # by definition black


class _Header(NamedTuple):
    order: str  # as in "-Y +X"
    rows: int  # as they lie in the file
    columns: int
    xyz: bool
    primaries: tuple[float, ...] | None
    body: int  # where the pixels begin


def read_radiance(path: Path) -> Float[np.ndarray, "h w 3"]:
    """Read a Radiance picture, turned upright, in linear Rec. 709.

    Raises `ValueError` for what is none, is damaged or ends early, and where another whole row
    follows the last: bytes after the end are no harm, but a height that is too small is.
    """
    data = path.read_bytes()
    header = _header(data)
    if header.rows * header.columns > min(_MAX_PIXELS, _MAX_PIXELS_PER_BYTE * len(data)):
        raise ValueError(
            f"damaged: {header.columns} × {header.rows} pixels cannot be in a file of "
            f"{len(data)} bytes, or are more than the {_MAX_PIXELS} that are read"
        )
    if min(header.rows, header.columns) < 1:
        raise ValueError(f"a picture needs pixels, got {header.columns} × {header.rows}")
    pixels = _by_openimageio(path, data, header)
    if pixels is None:
        rgbe, end = decode_rows(data, header.body, header.rows, header.columns)
        _check_end(data, end, header)
        pixels = _floats(rgbe)
    primaries = XYZ if header.xyz else header.primaries
    if primaries and np.abs(np.subtract(primaries, REC709))[:6].max() > _NEAR:
        pixels = converted(pixels, to_rec709(primaries))
    return upright(pixels, header.order)


def _header(data: bytes) -> _Header:
    """Read the lines up to the size. EXPOSURE and COLORCORR are known and not applied."""
    lines, place = [], 0
    while (end := data.find(b"\n", place, _MAX_HEADER)) >= 0:
        line, place = data[place:end].rstrip(b"\r"), end + 1
        if not line:
            break
        lines.append(line.decode("latin-1"))
    size = _SIZE.match(data, place)
    values = dict(line.split("=", 1) for line in lines if "=" in line and line[0] not in "#\t ")
    known = lines and (lines[0].startswith("#?") or "FORMAT" in values)
    if size is None or not known or size[1][1] == size[3][1]:
        raise ValueError("damaged or not a Radiance picture: no header that ends in its size")
    form = values.get("FORMAT", "32-bit_rle_rgbe").strip()
    if form not in ("32-bit_rle_rgbe", "32-bit_rle_xyze"):
        raise ValueError(f"FORMAT must be 32-bit_rle_rgbe or 32-bit_rle_xyze, got {form!r}")
    return _Header(
        order=f"{size[1].decode()} {size[3].decode()}",
        rows=int(size[2]),
        columns=int(size[4]),
        xyz=form.endswith("xyze"),
        primaries=_primaries(values.get("PRIMARIES")),
        body=size.end(),
    )


def _primaries(text: str | None) -> tuple[float, ...] | None:
    """Parse eight numbers; some programs write zeros, which say nothing."""
    try:
        numbers = tuple(float(word) for word in (text or "").split())
    except ValueError:
        return None
    return numbers if len(numbers) == 8 and any(numbers) else None


def _floats(rgbe: UInt8[np.ndarray, "h 4 w"]) -> Float[np.ndarray, "h w 3"]:
    """Mantissa · 2^(exponent - 136), as most programs read it, not Radiance's half a step more."""
    scale = _SCALES[rgbe[:, 3]]
    out = np.empty((len(rgbe), rgbe.shape[2], 3), np.float32)
    for channel in range(3):
        np.multiply(rgbe[:, channel], scale, out=out[..., channel])
    return out


def _check_end(data: bytes, end: int, header: _Header) -> None:
    rest, marker = len(data) - end, row_marker(header.columns)
    if marker and data.startswith(marker, end):
        try:
            decode_rows(data, end, 1, header.columns)
            more = True
        except ValueError:  # a mark, and no row
            more = False
    else:
        # Uncoded rows have no mark: what is as long as some of them and not all zero is them.
        more = rest > 0 and rest % (4 * header.columns) == 0 and any(data[end:])
    if more:
        raise ValueError(
            f"damaged: {header.columns} × {header.rows} pixels end at byte {end} of {len(data)}, "
            "and more rows follow"
        )


def _by_openimageio(path: Path, data: bytes, header: _Header) -> np.ndarray | None:
    """Decode a large picture, every row of which is in new runs, or leave it to our own decoder."""
    marker = row_marker(header.columns)
    large = header.rows * header.columns > _LARGE
    if not large or header.xyz or marker is None or header.order[1] != "Y":
        return None
    # As many marks as rows: no row is coded otherwise, and none follows the last.
    if data.count(marker, header.body) != header.rows:
        return None
    try:
        import OpenImageIO as oiio
    except ImportError:
        return None
    source = oiio.ImageInput.open(str(path))
    if source is None:
        oiio.geterror()
        return None
    try:
        if (source.spec().height, source.spec().width) != (header.rows, header.columns):
            return None
        # Aligned, JAX takes the memory as it is.
        pixels = _aligned((header.rows, header.columns, 3))
        for row in range(0, header.rows, 64):
            end = min(row + 64, header.rows)
            block = source.read_scanlines(row, end, 0, 0, 3, oiio.FLOAT)
            if block is None:
                source.geterror()
                return None
            pixels[row:end] = block
        return None if source.geterror() else pixels
    finally:
        source.close()


def _aligned(shape: tuple[int, ...]) -> Float[np.ndarray, "..."]:
    """Allocate float32 at a multiple of 64 bytes."""
    size = int(np.prod(shape))
    raw = np.empty(size + 16, np.float32)
    first = -raw.ctypes.data % 64 // 4
    return raw[first : first + size].reshape(shape)
