"""Sums along the columns of a lat-long picture, with cosines and sines that repeat themselves.

Half a turn further on (φ + π) and below the equator (π − θ) they are the same up to their sign. So
a picture can be folded to a quarter first, which leaves a quarter of the multiplications.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from .._core.linalg import einsum
from .._core.xla import on_mesh

# On a CPU up to this degree, folding takes longer than what it saves.
_DEGREE = 20
# Numbers of each of the four folds of a block, which is to stay in cache, and its least columns.
_BLOCK, _COLUMNS = 2**18 + 2**17, 16


class Kind(NamedTuple):
    """The orders that are even, or odd: their meridians are sums of cosines, or of sines."""

    orders: Int[np.ndarray, " m"]
    waves: slice  # of the table of waves
    mirrored: int  # of these, the first so many are the same at π − θ; the others change sign
    meridians: Float[np.ndarray, "m l k"]  # coefficients of the waves; zero where l < |m|
    azimuths: Float[np.ndarray, "m w"]  # cos mφ, or sin |m|φ where m < 0


def sums_along_columns(
    image: Float[Array, "h w c"], waves: Float[np.ndarray, "k h"], kinds: Sequence[Kind]
) -> list[Array]:
    """Sum the rows with each wave, by kind (k, w, c); of columns that can be folded the half."""
    height, width, channels = image.shape
    factors = waves.T.astype(image.dtype)

    def plain(image):
        columns = of_rows("hk,h...->k...", factors, image)
        parts = [columns[kind.waves] for kind in kinds]
        if width % 2 or on_mesh(image):
            return parts
        halves = [jnp.split(part, 2, axis=1) for part in parts]
        return [a - b if i else a + b for i, (a, b) in enumerate(halves)]  # odd orders change sign

    columns = _columns_of_a_block(height, width, channels)
    if on_mesh(image) or not columns or len(kinds[0].orders) <= _DEGREE:
        return plain(image)

    def folded(image):
        return _folded(image, factors, kinds, columns)

    # Its derivative is the plain one: that of a loop would add a picture for each block.
    @jax.custom_jvp
    def either(image):
        return jax.lax.platform_dependent(image, cpu=folded, default=plain)

    either.defjvp(lambda images, tangents: (either(*images), plain(*tangents)))
    return either(image)


def of_rows(
    subscripts: str, factors: ArrayLike, rows: Float[Array, "r w c"]
) -> Float[Array, "s w c"]:
    """Sums of rows with factors: one product over columns and channels as they lie in memory."""
    if on_mesh(rows):  # flat, columns and channels would lose their sharding
        return einsum(subscripts, factors, rows)
    # Flat, the derivative is such a product too. XLA would transpose the picture that it makes.
    flat = einsum(subscripts, factors, rows.reshape(len(rows), -1))
    return flat.reshape(len(flat), *rows.shape[1:])


def _folded(image, factors, kinds, columns: int) -> list[Array]:
    height, width, channels = image.shape
    rows, half, block = height // 2, width * channels // 2, columns * channels
    flat = image.reshape(height, -1)

    def piece(row, column):  # cut out alone: XLA's loop over a part of a cut is slow
        return jax.lax.dynamic_slice(flat, (np.int32(row), column), (rows, block))

    def sums(start):
        here, across = piece(0, start), piece(0, start + np.int32(half))
        below, below_across = piece(rows, start)[::-1], piece(rows, start + np.int32(half))[::-1]
        folds = (here + across, below + below_across), (here - across, below - below_across)
        parts = []
        for kind, (upper, lower) in zip(kinds, folds, strict=True):
            table = factors[:rows, kind.waves]
            same, changed = table[:, : kind.mirrored], table[:, kind.mirrored :]
            parts.append(einsum("hk,hn->kn", same, upper + lower))
            parts.append(einsum("hk,hn->kn", changed, upper - lower))
        return jnp.concatenate(parts)

    if block == half:
        found = sums(np.int32(0))
    else:
        blocks = jax.lax.map(sums, jnp.arange(0, half, block, dtype=np.int32))
        found = jnp.moveaxis(blocks, 0, 1).reshape(-1, half)
    found = found.reshape(-1, width // 2, channels)
    return [found[kind.waves] for kind in kinds]


def _columns_of_a_block(height: int, width: int, channels: int) -> int:
    """The most columns that divide half a picture and stay in cache; none where they are few."""
    if height % 2 or width % 2:
        return 0
    half, most = width // 2, _BLOCK // (height // 2 * channels)
    found = max(n for n in range(1, half + 1) if half % n == 0 and n <= max(most, 1))
    return found if found >= _COLUMNS else 0
