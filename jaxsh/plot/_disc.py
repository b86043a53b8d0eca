"""The sphere seen from far away: a disc of directions, and names where the axes come out."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke

from .._core.checks import described
from ._arrays import read
from ._colors import rgba

OUTLINE = [withStroke(linewidth=2, foreground="0.2")]  # of white text on any color
Number = float | int
Toward = tuple[Number, Number, Number] | np.ndarray | Array
AXES = {
    f"{sign}{name}": (1 if sign == "+" else -1) * np.eye(3)[i]
    for i, name in enumerate("xyz")
    for sign in "+−"
}


class Frame(NamedTuple):
    """Holds unit vectors of who looks at the sphere."""

    right: Float[np.ndarray, " 3"]
    up: Float[np.ndarray, " 3"]
    toward: Float[np.ndarray, " 3"]  # from the sphere to who looks

    def place(self, directions: Float[np.ndarray, "*shape 3"]) -> Float[np.ndarray, "*shape 3"]:
        """Turn vectors to those right, upwards and towards the viewer."""
        return directions @ np.stack(self).T


def frame(toward: Any) -> Frame:
    """Put z upwards; where that is the view itself, y."""
    vector = read("toward", toward).astype(np.float64)
    length = np.linalg.norm(vector)
    if vector.shape != (3,) or not 0 < length < np.inf:
        raise ValueError(f"expected toward as a direction (x, y, z), got {described(toward)}")
    vector = vector / length
    right = np.cross([0.0, 0.0, 1.0], vector)
    if np.linalg.norm(right) < 1e-6:
        right = np.array([1.0, 0.0, 0.0])
    right = right / np.linalg.norm(right)
    return Frame(right, np.cross(vector, right), vector)


def centers(resolution: int) -> Float[np.ndarray, " n"]:
    """Compute where pixels are between -1 and 1."""
    return (np.arange(resolution) + 0.5) * 2 / resolution - 1


def pixels(resolution: int) -> tuple[Float[np.ndarray, "n n"], ...]:
    """Compute x, y and radius of the pixels around the unit disc, and the share of each in it."""
    x, y = np.meshgrid(centers(resolution), -centers(resolution))
    radius = np.hypot(x, y)
    return x, y, radius, np.clip((1 - radius) * resolution / 2 + 0.5, 0, 1)


def disc(resolution: int) -> tuple[Float[np.ndarray, "n n 3"], Float[np.ndarray, "n n"]]:
    """Compute the near half's normals, to who looks at it, and the share of pixels in it."""
    x, y, radius, covered = pixels(resolution)
    # Beside the disc the normals of its rim, so that half a pixel there has a color.
    inside = np.maximum(radius, 1)
    z = np.sqrt(np.maximum(1 - radius**2, 0))
    return np.stack([x / inside, y / inside, z], axis=-1), covered


def show_disc(ax: Axes, colors: Float[np.ndarray, "n n 3"], covered, extent=(-1, 1, -1, 1)) -> None:
    ax.imshow(
        rgba(colors, covered),
        extent=extent,
        aspect="equal",
        origin="upper",
    )
    left, right, bottom, top = extent
    middle, radius = ((left + right) / 2, (bottom + top) / 2), (right - left) / 2
    ax.add_patch(Circle(middle, radius, fill=False, edgecolor="0.5", linewidth=0.6))


def name_axes(ax: Axes, places: dict[str, Float[np.ndarray, " 3"]]) -> None:
    """Write names on the near half of the disc, readable on any color; at the rim beside it."""
    for name, (x, y, z) in places.items():
        if z < -1e-6:
            continue
        radius = np.hypot(x, y)
        beside = radius > 0.94
        out = 1.1 / radius if beside else 1.0
        text = ax.text(x * out, y * out, name, ha="center", va="center", fontsize="small")
        if not beside:
            text.set(color="white", path_effects=OUTLINE)
