"""Light and eye both move: tiles that follow the eye, against the full computation."""

import statistics
import time
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import adaptive, transfer

from . import Context
from ._leekim2014_methods import lights
from ._leekim2014_scenes import Scene, towards, vertex_psnr


def moving(context: Context, scene: Scene, frames: int, views: int, step: float) -> dict[str, Any]:
    """A row: the frames of both, in turns, and how far tiles are from full."""
    path = eyes(scene, frames + 1, step)
    low, high = jnp.min(scene.baked.positions, axis=0), jnp.max(scene.baked.positions, axis=0)
    distance = float(jnp.linalg.norm(path[0] - (low + high) / 2))
    start = time.perf_counter()
    exponent = float(scene.material.exponent)
    atlas = adaptive.make_tile_atlas(scene.baked, distance=distance, views=views, exponent=exponent)
    made = time.perf_counter() - start
    follow = adaptive.TileFollower(atlas, scene.baked, path[0])
    sampled = transfer.sample(scene.baked)

    def full(light, eye):
        return transfer.shade_glossy(light, sampled, eye, scene.material)

    def tiles(light, eye):
        set_ = follow(eye)
        return adaptive.shade(
            light, scene.baked, eye, scene.material, method="tiles", tiles=set_
        ).color

    taken: dict[str, list[float]] = {"full": [], "tiles": []}
    errors = []
    turning = [scene.light, *lights(scene, frames)]
    for frame, (light, eye) in enumerate(zip(turning, path, strict=True)):
        colors = {}
        for name, way in (("full", full), ("tiles", tiles)):
            start = time.perf_counter()
            colors[name] = jax.block_until_ready(way(light, eye))
            if frame:  # the first one compiles
                taken[name].append(time.perf_counter() - start)
        facing = towards(eye, scene.baked)
        errors.append(float(vertex_psnr(colors["tiles"], colors["full"], facing)))
    mid = {name: statistics.median(times) for name, times in taken.items()}
    mean = {name: statistics.mean(times) for name, times in taken.items()}
    return scene.row._asdict() | {
        "moving_full_ms": 1e3 * mid["full"],
        "moving_tiles_ms": 1e3 * mid["tiles"],
        "moving_gain": mid["full"] / mid["tiles"],
        "moving_gain_mean": mean["full"] / mean["tiles"],
        "moving_psnr": statistics.mean(errors),
        "moving_psnr_worst": min(errors),
        "atlas_seconds": made,
    }


def eyes(scene: Scene, count: int, step: float) -> list[Float[Array, " 3"]]:
    """The scene's own eye and what follows, around the vertical by `step` degrees each."""
    angles = np.radians(step) * np.arange(count)
    x, y, z = np.asarray(scene.eye)
    turned = np.stack(
        [np.cos(angles) * x - np.sin(angles) * y, np.sin(angles) * x + np.cos(angles) * y], axis=1
    )
    return [jnp.asarray([a, b, z], scene.eye.dtype) for a, b in turned]
