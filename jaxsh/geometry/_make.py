"""A mesh out of raw arrays."""

import numpy as np
from jaxtyping import Array, Float, Int

from .._core.checks import as_host_float, as_host_integer, check_flag
from ._assemble import Normals, Origin, assemble, check_options
from ._clean import check_arrays
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
        check_arrays(vertices, faces)
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
