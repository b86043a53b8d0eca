"""Light probes: from files, and one built in."""

import os
import warnings
from collections.abc import Sequence
from pathlib import Path

import jax
import numpy as np
from jaxtyping import Array, Float

from .._core.checks import as_path, check_flag, check_size, check_type
from .._core.host import put
from .._core.words import reason
from ._files import FORMATS, Picture, check_encoding, read_picture
from ._layouts import check_shape, used_pixels
from ._orientation import axes_of, check_options, turn_columns
from ._resample import resample

_MAX_HEIGHT = 8192

File = str | os.PathLike[str]

# Lobes exp(κ (cos γ - 1)) around a direction: (direction, κ, linear RGB at the center).
_LOBES = (
    ((-0.55, -0.62, 0.56), 600.0, (900.0, 800.0, 640.0)),  # sun: 2.3° to a standard deviation
    ((0.80, -0.50, 0.32), 14.0, (1.9, 2.2, 2.8)),  # softbox: 15°, cool, opposite the sun
    ((0.25, 0.93, 0.28), 40.0, (6.0, 4.2, 2.6)),  # rim light from behind: 9°, warm
)
_ZENITH, _HORIZON, _GROUND = (0.16, 0.26, 0.48), (0.62, 0.50, 0.38), (0.085, 0.07, 0.055)


def read_environment(
    path: File | Sequence[File],
    *,
    layout: str | None = None,
    orientation: str | None = None,
    encoding: str | None = None,
    layer: str | None = None,
    height: int | None = None,
    repair: bool = False,
) -> Float[Array, "h w 3"]:
    """Read a light probe: linear radiance in Rec. 709, float32, in the file's unit.

    Reads .exr, .hdr (also .pic), .pfm, .npy and float .tif, and with `encoding` .png, .jpg, .tif
    and .npy of 8 or 16 bits: "srgb" decodes sRGB's curve, "linear" takes numbers in proportion to
    light; 1 is the largest. `docs/what-is-read.md` says what is read of each format and how.

    The result is a lat-long picture in our orientation, whatever the file's: row 0 touches +z,
    column 0 starts at φ = 0 (+x), φ grows to the right, towards +y. A gray picture gives three
    equal channels; channels other than R, G, B, also alpha, are left out. Primaries that an
    OpenEXR or Radiance file names, and Radiance's XYZE, are converted to Rec. 709. An .hdr
    header's EXPOSURE and COLORCORR or a .pfm header's scale are not applied.

    Layouts and their orientations (`docs/conventions.md` has the table with each one's axes). By
    default they are those that an OpenEXR file names in its attribute `envmap`, and without one
    "lat-long" and "jaxsh":

    - "lat-long", 2 : 1 to 1 %: "jaxsh"; "mitsuba", "nvdiffrec" (y-up, turned as in
      `read_mesh(up="y")`); "blender"; "debevec" (a panorama seen from inside, its center at -x);
      "openexr" (as "mitsuba", its outermost pixels centered on the poles and on the seam).
    - "angular-map", 1 : 1, Debevec's light probe: the direction at an angle of π·r from forward
      is at radius r, 1 at the circle. "jaxsh": forward, the picture's center, at -x, its right at
      +y, its up at +z. "-z", "+z": y-up axes with forward at -z or +z and +x to the right;
      "+z" is Debevec's formula r = acos(z)/π, which mirrors a scene in right-handed axes.
    - "horizontal-cross", 4 : 3, "vertical-cross", 3 : 4: forward in the middle; the vertical one
      has the back at its foot, upside down, as Debevec's. Orientations as for the angular map.
    - "cube", six faces +x, -x, +y, -y, +z, -z, one below the other in a file or in a sequence of
      six: "jaxsh": our axes, as in `sphere.cube_map`. "opengl": the same table in right-handed
      y-up axes. "direct3d": in left-handed ones, +z forward, and placed like a cross. "openexr":
      OpenEXR's own, y-up, seen from inside, its outermost pixels centered on the cube's edges.

    A lat-long picture is only flipped and rolled, exactly (a quarter turn of an odd number of rows
    is by half a column, and takes means of two). All others are resampled: `height` rows, by
    default with as many columns as the picture has pixels on a great circle, up to 2048 rows; a
    lat-long picture too where `height` is another than its own or its orientation is "openexr".
    Each pixel is the mean over its
    solid angle, of 16 samples or more, bilinear in the source. The integral over the sphere then
    differs from that of the source's pixels, weighed with their exact solid angles, by less than
    1e-4 for real probes (angular maps of 1000 pixels, crosses and cubes of 256), and by less than
    2e-3 for noise from pixel to pixel (angular maps of 64 pixels, the worst).

    `layer` names a layer of an OpenEXR file (`beauty.R` is of layer "beauty") or a part of it; by
    default the first part with plain R, G, B or Y is read, or the only layer.

    A picture with NaN, negative or infinite values is refused with their numbers; with
    `repair=True` NaN and negative ones become 0 and infinite ones the largest finite value of
    the picture, and a `UserWarning` counts them; pixels that an OpenEXR file's display window has
    and its data window lacks become 0 without one. What lies outside an angular map's circle or a
    cross's cells is not looked at. Raises `FileNotFoundError` for a missing file and `ValueError`,
    naming the file and the problem, for any other fault: a damaged or truncated file, one that is
    all black, another shape, integers without `encoding`, an unknown option. Raises `ImportError`
    where OpenImageIO cannot be imported; .hdr, .pfm and .npy need it not. Runs on the host.

    **Example**

    >>> import pathlib, tempfile
    >>> from jaxsh import imaging
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = imaging.write_image(pathlib.Path(folder) / "a.exr", imaging.studio(8, 16))
    ...     imaging.read_environment(path).shape
    (8, 16, 3)
    """
    for name, word in (("layout", layout), ("orientation", orientation), ("layer", layer)):
        if word is not None:
            check_type(name, word, str)
    repair = check_flag("repair", repair)
    check_options(layout, orientation)
    check_encoding(encoding)
    if height is not None and not 1 <= check_size("height", height, 0) <= _MAX_HEIGHT:
        raise ValueError(f"height must be between 1 and {_MAX_HEIGHT}, got {height}")
    paths = [as_path(p) for p in (path if isinstance(path, list | tuple) else [path])]
    if len(paths) != 1 and (layout != "cube" or len(paths) != 6):
        raise ValueError(f"layout {layout or 'lat-long'!r} does not come in {len(paths)} files")
    faces = [_read(p, encoding, layer, repair) for p in paths]
    if len({face.pixels.shape for face in faces}) > 1:
        sizes = ", ".join(
            f"{p}: {f.pixels.shape[1]} × {f.pixels.shape[0]}"
            for p, f in zip(paths, faces, strict=True)
        )
        raise ValueError(f"six faces must have one size, got {sizes}")
    name = ", ".join(map(str, paths))
    pixels = faces[0].pixels if len(faces) == 1 else np.concatenate([f.pixels for f in faces])
    try:
        layout, orientation = _placed(layout, orientation, faces)
        axes = axes_of(layout, orientation)
        at_edges = orientation == "openexr"
        check_shape(layout, *pixels.shape[:2])
        pixels, replaced = _checked(layout, pixels, repair)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    if replaced:
        warnings.warn(f"{name}: replaced {replaced} values", UserWarning, stacklevel=2)
    if layout == "lat-long" and height in (None, len(pixels)) and not at_edges:
        pixels = turn_columns(pixels, axes)
    else:
        pixels = resample(layout, pixels, axes, height, at_edges=at_edges)
    # Aligned memory is taken as it is, and nobody else has it.
    return jax.device_put(np.ascontiguousarray(pixels))


def _placed(
    layout: str | None, orientation: str | None, faces: list[Picture]
) -> tuple[str, str | None]:
    """Layout and orientation: the caller's, else the file's, else our own lat-long."""
    named = faces[0].layout if len(faces) == 1 else None
    layout = layout or named or "lat-long"
    if orientation is None and layout == named:
        return layout, "openexr"
    return layout, orientation


def _read(path: Path, encoding: str | None, layer: str | None, repair: bool) -> Picture:
    if path.suffix.lower() not in FORMATS:
        raise ValueError(f"{path}: cannot read {path.suffix or 'no extension'}, only {FORMATS}")
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such picture")
    try:
        return read_picture(path, encoding, layer, repair)
    except ValueError as error:
        raise ValueError(f"{path}: {reason(error, 350)}") from error


def _checked(
    layout: str, pixels: Float[np.ndarray, "h w 3"], repair: bool
) -> tuple[Float[np.ndarray, "h w 3"], str]:
    """Give pixels fit to be light, black where they are not used, and name what was replaced."""
    if layout != "lat-long":
        used = used_pixels(layout, *pixels.shape[:2])
        pixels = np.where(used[..., None], pixels, np.float32(0))
    least, most = pixels.min(), pixels.max()  # of NaN, if there is one
    if not (least >= 0 and most < np.inf):
        return _repaired(pixels, repair)
    if most == 0:
        raise ValueError("the picture is all black")
    return pixels, ""


def _repaired(
    pixels: Float[np.ndarray, "h w 3"], repair: bool
) -> tuple[Float[np.ndarray, "h w 3"], str]:
    nan, negative, infinite = np.isnan(pixels), pixels < 0, pixels == np.inf
    counts = {"NaN": nan, "negative": negative, "infinite": infinite}
    faults = ", ".join(f"{int(bad.sum())} {name}" for name, bad in counts.items() if bad.any())
    if not repair:
        raise ValueError(f"{faults} values; read it with repair=True to replace them")
    pixels = np.where(nan | negative, 0, pixels)
    pixels = np.where(infinite, np.max(pixels, initial=0, where=~infinite), pixels)
    if not pixels.any():
        raise ValueError("the picture is all black")
    return pixels, faults


def studio(height: int = 256, width: int = 512) -> Float[Array, "height width 3"]:
    """Make up a light probe: linear radiance, lat-long, float32, positive and finite.

    A dim sky, warm towards the horizon, over darker ground, with a small bright sun (peak 900,
    upper left front for a viewer at -y), a softbox to the right and a rim light behind. The sun
    is a smooth lobe 2.3° wide: from 128 rows on, pixels resolve it. Raises `ValueError` for a
    picture without pixels.

    **Example**

    >>> from jaxsh import imaging
    >>> imaging.studio(8, 16).shape
    (8, 16, 3)
    """
    height, width = check_size("height", height, 0), check_size("width", width, 0)
    if height < 1 or width < 1:
        raise ValueError(f"a picture needs pixels, got {width} × {height}")
    theta = (np.arange(height)[:, None] + 0.5) * np.pi / height
    phi = (np.arange(width) + 0.5) * 2 * np.pi / width
    z = np.broadcast_to(np.cos(theta), (height, width))
    directions = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), z], axis=-1)

    elevation = np.clip(z, 0, 1)[..., None]
    sky = _ZENITH + np.exp(-4 * elevation) * np.subtract(_HORIZON, _ZENITH)
    # The horizon is a soft step, so that it rings no more than a real one.
    above = 1 / (1 + np.exp(-z[..., None] / 0.03))
    radiance = above * sky + (1 - above) * np.array(_GROUND)
    for direction, kappa, color in _LOBES:
        cosine = directions @ (np.array(direction) / np.linalg.norm(direction))
        radiance = radiance + np.exp(kappa * (cosine - 1))[..., None] * np.array(color)
    return put(radiance, np.float32)
