"""Writing pictures to files."""

import os
from pathlib import Path

import numpy as np
from jaxtyping import Array, Float

_DISPLAY, _LINEAR = (".png", ".jpg", ".jpeg"), (".exr", ".hdr")
_KINDS = {"uint8": "uint8", "float16": "half", "float32": "float"}  # NumPy's names, OpenImageIO's


def write_image(
    path: str | os.PathLike[str],
    image: Float[Array | np.ndarray, "h w"] | Float[Array | np.ndarray, "h w c"],
) -> Path:
    """Write a picture, gray (h, w), color (h, w, 3) or with alpha (h, w, 4), as its name says.

    .png and .jpg take what a screen shows (see `tone_map`), clip it to [0, 1] and round to 8
    bits. .exr and .hdr take linear radiance: .exr keeps float32 exactly (float16 as half), .hdr
    keeps 8 bits of the largest channel and no negative values. .jpg and .hdr have no alpha, and
    alpha is not multiplied into colors. Makes missing folders and returns the path.

    Raises `ValueError` for NaN or infinite values, shapes and extensions it does not know,
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
    path, pixels = Path(path), np.asarray(image)
    suffix = path.suffix.lower()
    if suffix not in _DISPLAY + _LINEAR:
        raise ValueError(f"{path}: cannot write {suffix}, only {_DISPLAY + _LINEAR}")
    if pixels.ndim == 2:
        pixels = pixels[..., None]
    channels = (1, 3, 4) if suffix in (".png", ".exr") else (1, 3)
    if pixels.ndim != 3 or pixels.shape[2] not in channels or pixels.size == 0:
        raise ValueError(
            f"{path}: a {suffix} picture is (height, width) or (height, width, channels) with "
            f"channels one of {channels}, got shape {np.shape(image)}"
        )
    if bad := int((~np.isfinite(pixels)).sum()):
        raise ValueError(f"{path}: {bad} of {pixels.size} values are NaN or infinite")
    if suffix == ".hdr":
        if (pixels < 0).any():
            raise ValueError(f"{path}: an .hdr picture cannot hold negative values")
        pixels = np.broadcast_to(pixels, (*pixels.shape[:2], 3))  # it knows no gray
    if suffix in _DISPLAY:
        pixels = np.rint(np.clip(pixels, 0, 1) * 255).astype(np.uint8)
    elif pixels.dtype != np.float16:
        pixels = pixels.astype(np.float32)
    path.parent.mkdir(parents=True, exist_ok=True)
    _write(path, np.ascontiguousarray(pixels))
    return path


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
    out = oiio.ImageOutput.create(str(path))
    if out is None:
        raise OSError(f"{path}: {oiio.geterror()}")
    done = out.open(str(path), spec) and out.write_image(pixels)
    problem = out.geterror()
    if not (out.close() and done):
        raise OSError(f"{path}: cannot be written: {problem or out.geterror()}")
