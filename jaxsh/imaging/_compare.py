"""How far one picture is from another."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float


def psnr(
    image: Float[Array, "h w c"],
    reference: Float[Array, "h w c"],
    mask: Bool[Array, "h w"] | None = None,
    peak: float = 1.0,
) -> Float[Array, ""]:
    """Peak signal-to-noise ratio in dB: 10 log10(peak² / mean squared error).

    The mean is over the channels of the pixels in `mask`, or of all pixels; infinite where the
    pictures are equal there, and NaN where the mask is empty. Differentiable in both pictures,
    with zero gradient where they are equal.
    """
    return _psnr(image, reference, mask, peak)


@jax.jit
def _psnr(image, reference, mask, peak) -> Float[Array, ""]:
    squared = jnp.mean((image - reference) ** 2, axis=-1)
    error = jnp.mean(squared, where=mask)
    differs = error != 0
    return jnp.where(differs, 10 * jnp.log10(peak**2 / jnp.where(differs, error, 1)), jnp.inf)
