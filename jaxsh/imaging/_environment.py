"""Light probes: from files, and one built in."""

import os
import warnings
from collections.abc import Sequence
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ._layouts import check_shape, used_pixels
from ._orientation import axes_of, turn_columns
from ._pixels import FORMATS, read_pixels
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
    layout: str = "lat-long",
    orientation: str = "jaxsh",
    height: int | None = None,
    repair: bool = False,
) -> Float[Array, "h w 3"]:
    """Read a light probe (.exr, .hdr, .pfm, .npy): linear radiance, float32, in the file's unit.

    The result is a lat-long picture in our orientation, whatever the file's: row 0 touches +z,
    column 0 starts at φ = 0 (+x), φ grows to the right, towards +y. Values are taken as linear
    Rec. 709; colors are not converted, and an .hdr header's EXPOSURE or a .pfm header's scale is
    not applied. A gray picture gives three equal channels; channels other than R, G, B are left
    out.

    Layouts and their orientations (`docs/conventions.md` has the table with each one's axes):

    - "lat-long", 2 : 1: "jaxsh"; "mitsuba", "nvdiffrec" (y-up, turned as in `read_mesh(up="y")`);
      "blender"; "debevec" (a panorama seen from inside, its center at -x).
    - "angular-map", 1 : 1, Debevec's light probe: the direction at an angle of π·r from forward
      is at radius r, 1 at the circle. "jaxsh": forward, the picture's center, at -x, its right at
      +y, its up at +z. "-z", "+z": y-up axes with forward at -z or +z and +x to the right;
      "+z" is Debevec's formula r = acos(z)/π, which mirrors a scene in right-handed axes.
    - "horizontal-cross", 4 : 3, "vertical-cross", 3 : 4: forward in the middle; the vertical one
      has the back at its foot, upside down, as Debevec's. Orientations as for the angular map.
    - "cube", six faces +x, -x, +y, -y, +z, -z, one below the other in a file or in a sequence of
      six: "jaxsh": our axes, as in `sphere.cube_map`. "opengl": the same table in right-handed
      y-up axes. "direct3d": in left-handed ones, +z forward, and placed like a cross.

    A lat-long picture is only flipped and rolled, exactly (a quarter turn of an odd number of rows
    is by half a column, and takes means of two). All others are resampled: `height` rows, by
    default with as many columns as the picture has pixels on a great circle, up to 2048 rows; a
    lat-long picture too where `height` is another than its own. Each pixel is the mean over its
    solid angle, of 16 samples or more, bilinear in the source. The integral over the sphere then
    differs from that of the source's pixels, weighed with their exact solid angles, by less than
    1e-4 for real probes (angular maps of 1000 pixels, crosses and cubes of 256), and by less than
    2e-3 for noise from pixel to pixel (angular maps of 64 pixels, the worst).

    A picture with NaN, negative or infinite values is refused with their numbers; with
    `repair=True` NaN and negative ones become 0 and infinite ones the largest finite value of
    the picture, and a `UserWarning` counts them. What lies outside an angular map's circle or a
    cross's cells is not looked at. Raises `FileNotFoundError` for a missing file and `ValueError`,
    naming the file and the problem, for any other fault: a damaged or truncated file, one that is
    all black, another shape, an unknown option. Raises `ImportError` for .exr and .hdr where
    OpenImageIO cannot be imported; .pfm and .npy need it not. Runs on the host.

    **Example**

    >>> import pathlib, tempfile
    >>> from jaxsh import imaging
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = imaging.write_image(pathlib.Path(folder) / "a.exr", imaging.studio(8, 16))
    ...     imaging.read_environment(path).shape
    (8, 16, 3)
    """
    axes = axes_of(layout, orientation)
    if height is not None and not 1 <= height <= _MAX_HEIGHT:
        raise ValueError(f"height must be between 1 and {_MAX_HEIGHT}, got {height}")
    paths = [Path(p) for p in ([path] if isinstance(path, str | os.PathLike) else path)]
    if len(paths) != 1 and (layout != "cube" or len(paths) != 6):
        raise ValueError(f"layout {layout!r} does not come in {len(paths)} files")
    faces = [_read(p) for p in paths]
    if len({face.shape for face in faces}) > 1:
        sizes = ", ".join(
            f"{p}: {f.shape[1]} × {f.shape[0]}" for p, f in zip(paths, faces, strict=True)
        )
        raise ValueError(f"six faces must have one size, got {sizes}")
    name, pixels = ", ".join(map(str, paths)), np.concatenate(faces)
    try:
        check_shape(layout, *pixels.shape[:2])
        pixels, replaced = _checked(pixels, used_pixels(layout, *pixels.shape[:2]), repair)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    if replaced:
        warnings.warn(f"{name}: replaced {replaced} values", UserWarning, stacklevel=2)
    if layout == "lat-long" and height in (None, len(pixels)):
        return jnp.asarray(turn_columns(pixels, axes))
    return jnp.asarray(resample(layout, pixels, axes, height))


def _read(path: Path) -> Float[np.ndarray, "h w 3"]:
    if path.suffix.lower() not in FORMATS:
        raise ValueError(f"{path}: cannot read {path.suffix or 'no extension'}, only {FORMATS}")
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such picture")
    try:
        return read_pixels(path)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _checked(
    pixels: Float[np.ndarray, "h w 3"], used: Bool[np.ndarray, "h w"], repair: bool
) -> tuple[Float[np.ndarray, "h w 3"], str]:
    """Give pixels fit to be light, black where they are not used, and name what was replaced."""
    pixels = np.where(used[..., None], pixels, np.float32(0))
    nan, negative, infinite = np.isnan(pixels), pixels < 0, pixels == np.inf
    counts = {"NaN": nan, "negative": negative, "infinite": infinite}
    faults = ", ".join(f"{int(bad.sum())} {name}" for name, bad in counts.items() if bad.any())
    if faults and not repair:
        raise ValueError(f"{faults} values; read it with repair=True to replace them")
    if faults:
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
    return jnp.asarray(radiance, jnp.float32)
