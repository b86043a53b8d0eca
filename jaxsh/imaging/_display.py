"""Tone curves from linear radiance to what a screen shows, and the distance of two pictures."""

import functools
import math
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Bool, Float

from .._core.checks import as_float, check_choice, check_number, described
from .._core.host import put
from .._core.known import host_known, is_concrete
from .._core.linalg import einsum
from .._core.pictures import as_picture, as_radiance
from .._core.srgb import LUMINANCE
from .._core.xla import keep_rows


def srgb_encode(linear: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """Encode linear light in [0, 1] as sRGB's signal (IEC 61966-2-1), by the exact two-part curve.

    Takes any shape. Below 0 the linear part goes on, above 1 the power. Differentiable, with
    finite gradients everywhere; the curve has its small standard kink (and step, 3e-8) at
    0.0031308. Raises `ValueError` for integers.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import imaging
    >>> round(float(imaging.srgb_encode(jnp.asarray(0.18))), 3)
    0.461
    """
    return _srgb_encode(as_radiance("linear", linear))


@jax.jit
def _srgb_encode(linear: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    low = linear <= 0.0031308
    power = jnp.where(low, 0.0031308, linear) ** (1 / 2.4)
    return jnp.where(low, 12.92 * linear, 1.055 * power - 0.055)


def srgb_decode(signal: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """Decode sRGB's signal to linear light: the inverse of `srgb_encode`.

    Takes any shape; 8 bits as `image / 255`. Differentiable, with the same kink. Raises
    `ValueError` for integers.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import imaging
    >>> round(float(imaging.srgb_decode(jnp.asarray(0.5))), 3)
    0.214
    """
    return _srgb_decode(as_radiance("signal", signal))


@jax.jit
def _srgb_decode(signal: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    low = signal <= 0.04045
    power = ((jnp.where(low, 0.04045, signal) + 0.055) / 1.055) ** 2.4
    return jnp.where(low, signal / 12.92, power)


def tone_map(
    image: Float[Array, "*shape"],
    exposure: float | Float[Array, ""] = 1.0,
    *,
    curve: Literal["clip", "reinhard"] = "clip",
    white: float | Float[Array, ""] = math.inf,
) -> Float[Array, "*shape"]:
    """Map linear radiance, times `exposure`, by a curve to [0, 1], and encode it as sRGB.

    "clip" cuts at 1. "reinhard" takes the exposed luminance L (Rec. 709) to L (1 + L/white²) /
    (1 + L) and keeps the ratios of R, G, B, which are in the last axis; `white` is the least
    luminance that becomes 1, and with the default, infinity, none does (Reinhard et al. 2002,
    eq. 4 and 3, without the paper's scaling to the picture's key: that is `exposure`). Values
    still outside [0, 1], as in a saturated color, are clipped; negative light before the curve.

    Differentiable in image, exposure and white; the gradient is zero where the result is clipped.
    Pixel by pixel, so it shards along any axis but the colors'.
    Raises `ValueError` for an unknown curve, a last axis that is not R, G, B, integers, and,
    where it is concrete, a white that is not above 0.

    **Example**

    >>> from jaxsh import imaging
    >>> image = imaging.studio(8, 16)
    >>> shown = imaging.tone_map(image, imaging.auto_exposure(image), curve="reinhard")
    >>> shown.shape, bool((shown <= 1).all())
    ((8, 16, 3), True)
    """
    check_choice("curve", curve, ("clip", "reinhard"))
    for name, number in (("exposure", exposure), ("white", white)):
        if not isinstance(number, float) and as_float(number, name).ndim:
            raise ValueError(f"expected {name} as a number, got {described(number)}")
    image = as_radiance("image", image)
    if curve == "reinhard" and image.shape[-1:] != (3,):
        raise ValueError(f"expected image with R, G, B in the last axis, got shape {image.shape}")
    if curve == "reinhard" and is_concrete(white) and not float(white) > 0:
        raise ValueError(f"white must be above 0, got {float(white)}")
    return _tone_map(image, exposure, white, curve)


# One program for a picture, not one for each step.
@functools.partial(jax.jit, static_argnums=3)
def _tone_map(image, exposure, white, curve: str) -> Float[Array, "*shape"]:
    exposed = image * jnp.asarray(exposure, image.dtype)
    if curve == "reinhard":
        exposed = _reinhard(exposed, white)
    return _srgb_encode(jnp.clip(exposed, 0, 1))


def _reinhard(
    image: Float[Array, "*shape"], white: float | Float[Array, ""]
) -> Float[Array, "*shape"]:
    image = jnp.maximum(image, 0)
    weights = jnp.asarray(LUMINANCE, image.dtype)
    luminance = einsum("...c,c->...", image, weights)[..., None]
    white = jnp.asarray(white, image.dtype)
    return image * ((1 + luminance / white / white) / (1 + luminance))


def auto_exposure(
    image: Float[Array, "h w c"],
    mask: Bool[Array, "h w"] | None = None,
    percentile: float = 99.0,
) -> Float[Array, ""]:
    """Choose the exposure that takes a percentile of the pixels' largest channel to 1.

    Over the pixels of `mask` (h, w) where given. 1 where that percentile is not above zero, or
    there is no pixel. Raises `ValueError` for a percentile outside [0, 100], integers and other
    shapes. Differentiable in the image. One number for a whole picture: where its rows are shared
    out they are gathered, for a percentile wants all pixels together (a batch by `vmap` shards);
    inside `shard_map` it is that of the rows at hand.

    **Example**

    >>> from jaxsh import imaging
    >>> imaging.auto_exposure(imaging.studio(8, 16), percentile=90.0).shape
    ()
    """
    percentile = check_number("percentile", percentile, least=0.0, most=100.0)
    image = as_picture("image", image)
    _check_mask(mask, image)
    if host_known(image) and (mask is None or host_known(mask)):
        return put(_known_exposure(np.asarray(image), mask, percentile), image.dtype)
    exposure = functools.partial(_auto_exposure, percentile=percentile)
    return keep_rows(exposure, image, mask, like=image, axis=0, out=None)


@functools.partial(jax.jit, static_argnames="percentile")
def _auto_exposure(image, mask, percentile: float) -> Float[Array, ""]:
    brightest = jnp.max(image, axis=-1)
    if mask is not None:
        brightest = jnp.where(mask, brightest, jnp.nan)
    level = jnp.nanpercentile(brightest, percentile)
    return jnp.where(level > 0, 1 / jnp.where(level > 0, level, 1), 1)


def _known_exposure(image: np.ndarray, mask: Any, percentile: float) -> np.ndarray:
    """`_auto_exposure` on the host, where NumPy need not sort all pixels."""
    brightest = functools.reduce(np.maximum, np.moveaxis(image, -1, 0))
    brightest = brightest.ravel() if mask is None else brightest[np.asarray(mask)]
    brightest = brightest[~np.isnan(brightest)]
    with np.errstate(over="ignore", invalid="ignore"):  # as XLA computes
        level = np.percentile(brightest, percentile) if len(brightest) else 0
        if np.isnan(level):  # between infinite ones NumPy takes a difference
            level = np.percentile(brightest, percentile, method="lower")
        return np.asarray(1 / level if level > 0 else 1)


def psnr(
    image: Float[Array, "h w c"],
    reference: Float[Array, "h w c"],
    mask: Bool[Array, "h w"] | None = None,
    peak: float = 1.0,
) -> Float[Array, ""]:
    """Compute the peak signal-to-noise ratio in dB: 10 log10(peak² / mean squared error).

    The mean is over the channels of the pixels in `mask` (h, w), or of all pixels; infinite where
    the pictures are equal there, and NaN where the mask is empty. Differentiable in both pictures,
    with zero gradient where they are equal. Rows may be shared out between devices; inside
    `shard_map` it is the ratio of the rows at hand. Raises `ValueError` for integers, two shapes,
    another shape of the mask, and, where it is concrete, a peak that is not above 0.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import imaging
    >>> image = imaging.studio(8, 16)
    >>> round(float(imaging.psnr(image, image + 0.1)), 3)
    20.0
    """
    image, reference = as_picture("image", image), as_picture("reference", reference)
    if image.shape != reference.shape:
        raise ValueError(
            f"expected image and reference of one shape, got {image.shape} and {reference.shape}"
        )
    _check_mask(mask, image)
    if as_float(peak, "peak").ndim:
        raise ValueError(f"expected peak as a number, got {described(peak)}")
    if not isinstance(peak, Tracer):
        check_number("peak", peak, above=0.0)
    return _psnr(image, reference, mask, peak)


def _check_mask(mask: Bool[Array, "h w"] | None, image: Float[Array, "h w c"]) -> None:
    if mask is not None and not hasattr(mask, "dtype"):
        raise ValueError(
            f"expected mask as booleans of shape {image.shape[:2]}, got {described(mask)}"
        )
    if mask is not None and (mask.shape != image.shape[:2] or mask.dtype != bool):
        raise ValueError(
            f"expected mask as booleans of shape {image.shape[:2]}, got {mask.dtype} of shape "
            f"{mask.shape}"
        )


@jax.jit
def _psnr(image, reference, mask, peak) -> Float[Array, ""]:
    squared = jnp.mean((image - reference) ** 2, axis=-1)
    error = jnp.mean(squared, where=mask)
    differs = error != 0
    return jnp.where(differs, 10 * jnp.log10(peak**2 / jnp.where(differs, error, 1)), jnp.inf)
