"""From linear radiance to what a screen shows."""

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float


def srgb_encode(linear: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """Linear light in [0, 1] to sRGB's signal (IEC 61966-2-1), the exact two-part curve.

    Below 0 the linear part goes on, above 1 the power. Gradients are finite everywhere; the
    curve has its small standard kink (and step, 3e-8) at 0.0031308.
    """
    low = linear <= 0.0031308
    power = jnp.where(low, 0.0031308, linear) ** (1 / 2.4)
    return jnp.where(low, 12.92 * linear, 1.055 * power - 0.055)


def srgb_decode(signal: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """The inverse of `srgb_encode`: sRGB's signal to linear light."""
    low = signal <= 0.04045
    power = ((jnp.where(low, 0.04045, signal) + 0.055) / 1.055) ** 2.4
    return jnp.where(low, signal / 12.92, power)


def tone_map(
    image: Float[Array, "*shape"], exposure: float | Float[Array, ""] = 1.0
) -> Float[Array, "*shape"]:
    """Linear radiance, times `exposure`, clipped to [0, 1] and encoded as sRGB.

    Differentiable in both; the gradient is zero where the result is clipped.
    """
    return srgb_encode(jnp.clip(image * jnp.asarray(exposure, image.dtype), 0, 1))


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
    brightest = jnp.max(image, axis=-1)
    if mask is not None:
        brightest = jnp.where(mask, brightest, jnp.nan)
    level = jnp.nanpercentile(brightest, percentile)
    return jnp.where(level > 0, 1 / jnp.where(level > 0, level, 1), 1)
