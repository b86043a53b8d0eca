"""Transfer of vertices as balloons on their mesh."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float
from matplotlib.axes import Axes

from .._core.checks import as_host_integer, check_number, check_size, check_type
from ..geometry import Mesh
from ..harmonics import degree_of
from ..imaging import Camera, rasterize
from ._arrays import read_coefficients
from ._axes import length_bar
from ._balloon import RELIEF, Balloons, balloons, seen_balloons, sign_colors
from ._surface import SAMPLES, Surface, camera_for, facing_of, relieved, see

_STEPS = 24  # from pole to pole: lobes are small in the picture
_GRAY = 0.72
_FACING = 0.75  # cosine between normal and viewer
_MARGIN = 0.2  # of the picture, for balloons beside the mesh


def transfer_lobes(
    mesh: Mesh,
    coefficients: Float[ArrayLike, "v k"],
    vertices: Sequence[int] | np.ndarray | None = None,
    *,
    count: int = 12,
    size: float = 0.08,
    unit: str = "",
    camera: Camera | None = None,
    length: str = "mesh units",
    ax: Axes | None = None,
) -> Axes:
    """Draw the transfer of some vertices as balloons on their mesh.

    A balloon's radius in a direction is the magnitude of the transfer there: how much the vertex
    answers to light from it. Orange is positive, blue negative. Balloons stand at their vertices,
    and what of them is inside the mesh is drawn too.

    **Arguments**

    - `mesh`: whose vertices they are.
    - `coefficients`: (V, K), as `transfer.bake(mesh, …).coefficients` has them. jax or numpy.
    - `vertices`: which of them; by default `count` that face the camera, far from one another.
    - `count`: how many, where `vertices` are not said; fewer where fewer are seen.
    - `size`: radius of the largest value, in diagonals of the mesh's box.
    - `unit`: of the transfer, after the number at the balloons' bar.
    - `camera`: by default one in front (-y) and a little above, its picture cut to the mesh.
    - `length`: unit of the mesh's lengths, for the bar below the picture.
    - `ax`: axes to draw on; by default those of a new figure.

    **Returns**

    The axes, in pixels. Runs on the host. Raises `ValueError` for coefficients that are not finite
    or not a row per vertex, and for vertices that the camera does not see.

    **Example**

    >>> from jaxsh import geometry, imaging, plot, transfer
    >>> mesh = geometry.knot(300)
    >>> bare = transfer.unshadowed(mesh.vertices, mesh.normals, 2)
    >>> camera = imaging.Camera.facing(mesh, width=32, height=32)
    >>> ax = plot.transfer_lobes(mesh, bare.coefficients, count=3, camera=camera)
    >>> len(ax.get_images())
    2
    """
    check_type("mesh", mesh, Mesh)
    check_type("unit", unit, str)
    check_type("length", length, str)
    count = check_size("count", count)
    size = check_number("size", size, above=0.0)
    values = read_coefficients(coefficients)
    if values.ndim != 2 or len(values) != len(mesh.vertices):
        raise ValueError(
            f"expected coefficients ({len(mesh.vertices)}, K), a row per vertex, got shape "
            f"{values.shape}"
        )
    surface = see(mesh, camera, _MARGIN)
    points = np.asarray(mesh.vertices, np.float64)
    if vertices is None:
        chosen = _spread(points, _facing(surface), count)
    else:
        chosen = _read(vertices, _seen(surface.raster.face, surface))
    used = np.unique(np.asarray(mesh.faces))
    diagonal = float(np.linalg.norm(np.ptp(points[used], axis=0)))
    shapes = balloons(values[chosen], max(_STEPS, 4 * degree_of(values.shape[1])))
    scale = size * diagonal / (float(abs(shapes.values).max()) or 1.0)
    joined = _joined(shapes, points[chosen], scale)
    picture = _in_front(joined, sign_colors(shapes.values.reshape(-1)), mesh, camera)
    gray = np.full((*surface.alpha.shape, 3), _GRAY)
    ax = surface.show(relieved(gray, surface.facing, RELIEF), ax, length, picture)
    length_bar(ax, surface.per_length * scale, "|transfer| = ", unit, left=True)
    return ax


def _seen(face: ArrayLike, surface: Surface) -> np.ndarray:
    """Find vertices of the faces that samples see."""
    faces = np.unique(np.asarray(face))
    return np.unique(np.asarray(surface.raster.faces)[faces[faces >= 0]])


def _facing(surface: Surface) -> np.ndarray:
    """Find those that are not seen edge on, where there are others."""
    facing = surface.facing > min(_FACING, 0.9 * surface.facing.max())
    facing = np.repeat(np.repeat(facing, SAMPLES, axis=0), SAMPLES, axis=1)
    return _seen(np.where(facing, np.asarray(surface.raster.face), -1), surface)


def _spread(points: np.ndarray, seen: np.ndarray, count: int) -> np.ndarray:
    """Take vertices one by one, each the farthest from those taken."""
    middle = points[seen].mean(axis=0)
    chosen = [seen[np.argmin(np.linalg.norm(points[seen] - middle, axis=1))]]
    distance = np.full(len(seen), np.inf)
    while len(chosen) < min(count, len(seen)):
        distance = np.minimum(distance, np.linalg.norm(points[seen] - points[chosen[-1]], axis=1))
        if not distance.max() > 0:
            break
        chosen.append(seen[np.argmax(distance)])
    return np.array(chosen)


def _read(vertices, seen: np.ndarray) -> np.ndarray:
    chosen = as_host_integer(vertices, "vertices")
    if chosen.ndim != 1 or len(chosen) == 0:
        raise ValueError(f"expected vertices (n,), at least one, got shape {chosen.shape}")
    hidden = chosen[~np.isin(chosen, seen)]
    if len(hidden):
        raise ValueError(f"expected vertices that the camera sees, got {hidden[0]}: it is hidden")
    return chosen


def _joined(shapes: Balloons, centers: np.ndarray, scale: float) -> Mesh:
    """Move balloons to their centers, as one mesh."""
    per_one = shapes.positions.shape[1]
    positions = centers[:, None] + scale * shapes.positions
    faces = shapes.faces[None] + per_one * np.arange(len(centers))[:, None, None]
    return Mesh(
        jnp.asarray(positions.reshape(-1, 3), jnp.float32),
        jnp.asarray(faces.reshape(-1, 3), jnp.int32),
        jnp.asarray(shapes.normals.reshape(-1, 3), jnp.float32),
    )


def _in_front(
    balloons: Mesh, colors: np.ndarray, mesh: Mesh, camera: Camera | None
) -> Float[np.ndarray, "h w 4"]:
    view = camera_for(mesh, camera, _MARGIN)
    raster = rasterize(balloons, view, samples=SAMPLES)
    return seen_balloons(facing_of(balloons, view, raster), colors)
