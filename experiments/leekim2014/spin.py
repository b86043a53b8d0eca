"""A mesh that spins before the eye, and each method on the same frames."""

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import adaptive, harmonics, transfer
from jaxsh.adaptive import AdaptiveResult, make_anchors, make_tile_atlas

from .scenes import Scene

_RARE = 0.999  # quantile of the vertices: what pops is a few of them

Shade = Callable[[Scene, AdaptiveResult | None], AdaptiveResult]


class Method(NamedTuple):
    name: str
    shade: Shade  # a frame's scene, and the result of the frame before


class Frame(NamedTuple):
    """One frame by one method, beside the full computation of the same light."""

    color: Float[Array, "v 3"]
    full: Float[Array, "v 3"]
    reached: Array | None  # the degree of each vertex's specular part

    @property
    def error(self) -> Float[Array, "v 3"]:
        """Of what a screen can show."""
        return jnp.clip(self.color, 0, 1) - jnp.clip(self.full, 0, 1)


def spun(scene: Scene, angle: float) -> Scene:
    """The mesh turned by so many radians about the vertical, told in its own space.

    There light and eye turn back instead, so that transfer and vertices stay.
    """
    cos, sin = np.cos(-angle), np.sin(-angle)
    turn = jnp.asarray([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]], scene.camera.position.dtype)
    camera = dataclasses.replace(
        scene.camera, position=turn @ scene.camera.position, target=turn @ scene.camera.target
    )
    towards = camera.position[None] - scene.baked.positions
    facing = jnp.sum(towards * scene.baked.normals, axis=1) > 0
    return scene._replace(camera=camera, light=scene.turned(-angle), facing=facing)


def methods(
    scene: Scene, *, thresholds: dict[str, Any], hysteresis: float, views: int
) -> Iterator[Method]:
    """All but masks, which give the colors of levels."""
    staged = adaptive.stage(scene.baked)
    # Exact diffuse parts, so that the glossy part alone is in error.
    anchors = make_anchors(scene.baked, diffuse=scene.baked)
    center = (jnp.max(scene.baked.positions, axis=0) + jnp.min(scene.baked.positions, axis=0)) / 2
    distance = float(jnp.linalg.norm(scene.eye - center))
    exponent = float(scene.material.lobe[1])
    atlas = make_tile_atlas(scene.baked, distance=distance, views=views, exponent=exponent)
    degree = round(0.7 * scene.row.degree)

    def by(method: adaptive.AbstractMethod, baked: Any = scene.baked) -> Shade:
        def shade(frame: Scene, _: AdaptiveResult | None) -> AdaptiveResult:
            return adaptive.shade(frame.light, baked, frame.eye, frame.material, method)

        return shade

    def remembering(method: adaptive.Levels | adaptive.TwoStage, baked: Any = scene.baked) -> Shade:
        method = dataclasses.replace(method, hysteresis=hysteresis)

        def shade(frame: Scene, previous: AdaptiveResult | None) -> AdaptiveResult:
            seen = frame.light, baked, frame.eye, frame.material
            return adaptive.shade(*seen, dataclasses.replace(method, previous=previous))

        return shade

    first = atlas.nearest(scene.baked, scene.eye, diffuse=scene.baked)

    def tiles(frame: Scene, _: AdaptiveResult | None) -> AdaptiveResult:
        made = atlas.nearest(frame.baked, frame.eye, diffuse=frame.baked)
        return made(frame.light, frame.eye, frame.material)

    def truncated(frame: Scene, _: AdaptiveResult | None) -> AdaptiveResult:
        light = frame.light[:, : harmonics.num_coefficients(degree)]
        color = transfer.shade_glossy(light, frame.baked, frame.eye, frame.material)
        return AdaptiveResult(color, {}, jnp.ones((), color.dtype))

    levels = adaptive.Levels(**thresholds)
    two_stage = adaptive.TwoStage(threshold=thresholds["threshold"])
    yield Method("levels", by(levels))
    yield Method("levels, hysteresis", remembering(levels))
    yield Method("two_stage", by(two_stage, staged))
    yield Method("two_stage, hysteresis", remembering(two_stage, staged))
    yield Method("probes", by(adaptive.Anchors(anchors)))
    yield Method("tiles", tiles)
    yield Method("tiles, kept", by(adaptive.Tiles(first)))
    yield Method(f"everyone at degree {degree}", truncated)


def play(method: Method, scenes: list[Scene], full: list[Array]) -> list[Frame]:
    """Frame after frame."""
    frames: list[Frame] = []
    previous = method.shade(scenes[0], None)  # fills a memory
    for scene, reference in zip(scenes, full, strict=True):
        previous = method.shade(scene, previous)
        frames.append(Frame(previous.color, reference, previous.shown_degree.get("specular")))
    return frames


def flicker(scenes: list[Scene], frames: list[Frame]) -> list[dict[str, float]]:
    """From each frame to the next: how the error changes at vertices that face the eye in both."""
    lines = []
    for i in range(1, len(frames)):
        before, now = frames[i - 1], frames[i]
        seen = np.asarray(scenes[i - 1].facing & scenes[i].facing)
        jump = np.asarray(now.error - before.error)[seen]
        motion = np.asarray(jnp.clip(now.full, 0, 1) - jnp.clip(before.full, 0, 1))[seen]
        line = {
            "flicker": float(np.sqrt(np.mean(jump**2))),
            "pop": float(np.quantile(np.abs(jump).max(axis=1), _RARE)),
            "motion": float(np.sqrt(np.mean(motion**2))),
            "rms": float(
                np.sqrt(np.mean(np.asarray(now.error)[np.asarray(scenes[i].facing)] ** 2))
            ),
        }
        if now.reached is not None and before.reached is not None:
            line["switched"] = float(np.mean(np.asarray(now.reached != before.reached)[seen]))
        lines.append(line)
    return lines
