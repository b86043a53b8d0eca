"""Work on some of the vertices, at the cost of those alone, within one compiled program."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

# Vertices per pass: what they need stays in cache.
BLOCK = 1024
_ROW = 256


Work = Callable[[Int[Array, " block"]], Float[Array, "rows block"]]


def everywhere(work: Work, count: int) -> Float[Array, "rows v"]:
    """`work` on the numbers of all vertices, block by block."""
    blocks = -(-count // BLOCK)
    numbers = jnp.minimum(jnp.arange(blocks * BLOCK, dtype=jnp.int32), count - 1)
    done = jax.lax.map(jax.checkpoint(work), numbers.reshape(blocks, BLOCK))
    return jnp.moveaxis(done, 0, 1).reshape(done.shape[1], -1)[:, :count]


def compacted(work: Work, active: Bool[Array, " v"]) -> Float[Array, "rows v"]:
    """`work` on the numbers of the active vertices, block by block; zero for all others.

    Their numbers are gathered by a running count, and blocks past the last one are skipped. So
    any number of vertices takes the same program, and what is skipped costs next to nothing. A
    loop of so many trips could not be differentiated in reverse; one that skips can.
    """
    count = active.shape[0]
    blocks = -(-count // BLOCK)
    place = _running_count(active) - 1
    # Past the end where not active, and so dropped.
    target = jnp.where(active, place, blocks * BLOCK)
    numbers = jnp.zeros(blocks * BLOCK, jnp.int32)
    numbers = numbers.at[target].set(jnp.arange(count, dtype=jnp.int32), mode="drop")

    @jax.checkpoint
    def block(part):
        start, rows = part
        like = jax.eval_shape(work, rows)
        return jax.lax.cond(
            start <= place[-1], work, lambda _: jnp.zeros(like.shape, like.dtype), rows
        )

    starts = jnp.arange(blocks, dtype=jnp.int32) * BLOCK
    done = jax.lax.map(block, (starts, numbers.reshape(blocks, BLOCK)))
    flat = jnp.moveaxis(done, 0, 1).reshape(done.shape[1], -1)
    values = flat.at[:, jnp.maximum(place, 0)].get(mode="promise_in_bounds")
    return jnp.where(active[None], values, 0.0)


def _running_count(active: Bool[Array, " v"]) -> Int[Array, " v"]:
    """Their cumulative sum, row by row of a square, which takes fewer steps than all in one."""
    count = active.shape[0]
    rows = jnp.pad(active, (0, -count % _ROW)).reshape(-1, _ROW)
    along = jnp.cumsum(rows, axis=1, dtype=jnp.int32)
    before = jnp.cumsum(along[:, -1]) - along[:, -1]
    return (along + before[:, None]).reshape(-1)[:count]
