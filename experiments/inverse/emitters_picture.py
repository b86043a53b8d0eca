"""The picture of `inverse.emitters`."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from jaxsh import geometry, imaging, inverse, midrange, plot, transfer

from ..shared.plots import View, camera_on, plt, save
from .lights import shade, with_noise

if TYPE_CHECKING:
    from .emitters import Emitters

Direction = tuple[float, float, float]

_UNIT = "radii"  # of the mesh's bounding sphere: what its lengths are in
_TRUE, _FOUND, _START = "black", "tab:orange", "0.55"


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
    """Observed, drawn again, how far that is from the truth; and the lights from aside."""
    clean, again = (
        shade([light.polygon for light in lights], baked, config.albedo)
        for lights in (scene.truth, scene.found)
    )
    observed = with_noise(clean, scene.noise, jax.random.fold_in(key, 1))
    size = config.height
    ahead, aside = _directions(scene.truth[0])
    camera = imaging.Camera.facing(mesh, toward=ahead, width=size, height=size)
    exposure = View.of(mesh, camera, clean).exposure
    figure, axes = plt.subplots(2, 2, figsize=(11, 10.6), layout="constrained")
    titles = f"observed, noise {100 * scene.noise:g} %", "by the lights recovered"
    for axis, title, color in zip(axes[0], titles, (observed, again), strict=True):
        plot.shaded(
            mesh, jnp.maximum(color, 0), camera=camera, exposure=exposure, length=_UNIT, ax=axis
        )
        axis.set_title(title)
    apart = 100 * exposure * jnp.mean(again - clean, axis=1)
    label = "error, mean of R, G, B, % of white"
    plot.vertices(mesh, apart, label=label, camera=camera, length=_UNIT, ax=axes[1, 0])
    axes[1, 0].set_title("recovered less true")
    _draw_aside(axes[1, 1], mesh, again, scene, (aside, size, exposure))
    axes[1, 1].set_title("the lights, seen from aside")
    save(figure, path, dpi=100)


def _directions(light: inverse.Rectangle) -> tuple[Direction, Direction]:
    """From the mesh to cameras: one beside the first light, and one that sees it from its edge."""
    towards = np.asarray(light.center) / np.linalg.norm(light.center)
    across = np.cross(towards, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    up = np.array([0.0, 0.0, 0.3])
    (x, y, z), (u, v, w) = (0.8 * towards + across + up).tolist(), (across + up).tolist()
    return (x, y, z), (u, v, w)


def _draw_aside(
    axis: Axes,
    mesh: geometry.Mesh,
    color: Float[Array, "v 3"],
    scene: Scene,
    view: tuple[Direction, int, float],
) -> None:
    toward, size, exposure = view
    outlines = {
        "start": ([light.vertices for light in scene.starts[0]], _START, "-", 2.0),
        "true, and its normal": ([light.vertices for light in scene.truth], _TRUE, "-", 4.0),
        "recovered": ([light.vertices for light in scene.found], _FOUND, "--", 2.0),
    }
    corners = [np.asarray(each) for light, *_ in outlines.values() for each in light]
    points = np.concatenate([np.asarray(mesh.vertices), *corners])
    camera = camera_on(points, toward=toward, width=size, height=size, margin=0.1)
    plot.shaded(
        mesh, jnp.maximum(color, 0), camera=camera, exposure=exposure, length=_UNIT, ax=axis
    )
    for label, (lights, edge, style, width) in outlines.items():
        for number, light in enumerate(lights):
            place = _pixels(camera, np.asarray(light))
            said = label if number == 0 else None
            axis.add_patch(
                Polygon(place, fill=False, edgecolor=edge, ls=style, lw=width, label=said)
            )
    for light in scene.truth:
        # Which side shines: a line from the middle along the normal.
        middle, normal = np.asarray(light.center), np.cross(*np.asarray(light.axes))
        line = _pixels(camera, np.stack([middle, middle + 0.35 * normal]))
        axis.plot(*line.T, color=_TRUE, linewidth=1.5)
    axis.legend(
        loc="upper left", bbox_to_anchor=(0.0, 0.0), ncols=3, fontsize="small", frameon=False
    )


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
