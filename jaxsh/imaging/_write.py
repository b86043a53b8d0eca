"""Writing pictures to files."""

import os
from pathlib import Path

import numpy as np
from jaxtyping import Array, Real

from .._core.checks import as_path, check_known, described
from ._files import decoded

_DISPLAY, _LINEAR = (".png", ".jpg", ".jpeg"), (".exr", ".hdr")
# NumPy's names, OpenImageIO's.
_KINDS = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float"}
_MOST_HDR = float(np.ldexp(255 / 256, 127))


def write_image(
    path: str | os.PathLike[str],
    image: Real[Array | np.ndarray, "h w"] | Real[Array | np.ndarray, "h w c"],
    *,
    encoding: str | None = None,
) -> Path:
    """Write a picture, gray (h, w), color (h, w, 3) or with alpha (h, w, 4), as its name says.

    .png and .jpg take what a screen shows (see `tone_map`), clip it to [0, 1] and round to 8
    bits. .exr and .hdr take linear radiance: .exr keeps float32 exactly (float16 as half), .hdr
    keeps 8 bits of the largest channel and no negative values. .jpg and .hdr have no alpha, and
    alpha is not multiplied into colors. The same picture gives the same bytes. Makes missing
    folders and returns the path.

    Integers, uint8 or uint16, are no radiance and want `encoding="srgb"`: .png keeps them as they
    are, .jpg in 8 bits, and .exr and .hdr get the linear light that they stand for.

    Raises `ValueError` for NaN or infinite values, and those that the format cannot hold, for
    integers without an encoding and floats with one, for shapes and extensions it does not know,
    `OSError` where the file cannot be written, and `ImportError` where OpenImageIO cannot be
    imported. Runs on the host.

    **Example**

    >>> import pathlib, tempfile
    >>> from jaxsh import imaging
    >>> image = imaging.tone_map(imaging.studio(8, 16))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     imaging.write_image(pathlib.Path(folder) / "a" / "probe.png", image).name
    'probe.png'
    """
    path, pixels = as_path(path), as_numbers(image)
    suffix = path.suffix.lower()
    if suffix not in _DISPLAY + _LINEAR:
        raise ValueError(f"{path}: cannot write {suffix}, only {_DISPLAY + _LINEAR}")
    if pixels.ndim == 2:
        pixels = pixels[..., None]
    channels = (1, 3, 4) if suffix in (".png", ".exr") else (1, 3)
    if pixels.ndim != 3 or pixels.shape[2] not in channels or pixels.size == 0:
        first = pixels.ndim == 3 and pixels.shape[0] in channels
        hint = ": channels come last, see jax.numpy.moveaxis" if first else ""
        raise ValueError(
            f"{path}: a {suffix} picture is (height, width) or (height, width, channels) with "
            f"channels one of {channels}, got shape {np.shape(image)}{hint}"
        )
    try:
        pixels = as_signal(pixels, encoding) if suffix in _DISPLAY else _light(pixels, encoding)
        if suffix == ".hdr":
            pixels = _for_hdr(pixels)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    if suffix in (".jpg", ".jpeg"):
        pixels = in_8_bits(pixels)
    path.parent.mkdir(parents=True, exist_ok=True)
    _write(path, np.ascontiguousarray(pixels))
    return path


def as_numbers(image: object) -> np.ndarray:
    """Convert to an array of numbers; raises `ValueError` for what is traced or anything else."""
    check_known("image", image)
    try:
        array = np.asarray(image)
    except (TypeError, ValueError):  # lists of several lengths
        array = np.asarray(None)
    if array.dtype.kind not in "fiubc" and array.dtype.name != "bfloat16":
        raise ValueError(f"expected image as an array of numbers, got {described(image)}")
    return array


def as_signal(pixels: np.ndarray, encoding: str | None) -> np.ndarray:
    """Round what a screen shows to 8 bits; what came in 8 or 16 stays."""
    if _is_coded(pixels, encoding):
        return pixels
    return np.rint(np.clip(_finite(pixels), 0, 1) * 255).astype(np.uint8)


def in_8_bits(signal: np.ndarray) -> np.ndarray:
    """Round codes of 16 bits to 8."""
    return signal if signal.dtype == np.uint8 else np.rint(signal / 257).astype(np.uint8)


def _light(pixels: np.ndarray, encoding: str | None) -> np.ndarray:
    """Linear light in float16 or float32."""
    if _is_coded(pixels, encoding):
        return decoded(pixels, encoding)
    if pixels.dtype == np.float16:
        return _finite(pixels)
    with np.errstate(over="ignore"):
        single = _finite(pixels).astype(np.float32)
    if bad := int(np.isinf(single).sum()):
        raise ValueError(f"{bad} of {single.size} values are beyond float32's range")
    return single


def _for_hdr(pixels: np.ndarray) -> np.ndarray:
    if (pixels < 0).any():
        raise ValueError("an .hdr picture cannot hold negative values")
    if (pixels > _MOST_HDR).any():
        raise ValueError(
            f"an .hdr picture holds values up to {_MOST_HDR:.3g}, got {pixels.max():.3g}"
        )
    return np.broadcast_to(pixels, (*pixels.shape[:2], 3))  # it knows no gray


def _is_coded(pixels: np.ndarray, encoding: str | None) -> bool:
    """True for integers with their encoding; raises `ValueError` for any other combination."""
    floats = pixels.dtype.kind == "f" or pixels.dtype.name == "bfloat16"
    if floats and encoding is not None:
        raise ValueError(f'encoding="srgb" is for uint8 and uint16, got {pixels.dtype}')
    if not floats and pixels.dtype not in (np.uint8, np.uint16):
        raise ValueError(f"expected an image of floats, uint8 or uint16, got {pixels.dtype}")
    if not floats and encoding != "srgb":
        raise ValueError(
            f'integers ({pixels.dtype}) are no radiance: say encoding="srgb", or decode them by '
            f"imaging.srgb_decode(image / {np.iinfo(pixels.dtype).max}), got encoding={encoding!r}"
        )
    return not floats


def _finite(pixels: np.ndarray) -> np.ndarray:
    pixels = pixels if pixels.dtype.kind == "f" else pixels.astype(np.float32)
    if bad := int((~np.isfinite(pixels)).sum()):
        raise ValueError(f"{bad} of {pixels.size} values are NaN or infinite")
    return pixels


def _write(path: Path, pixels: np.ndarray) -> None:
    try:
        import OpenImageIO as oiio
    except ImportError as error:
        raise ImportError(
            f"{path}: writing pictures needs the package OpenImageIO, which cannot be imported here"
        ) from error

    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, _KINDS[pixels.dtype.name])
    # Colors are not to be touched: not divided by alpha, not thinned out.
    spec.attribute("oiio:UnassociatedAlpha", 1)
    spec.attribute("jpeg:subsampling", "4:4:4")
    spec.attribute("CompressionQuality", 95)
    # Else OpenEXR's writer stores when it was: other bytes each time.
    spec.attribute("DateTime", "")
    out = oiio.ImageOutput.create(str(path))
    if out is None:
        raise OSError(f"{path}: {oiio.geterror()}")
    done = out.open(str(path), spec) and out.write_image(pixels)
    problem = out.geterror()
    if not (out.close() and done):
        raise OSError(f"{path}: cannot be written: {problem or out.geterror()}")
