"""The picture of `inverse.emitters`."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import jax
import numpy as np
from jaxtyping import Array, Float

from jaxsh import geometry, imaging, inverse, midrange, transfer

from ..shared.plots import View, plt, save
from .lights import shade, with_noise

if TYPE_CHECKING:
    from .emitters import Emitters

_GAIN = 20.0
_ASIDE = (0.9, -1.6, 0.9)  # from where lights and mesh are seen together
_GREY = 0.2


class Scene(NamedTuple):
    """One setting: true lights and recovered ones in their order, and the guesses."""

    noise: float
    truth: tuple[inverse.Rectangle, ...]
    found: tuple[inverse.Rectangle, ...]
    starts: list[list[midrange.Polygon]]


def draw(
    path: Path,
    mesh: geometry.Mesh,
    baked: transfer.Transfer,
    scene: Scene,
    config: "Emitters",
    key: Array,
) -> None:
    """Observed, drawn again, the difference; and the lights' outlines from aside."""
    clean, again = (
        shade([light.polygon for light in lights], baked, config.albedo)
        for lights in (scene.truth, scene.found)
    )
    observed = with_noise(clean, scene.noise, jax.random.fold_in(key, 1))
    size = config.height
    view = View.of(mesh, imaging.Camera.facing(mesh, width=size, height=size), clean, samples=2)
    panels = {
        f"observed, noise {100 * scene.noise:g} %": view.shown(observed),
        "with the lights recovered": view.shown(again),
        f"difference from the light without noise, × {_GAIN:g}": view.difference(
            again, clean, _GAIN
        ),
    }
    figure, axes = plt.subplots(1, 4, figsize=(14, 3.9), layout="constrained")
    for axis, (title, image) in zip(axes, panels.items(), strict=False):
        axis.imshow(image)
        axis.set_title(title, fontsize=10)
    _draw_aside(axes[3], mesh, again, scene, config.height)
    axes[3].set_title("from aside: true (white), recovered, start (grey)", fontsize=10)
    for axis in axes:
        axis.axis("off")
    save(figure, path, dpi=100)


def _draw_aside(axis, mesh, again: Float[Array, "v 3"], scene: Scene, size: int) -> None:
    direction = np.array(_ASIDE) / np.linalg.norm(_ASIDE)
    camera = imaging.Camera(
        position=8.5 * direction, target=np.zeros(3), fov_y=32.0, width=size, height=size
    )
    axis.imshow(View.of(mesh, camera, again, samples=2).shown(again))
    for light in scene.starts[0]:
        _outline(axis, camera, np.asarray(light.vertices), color="grey", linewidth=1)
    for light in scene.truth:
        corners = np.asarray(light.vertices)
        _outline(axis, camera, corners, color="white", linewidth=4)
        # Which side shines: a line from the middle along the normal.
        middle, normal = np.asarray(light.center), np.cross(*np.asarray(light.axes))
        line = _pixels(camera, np.stack([middle, middle + 0.35 * normal]))
        axis.plot(*line.T, color="white", linewidth=1)
    for light in scene.found:
        _outline(axis, camera, np.asarray(light.vertices), color="tab:orange", linewidth=1.5)
    axis.set_xlim(0, size)
    axis.set_ylim(size, 0)


def _outline(axis, camera: imaging.Camera, corners: Float[np.ndarray, "n 3"], **style) -> None:
    line = _pixels(camera, np.concatenate([corners, corners[:1]]))
    axis.plot(*line.T, **style)


def _pixels(camera: imaging.Camera, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
    """Where points in front of the camera are in its picture: column and row."""
    position, target = np.asarray(camera.position), np.asarray(camera.target)
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(forward, np.asarray(camera.up))
    right /= np.linalg.norm(right)
    upward = np.cross(right, forward)
    x, y, z = np.stack([right, upward, forward]) @ (points - position).T
    scale = camera.height / 2 / np.tan(np.radians(camera.fov_y) / 2) / z
    return np.stack([camera.width / 2 + scale * x, camera.height / 2 - scale * y], axis=-1)
