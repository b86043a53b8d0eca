"""A mesh as a camera sees it, for pictures whose edges are smooth on any background."""

import math
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes

from .._core.checks import check_type
from ..geometry import Mesh
from ..imaging import Camera, Raster, interpolate, rasterize
from ._axes import flat_axes, length_bar
from ._colors import rgba

_SIZE = 480  # pixels of a picture whose camera is not said
SAMPLES = 2
_MARGIN = 0.04  # around what is seen, of the picture's width


class Surface(NamedTuple):
    """Holds what pixels see of a mesh, and how large it is there."""

    raster: Raster
    alpha: Float[np.ndarray, "h w"]
    facing: Float[np.ndarray, "h w"]  # cosine between normal and viewer, 0 beside the mesh
    per_length: float  # pixels of a length at the mean depth of what is seen
    cropped: bool  # to what is seen

    def pixels(self, values: Float[np.ndarray, "v c"]) -> Float[np.ndarray, "h w c"]:
        """Carry values at vertices to pixels: means over the samples that are on the mesh."""
        seen = np.asarray(interpolate(self.raster, jnp.asarray(values)))
        return seen / np.where(self.alpha > 0, self.alpha, 1).astype(seen.dtype)[..., None]

    def show(
        self,
        colors: Float[np.ndarray, "h w 3"],
        ax: Axes | None,
        unit: str,
        over: Float[np.ndarray, "h w 4"] | None = None,
    ) -> Axes:
        """Draw RGB, and RGBA `over` it, on axes without a frame, with a bar of length."""
        height, width = self.alpha.shape
        covered = self.alpha if over is None else self.alpha + over[..., 3]
        rows, columns = (np.flatnonzero(covered.any(axis=axis)) for axis in (1, 0))
        box = [0, width, height, 0]  # left, right, bottom, top
        if self.cropped:
            free = _MARGIN * width
            box = [columns[0] - free, columns[-1] + 1 + free, rows[-1] + 1 + free, rows[0] - free]
        wide, high = box[1] - box[0], box[2] - box[3]
        scale = 4.5 / max(wide, high)
        ax = flat_axes(ax, (scale * wide + 0.8, scale * high + 0.5))
        picture = rgba(colors, self.alpha)
        for layer in (picture,) if over is None else (picture, over):
            ax.imshow(layer, extent=(0, width, height, 0), aspect="equal", origin="upper")
        ax.set(xlim=box[:2], ylim=box[2:])
        ax.set_axis_off()
        length_bar(ax, self.per_length, "", unit)
        return ax


def see(mesh: Mesh, camera: Camera | None, margin: float = 0.05) -> Surface:
    """Rasterize a mesh; by default from its front, in a picture cut to the mesh."""
    view = camera_for(mesh, camera, margin)
    raster = rasterize(mesh, view, samples=SAMPLES)
    if not (np.asarray(raster.face) >= 0).any():
        raise ValueError("expected a camera that sees the mesh, got one with an empty picture")
    return facing_of(mesh, view, raster)._replace(cropped=camera is None)


def camera_for(mesh: Mesh, camera: Camera | None, margin: float = 0.05) -> Camera:
    """Check the camera, or place one in front of the mesh."""
    check_type("mesh", mesh, Mesh)
    if camera is None:
        return Camera.facing(mesh, width=_SIZE, height=_SIZE, margin=margin)
    check_type("camera", camera, Camera)
    return camera


def facing_of(mesh: Mesh, camera: Camera, raster: Raster) -> Surface:
    """Compute how surfaces face their camera, and how large they are there."""
    alpha = np.asarray(raster.alpha)
    position, target = (np.asarray(one, np.float64) for one in (camera.position, camera.target))
    forward = (target - position) / np.linalg.norm(target - position)
    toward = position - np.asarray(mesh.vertices, np.float64)
    normals = np.asarray(mesh.normals, np.float64)
    cosine = (toward * normals).sum(axis=1) / np.linalg.norm(toward, axis=1)
    carried = np.stack([cosine, -toward @ forward], axis=1)
    seen = np.asarray(interpolate(raster, jnp.asarray(carried, jnp.float32)))
    focal = camera.height / 2 / math.tan(math.radians(float(camera.fov_y)) / 2)
    depth = float(seen[..., 1].sum() / alpha.sum()) if alpha.any() else math.inf
    facing = seen[..., 0] / np.where(alpha > 0, alpha, 1)
    return Surface(raster, alpha, np.clip(facing, 0, 1), focal / depth, False)


def relieved(
    colors: Float[np.ndarray, "h w 3"], facing: Float[np.ndarray, "h w"], relief: float
) -> Float[np.ndarray, "h w 3"]:
    """Darken where a surface turns away from the viewer, so that its shape shows."""
    return colors * (1 - relief * (1 - facing))[..., None]
