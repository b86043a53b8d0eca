"""Functions on the sphere as balloons: surfaces whose radius in each direction is |f|."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patheffects import withStroke

from .._core import srgb
from .._core.linalg import matmul
from ..geometry import Mesh, ray_scene
from ..harmonics import degree_of, evaluate_with_gradient
from ..imaging import Raster
from ._axes import length_bar
from ._colors import NEGATIVE, POSITIVE, rgba
from ._disc import AXES, Frame, centers
from ._surface import Surface, relieved

RELIEF = 0.6  # how dark a balloon's edge is: it has no other shading
_SAMPLES = 2
_HALF = 1.12  # what a panel shows around the origin, where the largest balloon's radius is 1


class Balloons(NamedTuple):
    """Holds balloons around the origin, all over the same directions."""

    positions: Float[np.ndarray, "n d 3"]
    normals: Float[np.ndarray, "n d 3"]
    values: Float[np.ndarray, "n d"]
    faces: np.ndarray  # of one of them

    def mesh(self, number: int, size: float = 1.0, center=(0.0, 0.0, 0.0)) -> Mesh:
        return Mesh(
            jnp.asarray(size * self.positions[number] + np.asarray(center), jnp.float32),
            jnp.asarray(self.faces, jnp.int32),
            jnp.asarray(self.normals[number], jnp.float32),
        )


def steps_for(degree: int) -> int:
    """Choose so many steps from pole to pole that lobes stay round."""
    return max(48, 6 * degree)


def balloons(functions: Float[np.ndarray, "n k"], steps: int) -> Balloons:
    """Compute surfaces |f(ω)| ω, `steps` from pole to pole and twice as many around."""
    theta, phi = np.meshgrid(
        np.linspace(0, np.pi, steps + 1), np.linspace(0, 2 * np.pi, 2 * steps + 1), indexing="ij"
    )
    grid = [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    directions = np.stack(grid, axis=-1).reshape(-1, 3).astype(functions.dtype)
    basis, slopes = evaluate_with_gradient(jnp.asarray(directions), degree_of(functions.shape[-1]))
    values = functions @ np.asarray(basis).T
    gradients = np.einsum("nk,dkx->ndx", functions, np.asarray(slopes))
    radius = abs(values)[..., None]
    # Of x = r ω: r ω - ∇r, with ∇|f| = sign(f) ∇f; what lies at the origin looks outwards.
    normals = radius * directions - np.sign(values)[..., None] * gradients
    lengths = np.linalg.norm(normals, axis=-1, keepdims=True)
    normals = np.where(lengths > 0, normals / np.where(lengths > 0, lengths, 1), directions)
    corner = (np.arange(steps)[:, None] * (2 * steps + 1) + np.arange(2 * steps)).ravel()
    below = corner + 2 * steps + 1
    faces = [[corner, below, below + 1], [corner, below + 1, corner + 1]]
    return Balloons(
        radius * directions, normals, values, np.concatenate([np.stack(f, axis=1) for f in faces])
    )


def sign_colors(values: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape 3"]:
    """Choose linear colors: one above zero, one below."""
    return srgb.decode(np.where((values >= 0)[..., None], to_rgb(POSITIVE), to_rgb(NEGATIVE)))


def draw_balloon(
    ax: Axes,
    mesh: Mesh,
    colors: Float[np.ndarray, "d 3"],
    viewer: Frame,
    resolution: int,
    largest: float,
    said: str,
    unit: str,
) -> None:
    """Draw a balloon of at most unit radius, seen from far away, with axes and its scale."""
    surface = _from_afar(mesh, viewer, resolution)
    picture = seen_balloons(surface, colors)
    for name in ("+x", "+y", "+z"):
        x, y, _ = viewer.place(AXES[name])
        ax.plot([0, x], [0, y], color="0.6", linewidth=0.8, zorder=-1)
        ax.text(
            1.08 * x,
            1.08 * y,
            name,
            ha="center",
            va="center",
            fontsize="small",
            path_effects=[withStroke(linewidth=2, foreground=ax.get_facecolor())],
        )
    extent = (-_HALF, _HALF, -_HALF, _HALF)
    ax.imshow(picture, extent=extent, aspect="equal", origin="upper", zorder=1)
    ax.set(xlim=(-_HALF, _HALF), ylim=(-_HALF, _HALF))
    ax.set_axis_off()
    if largest > 0:
        length_bar(ax, 1 / largest, said, unit)


def seen_balloons(surface: Surface, colors: Float[np.ndarray, "d 3"]) -> Float[np.ndarray, "h w 4"]:
    """Make a picture of balloons, encoded, from linear colors at their vertices."""
    shown = srgb.encode(surface.pixels(colors))
    return rgba(relieved(shown, surface.facing, RELIEF), surface.alpha)


def _from_afar(mesh: Mesh, viewer: Frame, resolution: int) -> Surface:
    """Cast parallel rays, as one who looks from far away sees."""
    count = _SAMPLES * resolution
    middle = _HALF * centers(count)
    x, y = np.meshgrid(middle, -middle)
    plane = np.stack([x, y, np.full_like(x, 2.0)], axis=-1).reshape(-1, 3)
    origins = (plane @ np.stack(viewer)).astype(np.float32)
    away = np.broadcast_to(-viewer.toward.astype(np.float32), origins.shape)
    hit = ray_scene(mesh).closest_hit(origins, np.ascontiguousarray(away))
    raster = Raster(
        jnp.asarray(hit.face.reshape(count, count)),
        jnp.asarray(hit.barycentric.reshape(count, count, 3)),
        mesh.faces,
        _SAMPLES,
    )
    alpha = np.asarray(raster.alpha)
    surface = Surface(raster, alpha, alpha, resolution / 2 / _HALF, False)
    cosine = np.asarray(matmul(mesh.normals, jnp.asarray(viewer.toward, jnp.float32)[:, None]))
    return surface._replace(facing=np.clip(surface.pixels(cosine)[..., 0], 0, 1))
