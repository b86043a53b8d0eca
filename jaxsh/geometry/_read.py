"""Mesh files, each format by its parser, as one `Mesh`."""

import os
from typing import Literal

import numpy as np

from .._core.checks import as_path, check_choice, check_flag
from .._core.words import reason
from ._assemble import Normals, Origin, assemble, check_options
from ._files._gltf import read_gltf
from ._files._obj import read_obj
from ._files._off import read_off
from ._files._ply import read_ply
from ._files._polygons import Polygons
from ._files._stl import read_stl
from ._mesh import Mesh

_PARSERS = {
    ".ply": read_ply,
    ".obj": read_obj,
    ".off": read_off,
    ".stl": read_stl,
    ".glb": read_gltf,
    ".gltf": read_gltf,
}


def read_mesh(
    path: str | os.PathLike[str],
    *,
    up: Literal["z", "y"] | None = None,
    normals: Normals = "file",
    colors: Literal["srgb", "linear"] | None = None,
    origin: Origin | None = None,
    two_sided: bool = False,
) -> Mesh:
    """Read a PLY, OBJ, OFF, STL, GLB or glTF file into one `Mesh`.

    Several objects become one mesh, each where its scene puts it; polygons become triangles.
    Values are as in the file: lengths are not scaled. Cleaned as in `make_mesh`, with one
    `UserWarning` that counts what was dropped, and says what else of the file is ignored.

    - `up` names the axis that points up in the file: "z" takes positions as they are, "y" turns
      them, and their normals, by 90° about x, so that y becomes z. None is "y" for GLB and glTF,
      as their specification says, and "z" for all others.
    - `normals`: "file" takes the file's where it has any (not STL's, which are those of its
      facets), so that hard edges stay hard: a position becomes a vertex for each normal. "smooth"
      computes them as `vertex_normals` does, over all faces at a position. An angle in degrees
      does so too, but splits vertices where faces meet at more than that: 0 is flat shading.
      A bad normal (NaN, zero) is replaced by the smooth one.
    - `colors` says how the file encodes vertex colors: "srgb" or "linear". None is "linear" for GLB
      and glTF and "srgb" for all others, which do not say. `Mesh.colors` are linear.
    - `origin`: what to take off the coordinates (after `up`), in float64, before they become
      float32. None takes nothing off unless float32 would lose their shape: where they are over 8
      times the size of the mesh, and rounded by more than 1/1000 of the median edge. Then
      a round point near the middle is taken off, and said. `Mesh.origin` keeps it.
    - `two_sided`: of two faces that are each other's back the later is dropped, as in `make_mesh`;
      True keeps both.

    Raises `FileNotFoundError` for a missing file, and `ValueError`, naming the file and the
    problem, for an unknown extension, a damaged or truncated file, and one without faces. An OBJ
    file does not say how much it holds: cut off between two lines it cannot be told from a whole.

    **Example**

    >>> import pathlib, tempfile
    >>> from jaxsh import geometry
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "triangle.obj"
    ...     _ = path.write_text("v 0 0 0\\nv 1 0 0\\nv 0 1 0\\nf 1 2 3\\n")
    ...     geometry.read_mesh(path).vertices.shape
    (3, 3)
    """
    path = as_path(path)
    for name, value, options in (("up", up, ("z", "y")), ("colors", colors, ("srgb", "linear"))):
        if value is not None:
            check_choice(name, value, options)
    two_sided = check_flag("two_sided", two_sided)
    suffix = path.suffix.lower()
    if suffix not in _PARSERS:
        raise ValueError(f"{path}: cannot read {suffix or 'no extension'}, only {tuple(_PARSERS)}")
    gltf = suffix in (".glb", ".gltf")
    up = up or ("y" if gltf else "z")
    check_options(normals, origin)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such mesh file")
    data = path.read_bytes()
    try:
        if not data.strip():
            raise ValueError("it is empty")
        polygons = _PARSERS[suffix](path, data)
        _check(polygons, suffix)
    except Exception as error:  # a parser may raise anything when a file is damaged
        if isinstance(error, ImportError | MemoryError):
            raise
        # What glTF's reader refuses need not be damaged: a compression, say.
        kind = "" if gltf and type(error) is ValueError else f"damaged or not a {suffix} file: "
        raise ValueError(f"{path}: {kind}{reason(error)}") from error
    if up == "y":
        polygons = _turned(polygons)
    return assemble(
        polygons,
        source=str(path),
        corners=gltf or suffix == ".stl",
        normals=normals,
        encoding=colors or ("linear" if gltf else "srgb"),
        origin=origin,
        two_sided=two_sided,
    )


def _check(polygons: Polygons, suffix: str) -> None:
    """Raise `ValueError` where there are no polygons, or one names a vertex that is none."""
    if len(polygons.sizes) == 0:
        points = len(polygons.positions) if suffix == ".ply" else 0
        instead = f", but {points:,} points: those are for read_points" if points else ""
        raise ValueError(f"it holds no faces{instead}")
    count = len(polygons.positions)
    wrong = (polygons.corners < 0) | (polygons.corners >= count)
    if wrong.any():
        at = int(wrong.argmax())
        polygon = int(np.searchsorted(np.cumsum(polygons.sizes), at, side="right"))
        raise ValueError(
            f"polygon {polygon} names vertex {polygons.corners[at]}, but vertices are 0 to "
            f"{count - 1}"
        )


def _turned(polygons: Polygons) -> Polygons:
    """Turn y-up polygons by 90° about x: y becomes z."""

    def turn(vectors: np.ndarray) -> np.ndarray:
        return np.stack([vectors[:, 0], -vectors[:, 2], vectors[:, 1]], axis=1)

    normals = None if polygons.normals is None else turn(polygons.normals)
    return polygons._replace(positions=turn(polygons.positions), normals=normals)
