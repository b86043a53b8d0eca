"""Light probes from files."""

import os
import warnings
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

_FORMATS = (".exr", ".hdr")
_LAYOUTS = ("lat-long",)
_ORIENTATIONS = ("jaxsh",)
# The best that the compression of these formats can do is some hundred pixels in a byte.
_MAX_PIXELS_PER_BYTE = 2048


def read_environment(
    path: str | os.PathLike[str],
    *,
    layout: str = "lat-long",
    orientation: str = "jaxsh",
    repair: bool = False,
) -> Float[Array, "h w 3"]:
    """Read a light probe (.exr or .hdr): linear radiance, float32, in the file's own unit.

    Layout "lat-long": height : width = 1 : 2. Orientation "jaxsh": row 0 touches +z, column 0
    starts at φ = 0 (+x), φ grows to the right, towards +y. Values are taken as linear Rec. 709;
    colours are not converted, and an .hdr header's EXPOSURE is not applied. A grey picture gives
    three equal channels; channels other than R, G, B are left out.

    A picture with NaN, negative or infinite values is refused with their numbers; with
    `repair=True` NaN and negative ones become 0 and infinite ones the largest finite value of
    the picture, and a `UserWarning` counts them. Raises `FileNotFoundError` for a missing file
    and `ValueError`, naming the file and the problem, for any other fault: a damaged or
    truncated file, one that is all black, another shape, an unknown option.
    """
    path = Path(path)
    for name, value, known in (
        ("layout", layout, _LAYOUTS),
        ("orientation", orientation, _ORIENTATIONS),
    ):
        if value not in known:
            raise ValueError(f"{name} must be one of {known}, got {value!r}")
    if path.suffix.lower() not in _FORMATS:
        raise ValueError(f"{path}: cannot read {path.suffix or 'no extension'}, only {_FORMATS}")
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such picture")
    try:
        pixels = _read(path)
        height, width, _ = pixels.shape
        if width != 2 * height:
            raise ValueError(f"a lat-long picture is twice as wide as high, not {width} × {height}")
    except UnicodeDecodeError as error:  # names in the header, or the complaint about them
        raise ValueError(f"{path}: damaged: its header is not text") from error
    except (ValueError, MemoryError) as error:
        raise ValueError(f"{path}: {error or 'damaged, or too large for memory'}") from error
    return jnp.asarray(_checked(path, pixels, repair))


def _read(path: Path) -> np.ndarray:
    """Every pixel of R, G, B, or none: the reader itself may stop halfway and say so later."""
    import OpenImageIO as oiio

    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise ValueError(f"damaged or not a {path.suffix} file: {_first_line(oiio.geterror())}")
    try:
        spec = source.spec()
        _check_form(spec, path.stat().st_size)
        channels = _channels(list(spec.channelnames))
        pixels = source.read_image(0, 0, 0, spec.nchannels, oiio.FLOAT)
        problem = _first_line(source.geterror())
    finally:
        source.close()
    if pixels is None or problem:
        raise ValueError(f"damaged or truncated: {problem or 'no pixels'}")
    return pixels[..., channels]


def _first_line(text: str) -> str:
    return text.strip().split("\n")[0]


def _check_form(spec: Any, size: int) -> None:
    if spec.width * spec.height > _MAX_PIXELS_PER_BYTE * size:
        raise ValueError(
            f"damaged: {spec.width} × {spec.height} pixels cannot be in a file of {size} bytes"
        )
    if spec.deep or spec.depth > 1:
        raise ValueError("deep and volume pictures are not light probes")
    window = (spec.x, spec.y, spec.width, spec.height)
    whole = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    if window != whole:
        raise ValueError(f"only a part of the picture is stored: {window} of {whole}")
    if spec.getattribute("Orientation") not in (None, 1):
        raise ValueError("rows must run downwards and columns to the right")


def _channels(names: list[str]) -> list[int]:
    """Where R, G, B are; one grey channel stands for all three."""
    found = {name.upper(): i for i, name in reversed(list(enumerate(names)))}
    if all(c in found for c in "RGB"):
        return [found[c] for c in "RGB"]
    colours = [i for i, name in enumerate(names) if name.upper() not in ("A", "Z")]
    if len(colours) == 1:
        return colours * 3
    raise ValueError(f"needs channels R, G, B or a single one, got {names}")


def _checked(path: Path, pixels: np.ndarray, repair: bool) -> np.ndarray:
    nan, negative, infinite = np.isnan(pixels), pixels < 0, pixels == np.inf
    counts = {"NaN": nan, "negative": negative, "infinite": infinite}
    faults = ", ".join(f"{int(bad.sum())} {name}" for name, bad in counts.items() if bad.any())
    if faults and not repair:
        raise ValueError(f"{path}: {faults} values; read it with repair=True to replace them")
    if faults:
        warnings.warn(f"{path}: replaced {faults} values", UserWarning, stacklevel=3)
        pixels = np.where(nan | negative, 0, pixels)
        largest = np.max(pixels, initial=0, where=~infinite)
        pixels = np.where(infinite, largest, pixels)
    if not pixels.any():
        raise ValueError(f"{path}: the picture is all black")
    return pixels.astype(np.float32)
