"""Who stays in the region of interest (Lee & Kim 2014, algorithm 1)."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int


class Region(NamedTuple):
    """One kind of lighting on its way through the levels, for V vertices."""

    added: Float[Array, "3 v"]  # to the base, and shown
    reached: Int[Array, " v"]  # the degree that is shown
    active: Bool[Array, " v"]  # still inside
    kept: Float[Array, " levels"]

    @staticmethod
    def start(base: int, count: int, dtype) -> "Region":
        """Everyone is inside."""
        return Region(
            added=jnp.zeros((3, count), dtype),
            reached=jnp.full(count, base, jnp.int32),
            active=jnp.ones(count, bool),
            kept=jnp.zeros(0, dtype),
        )


def decide(
    region: Region,
    level: int,
    change: Float[Array, "3 v"],
    threshold: Float[Array, " v"],
    albedo: Float[Array, "3 v"],
    outside: str,
) -> Region:
    """After a level: those stay whose accumulated change, as it is seen, reaches the threshold."""
    change = region.added + jnp.where(region.active[None], change, 0.0)
    stays = region.active & seen_as_changed(change, threshold, albedo)
    shown = region.active if outside == "level" else stays
    return Region(
        added=jnp.where(shown[None], change, region.added),
        reached=jnp.where(shown, jnp.asarray(level, jnp.int32), region.reached),
        active=stays,
        kept=jnp.append(region.kept, jnp.mean(stays, dtype=change.dtype)),
    )


def seen_as_changed(change, threshold, albedo) -> Bool[Array, " v"]:
    red, green, blue = jnp.abs(change * albedo)
    return jnp.maximum(jnp.maximum(red, green), blue) >= threshold
