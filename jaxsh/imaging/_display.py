"""From linear radiance to what a screen shows."""

import functools
import math
from typing import Literal

import jax
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Bool, Float

from .._core.linalg import einsum
from .._core.xla import keep_rows

_LUMINANCE = (0.2126, 0.7152, 0.0722)  # of linear Rec. 709


@jax.jit
def srgb_encode(linear: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """Linear light in [0, 1] to sRGB's signal (IEC 61966-2-1), the exact two-part curve.

    Below 0 the linear part goes on, above 1 the power. Gradients are finite everywhere; the
    curve has its small standard kink (and step, 3e-8) at 0.0031308.
    """
    low = linear <= 0.0031308
    power = jnp.where(low, 0.0031308, linear) ** (1 / 2.4)
    return jnp.where(low, 12.92 * linear, 1.055 * power - 0.055)


@jax.jit
def srgb_decode(signal: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """The inverse of `srgb_encode`: sRGB's signal to linear light."""
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
    """Linear radiance, times `exposure`, through a curve to [0, 1] and encoded as sRGB.

    "clip" cuts at 1. "reinhard" takes the exposed luminance L (Rec. 709) to L (1 + L/white²) /
    (1 + L) and keeps the ratios of R, G, B, which are in the last axis; `white` is the least
    luminance that becomes 1, and with the default, infinity, none does (Reinhard et al. 2002,
    eq. 4 and 3, without the paper's scaling to the picture's key: that is `exposure`). What is
    still outside [0, 1], as a saturated color may be, is clipped, negative light before the curve.

    Differentiable in image, exposure and white; the gradient is zero where the result is clipped.
    Raises `ValueError` for an unknown curve, a last axis that is not R, G, B, and, where it is
    concrete, a white that is not above 0.
    """
    if curve not in ("clip", "reinhard"):
        raise ValueError(f'curve must be "clip" or "reinhard", got {curve!r}')
    if curve == "reinhard" and image.shape[-1:] != (3,):
        raise ValueError(f"a luminance needs R, G, B in the last axis, got shape {image.shape}")
    if curve == "reinhard" and not isinstance(white, Tracer) and not white > 0:
        raise ValueError(f"white must be above 0, got {white}")
    return _tone_map(image, exposure, white, curve)


# One program for a picture, not one for each step.
@functools.partial(jax.jit, static_argnums=3)
def _tone_map(image, exposure, white, curve: str) -> Float[Array, "*shape"]:
    exposed = image * jnp.asarray(exposure, image.dtype)
    if curve == "reinhard":
        exposed = _reinhard(exposed, white)
    return srgb_encode(jnp.clip(exposed, 0, 1))


def _reinhard(
    image: Float[Array, "*shape"], white: float | Float[Array, ""]
) -> Float[Array, "*shape"]:
    image = jnp.maximum(image, 0)
    weights = jnp.asarray(_LUMINANCE, image.dtype)
    luminance = einsum("...c,c->...", image, weights)[..., None]
    white = jnp.asarray(white, image.dtype)
    return image * ((1 + luminance / white / white) / (1 + luminance))


def auto_exposure(
    image: Float[Array, "h w c"],
    mask: Bool[Array, "h w"] | None = None,
    percentile: float = 99.0,
) -> Float[Array, ""]:
    """The exposure that takes a percentile of the pixels' largest channel to 1.

    Over the pixels of `mask` where given. 1 where that percentile is not above zero, or there is
    no pixel. Differentiable in the image.
    """
    if not 0 <= percentile <= 100:
        raise ValueError(f"percentile must be between 0 and 100, got {percentile}")
    exposure = functools.partial(_auto_exposure, percentile=percentile)
    return keep_rows(exposure, image, mask, like=image, axis=0, out=None)


@functools.partial(jax.jit, static_argnames="percentile")
def _auto_exposure(image, mask, percentile: float) -> Float[Array, ""]:
    brightest = jnp.max(image, axis=-1)
    if mask is not None:
        brightest = jnp.where(mask, brightest, jnp.nan)
    level = jnp.nanpercentile(brightest, percentile)
    return jnp.where(level > 0, 1 / jnp.where(level > 0, level, 1), 1)
