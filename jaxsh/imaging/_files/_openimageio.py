"""Pictures that OpenImageIO decodes: OpenEXR, PNG, JPEG and TIFF."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Shaped

from ..._core.words import reason
from ._channels import Choice, choose
from ._color import REC709, converted, decoded, from_luminance_chroma, luminance_weights, to_rec709
from ._turn import order_of_exif, upright
from ._window import fit_window

# What pictures of more than a few numbers compress to at best is some hundred numbers in a byte.
_MAX_NUMBERS_PER_BYTE, _FEW_NUMBERS = 2048, 1 << 25
_MAX_PIXELS = 1 << 28  # 3 GB of them
# A picture that is nearly all black by default was damaged more likely than saved so.
_MAX_FILLED = 64
# TIFF's black, white and colors of which OpenImageIO makes RGB: not CIELAB, nor logarithms.
_PHOTOMETRIC = {0, 1, 2, 3, 5, 6}
_ENVMAPS = {"CubeFace Environment": "cube", "LatLong Environment": "lat-long"}


class Picture(NamedTuple):
    """Holds linear pixels, and the layout that the file names, if it does."""

    pixels: Float[np.ndarray, "h w 3"]
    layout: str | None = None


def read_exr(path: Path, layer: str | None, fill: bool) -> Picture:
    """Read an OpenEXR picture: one part, its first level, R, G, B in linear Rec. 709.

    The display window is the picture: what the data window has beyond is cut off, and what it has
    not is black where `fill`, else refused. An environment map is all of its data window.
    """
    source = _open(path, ("openexr",))
    try:
        parts = _parts(source)
        if all(spec.deep for spec in parts):
            raise ValueError("it holds deep samples, no pixels: flatten it first")
        choice = choose([([] if s.deep else list(s.channelnames), _name(s)) for s in parts], layer)
        spec = parts[choice.part]
        _check_size(spec, path)
        pixels = _exr_channels(source, spec, choice)
    finally:
        source.close()
    chromaticities = spec.getattribute("chromaticities") or REC709
    if choice.kind == "luminance-chroma":
        pixels = from_luminance_chroma(pixels, luminance_weights(chromaticities))
    if choice.kind != "gray" and np.abs(np.subtract(chromaticities, REC709)).max() > 1e-3:
        pixels = converted(pixels, to_rec709(chromaticities))
    layout = _ENVMAPS.get(spec.getattribute("textureformat"))
    if layout is None:
        window = (spec.y, spec.x), (spec.full_y, spec.full_x, spec.full_height, spec.full_width)
        if spec.full_height * spec.full_width > _MAX_FILLED * spec.height * spec.width:
            raise ValueError(
                f"only {spec.width} × {spec.height} pixels of {spec.full_width} × "
                f"{spec.full_height} are stored"
            )
        pixels = fit_window(pixels, *window, fill)
    return Picture(np.broadcast_to(pixels, (*pixels.shape[:2], 3)), layout)


def read_display(path: Path, encoding: str | None) -> Picture:
    """Read .png, .jpg and .tif: 8 or 16 bits decoded as `encoding` says, floats as they are.

    EXIF's orientation is applied; alpha, color profiles and gamma in the file are not looked at.
    """
    _check_end(path.read_bytes())
    source = _open(path, ("png", "jpeg", "tiff"))
    try:
        spec = source.spec()
        if spec.get_int_attribute("tiff:PhotometricInterpretation", 2) not in _PHOTOMETRIC:
            space = spec.getattribute("tiff:ColorSpace") or "of another kind"
            raise ValueError(f"its colors are {space}, which is not read: save it as RGB")
        _check_size(spec, path)
        channels = choose([(list(spec.channelnames), "")], None).channels
        pixels = _read(source, 0, min(channels), max(channels) + 1, spec.format)
    finally:
        source.close()
    pixels = pixels[..., [c - min(channels) for c in channels]]
    if pixels.dtype.kind == "f":
        refuse_encoding(encoding)
        pixels = pixels.astype(np.float32)
    elif pixels.dtype in (np.uint8, np.uint16):
        pixels = decoded(pixels, encoding)
    else:
        raise ValueError(f"needs 8 or 16 bits or floats, got {pixels.dtype}")
    pixels = upright(pixels, order_of_exif(spec.getattribute("Orientation") or 1))
    return Picture(np.broadcast_to(pixels, (*pixels.shape[:2], 3)))


def refuse_encoding(encoding: str | None) -> None:
    """Refuse an encoding for what is linear floats already."""
    if encoding is not None:
        raise ValueError(
            f"it holds floats, which are linear: encoding={encoding!r} is for 8 and 16 bits"
        )


def _open(path: Path, formats: tuple[str, ...]) -> Any:
    """Open a file that is of one of these formats, by OpenImageIO's names, whatever its own."""
    try:
        import OpenImageIO as oiio
    except ImportError as error:
        raise ImportError(
            f"{path}: reading {path.suffix} needs the package OpenImageIO, which cannot be "
            "imported here; .hdr, .pfm and .npy are read without it"
        ) from error
    hint = oiio.ImageSpec()
    hint.attribute("oiio:UnassociatedAlpha", 1)  # colors as they are held
    source = oiio.ImageInput.open(str(path), hint)
    if source is None:
        problem = reason(oiio.geterror())
        if "ubsampled channels" in problem:
            raise ValueError(
                "its chroma has fewer pixels than its luminance, which is not read: save it as "
                "R, G, B"
            )
        raise ValueError(f"damaged or not a {path.suffix} file: {problem}")
    if source.format_name() not in formats:
        raise ValueError(f"not a {path.suffix} file: its bytes are {source.format_name()}")
    return source


def _parts(source: Any) -> list[Any]:
    parts = []
    while source.seek_subimage(len(parts), 0):
        parts.append(source.spec().copy())
    source.geterror()  # there is no such part: not a fault
    return parts


def _name(spec: Any) -> str:
    return spec.getattribute("oiio:subimagename") or spec.getattribute("name") or ""


def _exr_channels(source: Any, spec: Any, choice: Choice) -> Float[np.ndarray, "h w c"]:
    import OpenImageIO as oiio

    first, last = min(choice.channels), max(choice.channels) + 1
    formats = list(spec.channelformats) or [spec.format] * spec.nchannels
    if any(formats[c].basetype == oiio.UINT for c in choice.channels):
        # Counts: as floats OpenImageIO would take them for shares of the largest.
        planes = []
        for c in choice.channels:
            kind = oiio.UINT if formats[c].basetype == oiio.UINT else oiio.FLOAT
            planes.append(_read(source, choice.part, c, c + 1, kind).astype(np.float32))
        return np.concatenate(planes, axis=-1)
    pixels = _read(source, choice.part, first, last, oiio.FLOAT)
    places = [c - first for c in choice.channels]
    return pixels if places == list(range(pixels.shape[-1])) else pixels[..., places]


def _read(source: Any, part: int, first: int, last: int, kind: Any) -> Shaped[np.ndarray, "h w c"]:
    """Decode some channels of a part. OpenImageIO may stop halfway and report it later."""
    pixels = source.read_image(part, 0, first, last, kind)
    problem = reason(source.geterror())
    if pixels is None or problem:
        raise ValueError(f"damaged or truncated: {problem or 'no pixels'}")
    return pixels


def _check_size(spec: Any, path: Path) -> None:
    size, pixels = path.stat().st_size, spec.width * spec.height
    # A tile is held whole, however little of it the picture has.
    held = max(pixels, spec.tile_width * spec.tile_height)
    if held * spec.nchannels > max(_FEW_NUMBERS, _MAX_NUMBERS_PER_BYTE * size):
        raise ValueError(
            f"damaged: {spec.width} × {spec.height} pixels cannot be in a file of {size} bytes"
        )
    if held > _MAX_PIXELS:
        raise ValueError(
            f"{spec.width} × {spec.height} pixels are too many: at most {_MAX_PIXELS} are read"
        )
    if spec.depth > 1:
        raise ValueError("a volume is not a picture")


def _check_end(data: bytes) -> None:
    """Refuse a JPEG or PNG without its end: decoders fill the one with gray."""
    if data.startswith(b"\xff\xd8"):
        place = 2
        # Thumbnails with ends of their own are inside of segments.
        while data[place : place + 1] == b"\xff" and data[place + 1 : place + 2] != b"\xda":
            place += 2 + int.from_bytes(data[place + 2 : place + 4], "big")
        whole = data.find(b"\xff\xd9", place) >= 0
    elif data.startswith(b"\x89PNG"):
        whole = b"\0\0\0\0IEND\xaeB`\x82" in data
    else:
        return
    if not whole:
        raise ValueError("damaged or truncated: its end is not there")
