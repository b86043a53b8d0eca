"""A mesh out of raw arrays."""

import numpy as np
from jaxtyping import Array, Float, Int

from .._core.checks import as_host_float, as_host_integer, check_flag
from ._assemble import Normals, Origin, assemble, check_options
from ._files._polygons import Polygons
from ._mesh import Mesh


def make_mesh(
    vertices: Float[Array | np.ndarray, "v 3"],
    faces: Int[Array | np.ndarray, "f 3"],
    *,
    normals: Normals = "smooth",
    origin: Origin | None = None,
    two_sided: bool = False,
) -> Mesh:
    """Make a `Mesh` from positions (v, 3) and vertex indices (f, 3), cleaned.

    Faces that touch a NaN or infinite vertex, faces without area (to float32's resolution) and
    repeated faces are dropped, vertices at exactly the same float32 position merged, and vertices
    in no face dropped; the rest keeps its order. One `UserWarning` counts what was found.

    - `normals`: "smooth", or the angle in degrees between faces above which their edge is hard, as
      in `read_mesh`.
    - `origin`: what to take off the coordinates, in float64, before they become float32; None takes
      nothing off unless their shape would be lost, as in `read_mesh`.
    - `two_sided`: of two faces that are each other's back, as of a sheet that is to be seen from
      both sides, the later is dropped; True keeps both, each with vertices and normals of its own.

    Raises `ValueError` where shapes are wrong, an index names no vertex, or no face is left.
    Not differentiable: move the vertices of the result and call `vertex_normals`.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import geometry
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> square = geometry.make_mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    >>> square.normals.tolist()[0]
    [0.0, 0.0, 1.0]
    """
    check_options(normals, origin)
    two_sided = check_flag("two_sided", two_sided)
    if normals == "file":
        raise ValueError('normals of arrays are "smooth" or an angle in degrees, got "file"')
    vertices, faces = as_host_float(vertices, "vertices"), as_host_integer(faces, "faces")
    try:
        _check_arrays(vertices, faces)
    except ValueError as error:
        raise ValueError(f"mesh: {error}") from None
    polygons = Polygons(
        vertices.astype(np.float64),
        faces.astype(np.int64).ravel(),
        np.full(len(faces), 3, np.int64),
    )
    return assemble(
        polygons,
        source="mesh",
        corners=False,
        normals=normals,
        origin=origin,
        two_sided=two_sided,
    )


def _check_arrays(vertices: np.ndarray, faces: np.ndarray) -> None:
    """Raise `ValueError` where raw arrays have not the shapes and types of a mesh."""
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise ValueError(f"vertices must have shape (v, 3), got {vertices.shape}")
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise ValueError(f"faces must have shape (f, 3), got {faces.shape}")
    if len(faces) == 0:
        raise ValueError("it holds no faces")
    if not np.issubdtype(faces.dtype, np.integer):
        raise ValueError(f"faces must be whole numbers, got {faces.dtype}")
    wrong = (faces < 0) | (faces >= len(vertices))
    if wrong.any():
        row = int(wrong.any(axis=1).argmax())
        raise ValueError(
            f"face {row} is {faces[row].tolist()}, but vertices are 0 to {len(vertices) - 1}"
        )
