"""Light and eye both move: tiles that follow the eye, against the full computation."""

import dataclasses
import functools
import statistics
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import adaptive, transfer

from ..runner import Context
from ..shared.timing import timed
from .methods import lights
from .scenes import Scene, towards, vertex_psnr


def moving(context: Context, scene: Scene, frames: int, views: int, step: float) -> dict[str, Any]:
    """A row: the frames of both, one after the other, and how far tiles are from full."""
    path = eyes(scene, frames + 1, step)
    low, high = jnp.min(scene.baked.positions, axis=0), jnp.max(scene.baked.positions, axis=0)
    distance = float(jnp.linalg.norm(path[0] - (low + high) / 2))
    exponent = float(scene.material.lobe[1])
    make = functools.partial(
        adaptive.make_tile_atlas, distance=distance, views=views, exponent=exponent
    )
    atlas, made = timed(make, scene.baked)
    prepared = adaptive.TileFollower(atlas, scene.baked, path[0])
    sets, prepared_in = timed(prepared.prepare, jnp.stack(path))
    sampled = transfer.sample(scene.baked)

    def full(light, eye):
        return transfer.shade_glossy(light, sampled, eye, scene.material)

    def tiles(follow):
        def way(light, eye):
            return follow(eye)(light, eye, scene.material).color

        return way

    ways = {
        "full": full,
        "prepared": tiles(prepared),
        "following": tiles(adaptive.TileFollower(atlas, scene.baked, path[0])),
    }
    taken: dict[str, list[float]] = {name: [] for name in ways}
    colors: dict[str, list[Array]] = {name: [] for name in ways}
    turning = [scene.light, *lights(scene, frames)]
    for name, way in ways.items():
        for frame, (light, eye) in enumerate(zip(turning, path, strict=True)):
            shaded, seconds = timed(way, light, eye)
            colors[name].append(shaded)
            if frame:  # the first one compiles
                taken[name].append(seconds)
    errors = [
        float(vertex_psnr(ours, theirs, towards(eye, scene.baked)))
        for ours, theirs, eye in zip(colors["prepared"], colors["full"], path, strict=True)
    ]
    mid = {name: statistics.median(times) for name, times in taken.items()}
    mean = {name: statistics.mean(times) for name, times in taken.items()}
    row = scene.row._asdict() | {f"moving_{name}_ms": 1e3 * mid[name] for name in ways}
    first = prepared(path[0])
    parts = (getattr(first, field.name) for field in dataclasses.fields(first))
    own = [part for part in parts if part is not first.diffuse]  # which all sets share
    size = sum(leaf.nbytes for leaf in jax.tree.leaves(own) if isinstance(leaf, jax.Array))
    return row | {
        "moving_gain": mid["full"] / mid["prepared"],
        "moving_gain_mean": mean["full"] / mean["prepared"],
        "moving_following_gain": mid["full"] / mid["following"],
        "moving_following_gain_mean": mean["full"] / mean["following"],
        "moving_psnr": statistics.mean(errors),
        "moving_psnr_worst": min(errors),
        "atlas_seconds": made,
        "sets": sets,
        "sets_seconds": prepared_in,
        "sets_megabytes": sets * size / 1e6,
    }


def eyes(scene: Scene, count: int, step: float) -> list[Float[Array, " 3"]]:
    """The scene's own eye and what follows, around the vertical by `step` degrees each."""
    angles = np.radians(step) * np.arange(count)
    x, y, z = np.asarray(scene.eye)
    turned = np.stack(
        [np.cos(angles) * x - np.sin(angles) * y, np.sin(angles) * x + np.cos(angles) * y], axis=1
    )
    return [jnp.asarray([a, b, z], scene.eye.dtype) for a, b in turned]
