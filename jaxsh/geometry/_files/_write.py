"""Write a mesh to a file of any format: what that leaves out, and how the file comes to stand."""

import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Literal, NamedTuple

from ..._core.checks import as_path, check_choice, check_type
from ..._core.files import check_place, put_in_place
from .._mesh import Mesh
from ._write_arrays import Arrays, has, on_host, problem, turned_to_y
from ._write_glb import glb_files
from ._write_obj import obj_files
from ._write_plain import off_files, ply_files, stl_files


class _Format(NamedTuple):
    """Holds how a format is written, which axis points up in it, and what it leaves out."""

    files: Callable[[Arrays, str], dict[str, bytes]]
    up: str = "z"
    leaves_out: tuple[str, ...] = ()


_POSITIONS_ONLY = ("hard edges", "uv", "colors", "materials")
_NOT_IN_OBJ = (
    "alpha of colors",
    "double-sided materials",
    "unlit materials",
    "textures that do not repeat",
)
_FORMATS = {
    ".ply": _Format(ply_files, leaves_out=("materials",)),
    ".obj": _Format(obj_files, leaves_out=_NOT_IN_OBJ),
    ".glb": _Format(glb_files, up="y", leaves_out=("colors over 1",)),
    ".stl": _Format(stl_files, leaves_out=_POSITIONS_ONLY),
    ".off": _Format(off_files, leaves_out=_POSITIONS_ONLY),
}


def write_mesh(
    path: str | os.PathLike[str], mesh: Mesh, *, up: Literal["z", "y"] | None = None
) -> Path:
    """Write a mesh to a PLY, OBJ, GLB, STL or OFF file, as its name says, and return the path.

    `read_mesh` gives the same mesh back. PLY (binary) and GLB keep positions, normals, UV and
    linear colors to the last bit of float32 but for two things: UV run downwards in GLB, which
    costs up to 3e-8, and colors are sRGB in PLY, in bytes where these give them exactly and in
    floats elsewhere, which costs up to 2e-7. OBJ has nine digits, and its colors are sRGB too. GLB
    and OBJ keep materials: GLB with its textures inside and faces grouped by material, OBJ with an
    .mtl file and .png files beside it, and faces without a material first. STL (binary) and OFF
    keep positions and faces. What a format cannot hold is left out with a `UserWarning` that says
    so.

    `mesh.origin` is added back: in float64 in PLY, with 17 digits in OBJ and OFF, as the node's
    translation in GLB. `up` names the axis of the file that points up: by default "y" in GLB and
    "z" elsewhere, as `read_mesh` takes them.

    Makes missing folders. An existing file is replaced once the new one is complete; where writing
    fails nothing is left behind. Raises `ValueError` for an unknown extension or axis, for arrays
    that do not make a mesh, for NaN and infinite values, and for an origin other than zero in STL,
    and `OSError` where a file cannot be written. Runs on the host.

    **Example**

    >>> import pathlib, tempfile
    >>> from jaxsh import geometry
    >>> knot = geometry.knot(300)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = geometry.write_mesh(pathlib.Path(folder) / "knot.ply", knot)
    ...     bool((geometry.read_mesh(path).vertices == knot.vertices).all())
    True
    """
    path = as_path(path)
    check_type("mesh", mesh, Mesh)
    suffix = path.suffix.lower()
    if suffix not in _FORMATS:
        raise ValueError(f"{path}: cannot write {suffix or 'no extension'}, only {tuple(_FORMATS)}")
    if up is not None:
        check_choice("up", up, ("z", "y"))
    arrays, form = on_host(mesh), _FORMATS[suffix]
    if reason := problem(arrays):
        raise ValueError(f"{path}: cannot be written: {reason}")
    check_place(path)
    if suffix == ".stl" and any(arrays.origin):
        raise ValueError(
            f"{path}: .stl has float32 positions, which cannot hold the origin {arrays.origin}: "
            "write .ply, or a mesh without origin"
        )
    files = form.files(turned_to_y(arrays) if (up or form.up) == "y" else arrays, path.stem)
    put_in_place({path.with_name(name) if name else path: data for name, data in files.items()})
    if lost := [what for what in form.leaves_out if has(arrays, what)]:
        warnings.warn(f"{path}: left out, as {suffix} has none: {', '.join(lost)}", stacklevel=2)
    return path
