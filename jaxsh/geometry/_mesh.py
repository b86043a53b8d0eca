"""The mesh and its normals."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float, Int

from .._core.checks import as_float, as_integer, described
from .._core.xla import keep_rows, rows_are_split
from ._base_color import BaseColor

# Faces whose vectors stay in cache.
_BLOCK = 16_384


class Mesh(eqx.Module):
    """Holds a triangle mesh: positions, faces (counter-clockwise seen from outside), unit normals.

    `make_mesh` and `read_mesh` give float32 vertices and normals and int32 faces, with no
    degenerate face and no vertex that is NaN, infinite or in no face. A position stands there once
    for each normal, UV or color that it has: `neighbors` and `topology` join them. A `Mesh` built
    by hand is taken as it is, and raises `ValueError` where shapes or kinds of numbers do not fit.
    Differentiable in vertices and normals; the faces are constants.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh.geometry import Mesh, vertex_normals
    >>> vertices, faces = jnp.eye(3, dtype=jnp.float32), jnp.array([[0, 1, 2]])
    >>> Mesh(vertices, faces, vertex_normals(vertices, faces)).normals.shape
    (3, 3)
    """

    vertices: Float[Array, "v 3"]
    faces: Int[Array, "f 3"]
    normals: Float[Array, "v 3"]
    uv: Float[Array, "v 2"] | None = None  # (0, 0) is the lower left of the picture
    colors: Float[Array, "v 4"] | None = None  # linear RGBA
    face_material: Int[Array, " f"] | None = None  # row of `materials`, -1 for none
    materials: tuple[BaseColor, ...] = ()
    # Taken off the file's coordinates, in float64: those are `vertices` + `origin`.
    origin: tuple[float, float, float] = eqx.field(static=True, default=(0.0, 0.0, 0.0))

    def __check_init__(self):
        for name, kind, wanted in (
            ("vertices", "floats", ("v", 3)),
            ("normals", "floats", ("v", 3)),
            ("faces", "integers", ("f", 3)),
            ("uv", "floats", ("v", 2)),
            ("colors", "floats", ("v", 4)),
            ("face_material", "integers", ("f",)),
        ):
            array: Any = getattr(self, name)
            if array is None and name in ("uv", "colors", "face_material"):
                continue
            dtype = getattr(array, "dtype", None)
            like = np.shape(self.vertices if wanted[0] == "v" else self.faces)
            number = jnp.floating if kind == "floats" else jnp.integer
            if (
                dtype is None
                or getattr(array, "shape", None) != (*like[:1], *wanted[1:])
                or not jnp.issubdtype(dtype, number)
            ):
                said = str(wanted).replace("'", "")
                raise ValueError(
                    f"expected {name} of a mesh as an array {said} of {kind}, got "
                    f"{described(array)}"
                )


def vertex_normals(vertices: Float[Array, "v 3"], faces: Int[Array, "f 3"]) -> Float[Array, "v 3"]:
    """Compute unit vertex normals: the mean of the faces' normals around, weighted by their angle.

    `vertices` (v, 3) and `faces` (f, 3) give (v, 3) in the dtype of the vertices. The weight of a
    face is its angle at the vertex (Thürmer & Wüthrich 1998; compared with others by Max 1999): how
    a flat surface is cut into triangles does not matter. Where a vertex's faces cancel, have no
    area, or there are none, the normal is +z with zero gradient.

    Differentiable in the vertices, forward and reverse. Runs under `jit` and `vmap`. Faces may be
    shared out between devices, and poses along an axis in front by `vmap`; vertices may not, since
    a face names any of them: along explicit axes that raises `ValueError`, along automatic ones
    XLA gathers them. Reverse mode of poses along explicit axes needs JAX < 0.12, which transposes
    the gather; automatic axes serve above.

    **Example**

    >>> from jaxsh import geometry
    >>> mesh = geometry.knot(300)
    >>> geometry.vertex_normals(2 * mesh.vertices, mesh.faces).shape
    (300, 3)
    """
    vertices, faces = as_float(vertices, "vertices"), as_integer(faces, "faces")
    for name, array in (("vertices", vertices), ("faces", faces)):
        if array.ndim != 2 or array.shape[1] != 3:
            raise ValueError(f"expected {name} (n, 3), got shape {array.shape}")
    if rows_are_split(vertices):
        raise ValueError(
            "vertex normals need all vertices on each device, since faces name any of them: share "
            "out the faces, or poses of the mesh along an axis in front by vmap"
        )
    return keep_rows(_vertex_normals, vertices, faces, like=faces, axis=0, out=None)


@jax.jit
def _vertex_normals(vertices, faces):
    # Neither factor changes a direction: without them large or tiny meshes leave float32's range.
    points = vertices / _largest(vertices)
    # Zeros that are sharded as the points are: under `vmap` JAX >= 0.12 asks for that.
    zeros = jnp.where(jnp.zeros_like(points, dtype=bool), points, jnp.zeros_like(points))
    return _directions(zeros.at[faces].add(_shares(points[faces])))


def host_normals(
    vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]
) -> Float[np.ndarray, "v 3"]:
    """`vertex_normals` on the host, without a program to compile: a block of faces at a time."""
    points = vertices / _largest(vertices)
    sums = np.zeros((3, len(points)))
    for start in range(0, len(faces), _BLOCK):
        block = faces[start : start + _BLOCK]
        shares = _shares(points[block])
        for total, column in zip(sums, np.moveaxis(shares, -1, 0), strict=True):
            total += np.bincount(block.ravel(), column.ravel(), len(total))
    return _directions(np.ascontiguousarray(sums.T.astype(points.dtype)))


def _shares(corners: Any) -> Any:
    """Compute a face's normal times its angle at each of its corners, (..., 3, 3)."""
    numpy = np if isinstance(corners, np.ndarray) else jnp
    edges = numpy.roll(corners, -1, axis=1) - corners
    edges = edges / _largest(edges, axis=(1, 2))
    across = numpy.cross(edges[:, :1], edges[:, 1:2])
    squared = numpy.sum(across * across, axis=-1, keepdims=True)
    has_area = squared > 0
    twice_area = numpy.sqrt(numpy.where(has_area, squared, 1))
    cosines = -numpy.sum(edges * numpy.roll(edges, 1, axis=1), axis=-1, keepdims=True)
    # Sine and cosine, both times the lengths of the two edges.
    angles = numpy.arctan2(twice_area, numpy.where(has_area, cosines, 1))
    return numpy.where(has_area, angles * (across / twice_area), 0)


def _directions(sums: Any) -> Any:
    """Make vectors (v, 3) of unit length; +z where they are zero."""
    numpy = np if isinstance(sums, np.ndarray) else jnp
    sums = sums / _largest(sums, axis=-1)
    squared = numpy.sum(sums * sums, axis=-1, keepdims=True)
    has_normal = squared > 0
    unit = sums / numpy.sqrt(numpy.where(has_normal, squared, 1))
    return numpy.where(has_normal, unit, numpy.asarray([[0, 0, 1]], unit.dtype))


def _largest(x: Any, axis: int | tuple[int, ...] | None = None) -> Any:
    """Take the largest magnitude, as a constant to divide by; 1 where everything is zero."""
    numpy = np if isinstance(x, np.ndarray) else jnp
    largest = numpy.max(numpy.abs(x), axis=axis, keepdims=True, initial=0)
    largest = largest if isinstance(x, np.ndarray) else lax.stop_gradient(largest)
    return numpy.where(largest > 0, largest, numpy.ones_like(largest))
