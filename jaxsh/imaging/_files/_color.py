"""Colors brought to linear Rec. 709: other primaries, luminance and chroma, coded integers."""

import numpy as np
from jaxtyping import Float, UInt

from ..._core import srgb

# x, y of red, green, blue and white (D65).
REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
XYZ = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)
_ENCODINGS = ("srgb", "linear")


def to_rec709(chromaticities: tuple[float, ...]) -> Float[np.ndarray, "3 3"]:
    """Compute the matrix from linear RGB of these primaries and white to that of Rec. 709.

    Colors stay the colors that they are: no adaptation to another white. Raises `ValueError` for
    primaries that span no colors.
    """
    return np.linalg.inv(_to_xyz(REC709)) @ _to_xyz(chromaticities)


def luminance_weights(chromaticities: tuple[float, ...]) -> Float[np.ndarray, " 3"]:
    """Compute the luminance of red, green and blue."""
    return _to_xyz(chromaticities)[1]


def _to_xyz(chromaticities: tuple[float, ...]) -> Float[np.ndarray, "3 3"]:
    x, y = np.reshape(np.array(chromaticities, np.float64), (4, 2)).T
    colors = np.stack([x, y, 1 - x - y])
    if not (np.isfinite(colors).all() and y[3] > 0 and abs(np.linalg.det(colors[:, :3])) > 1e-6):
        raise ValueError(f"damaged: chromaticities {tuple(chromaticities)} span no colors")
    primaries, white = colors[:, :3], colors[:, 3] / y[3]
    return primaries * np.linalg.solve(primaries, white)


def converted(
    pixels: Float[np.ndarray, "h w 3"], matrix: Float[np.ndarray, "3 3"]
) -> Float[np.ndarray, "h w 3"]:
    """Apply a matrix to each pixel in float32; NaN and infinities meet what they meet."""
    with np.errstate(invalid="ignore", over="ignore"):
        # Not a matrix product: one infinite channel is not to make NaN of zero weights.
        out = [
            sum(pixels[..., i] * np.float32(weight) for i, weight in enumerate(row) if weight)
            for row in matrix
        ]
    return np.stack(out, axis=-1).astype(np.float32)


def from_luminance_chroma(
    pixels: Float[np.ndarray, "h w 3"], weights: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, "h w 3"]:
    """Compute R, G and B from Y, RY = (R - Y)/Y and BY = (B - Y)/Y."""
    luminance, red, blue = np.moveaxis(pixels, -1, 0)
    r, b = (red + 1) * luminance, (blue + 1) * luminance
    g = (luminance - np.float32(weights[0]) * r - np.float32(weights[2]) * b) / np.float32(
        weights[1]
    )
    return np.stack([r, g, b], axis=-1)


def decoded(pixels: UInt[np.ndarray, "..."], encoding: str | None) -> Float[np.ndarray, "..."]:
    """Decode 8 or 16 bits to linear light in [0, 1], float32, as `encoding` says.

    Raises `ValueError` where no encoding is given, or one that is not known.
    """
    if encoding is None:
        raise ValueError(
            f"the picture holds integers ({pixels.dtype}), which are no radiance until decoded: "
            'say encoding="srgb" (or "linear", where they are proportional to light)'
        )
    most = np.iinfo(pixels.dtype).max
    signal = np.arange(most + 1) / most
    if encoding == "srgb":
        signal = srgb.decode(signal)
    return signal.astype(np.float32)[pixels]


def check_encoding(encoding: str | None) -> None:
    """Refuse an encoding that is not known."""
    if encoding is not None and encoding not in _ENCODINGS:
        raise ValueError(f"encoding must be one of {_ENCODINGS} or None, got {encoding!r}")
