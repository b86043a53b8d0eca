"""Transfer in eight bits a coefficient: a quarter to read of every frame."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int8

from ..harmonics import degree_of
from ._transfer import Transfer

# Vertices side by side: a block's coefficients stay in the first cache.
_BLOCK = 128
_LARGEST = 127


class QuantizedTransfer(eqx.Module):
    """The coefficients of V vertices in whole steps of eight bits: made once by `quantize`.

    For `shade_diffuse`, which reads each coefficient once a frame and waits for memory: this is a
    quarter of it.
    """

    whole: Int8[Array, "blocks k b"]  # vertices in their order, the last block filled up with 0
    steps: Float[Array, " k"]
    count: int = eqx.field(static=True)  # V

    @property
    def dtype(self) -> jnp.dtype:
        """Of what is shaded with it."""
        return self.steps.dtype

    @property
    def degree(self) -> int:
        return degree_of(len(self.steps))


def quantize(transfer: Transfer) -> QuantizedTransfer:
    """The transfer's coefficients, rounded to eight bits.

    A step is 1/127 of the largest of all vertices' coefficients, for each harmonic by itself, and
    what is lost at most half a step. Experiment `leekim2014.table1` prints what that is in a
    picture. Neither traceable nor differentiable; raises `ValueError` for coefficients that are
    not finite.
    """
    if not np.isfinite(np.asarray(transfer.coefficients)).all():
        raise ValueError("expected coefficients that are finite everywhere")
    count, width = transfer.coefficients.shape
    whole, steps = in_steps(transfer.coefficients, 0)
    blocks = jnp.pad(whole, ((0, -count % _BLOCK), (0, 0))).reshape(-1, _BLOCK, width)
    return QuantizedTransfer(jnp.swapaxes(blocks, 1, 2), steps, count)


@functools.partial(jax.jit, static_argnums=1)
def in_steps(
    values: Float[Array, "..."], axis: int
) -> tuple[Int8[Array, "..."], Float[Array, "..."]]:
    """Whole numbers from -127 to 127, and the steps that they count, shared along an axis."""
    largest = jnp.max(jnp.abs(values), axis=axis)
    # Of zeros, steps of one; what is not finite makes its step so, and all that it counts.
    steps = jnp.where(largest == 0, 1.0, largest / _LARGEST)
    return jnp.round(values / jnp.expand_dims(steps, axis)).astype(jnp.int8), steps
