"""Mesh files: parsed by trimesh, and checked against the counts that they announce."""

import io
import os
import re
import warnings
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ._assemble import Origin, assemble, check_options
from ._files._gltf import read_gltf
from ._files._polygons import Polygons
from ._mesh import Mesh

# What trimesh need not look at. Textures would make it split and reorder vertices.
_OPTIONS: dict[str, dict[str, Any]] = {
    ".ply": {"fix_texture": False, "skip_materials": True},
    ".obj": {"maintain_order": True, "skip_materials": True},
}


# Every statement of the format (Wavefront's appendix B1): a damaged "f" must not pass for another.
_OBJ_STATEMENTS = re.compile(
    "v|vt|vn|vp|deg|bmat|step|cstype|p|l|f|curv|curv2|surf|parm|trim|hole|scrv|sp|end|con|g|s|mg|o|"
    "bevel|c_interp|d_interp|lod|usemap|maplib|usemtl|mtllib|shadow_obj|trace_obj|ctech|stech|"
    "bsp|bzp|cdc|cdp|res|call|csh"
)
# One facet of a text STL: a number too many here and one too few there would shift all between.
_STL_NUMBER = rb"\s+(?:[-+.\de]+|[-+]?nan|[-+]?inf)"
_STL_FACET = re.compile(
    rb"facet\s+normal(?:%(n)s){3}\s+outer\s+loop(?:\s+vertex(?:%(n)s){3}){3}\s+endloop\s+endfacet\s"
    % {b"n": _STL_NUMBER}
)


def read_mesh(
    path: str | os.PathLike[str],
    *,
    up: Literal["z", "y"] | None = None,
    normals: str | float = "file",
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
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in _PARSERS:
        raise ValueError(f"{path}: cannot read {suffix or 'no extension'}, only {tuple(_PARSERS)}")
    gltf = suffix in (".glb", ".gltf")
    up = up or ("y" if gltf else "z")
    if up not in ("z", "y"):
        raise ValueError(f'up must be "z" or "y", got {up!r}')
    if colors not in (None, "srgb", "linear"):
        raise ValueError(f'colors must be "srgb" or "linear", got {colors!r}')
    check_options(normals, origin)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such mesh file")
    data = path.read_bytes()
    try:
        if not data.strip():
            raise ValueError("it is empty")
        polygons = _PARSERS[suffix](path, data)
        _check(polygons)
    except Exception as error:  # a parser may raise anything when a file is damaged
        # trimesh looks for this package, which it does not require, in text that is not UTF-8.
        if isinstance(error, ImportError) and error.name != "charset_normalizer":
            raise
        reason = str(error).strip().split("\n")[0]
        raise ValueError(f"{path}: damaged or not a {suffix} file: {reason}") from error
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


def _check(polygons: Polygons) -> None:
    """Raise `ValueError` where there are no polygons, or one names a vertex that is none."""
    if len(polygons.sizes) == 0:
        raise ValueError("it holds no faces")
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


def _by_trimesh(path: Path, data: bytes) -> Polygons:
    suffix = path.suffix.lower()
    if suffix == ".obj":
        data = _plain_obj(data)
    announced = _announced(data, suffix)
    vertices, faces = _parse(data, suffix)
    # Each polygon gives at least one triangle.
    if announced and (len(vertices) != announced[0] or len(faces) < announced[1]):
        raise ValueError(
            f"it announces {announced[0]} vertices and {announced[1]} faces, "
            f"but {len(vertices)} vertices and {len(faces)} triangles could be read"
        )
    faces = np.asarray(faces, np.int64)
    return Polygons(np.asarray(vertices, np.float64), faces.ravel(), np.full(len(faces), 3))


_PARSERS = {
    **dict.fromkeys((".ply", ".obj", ".off", ".stl"), _by_trimesh),
    ".glb": read_gltf,
    ".gltf": read_gltf,
}


def _parse(data: bytes, suffix: str) -> tuple[np.ndarray, np.ndarray]:
    try:
        import trimesh
    except ImportError as error:
        raise ImportError(
            "reading mesh files needs the package trimesh, which cannot be imported here; "
            "make_mesh takes arrays without it"
        ) from error

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        # NumPy only warns when text stops making sense, and gives what it had read so far.
        warnings.filterwarnings("error", message=".*could not be read to its end")
        loaded = trimesh.load(
            io.BytesIO(data), file_type=suffix[1:], process=False, **_OPTIONS.get(suffix, {})
        )
        parts = loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded]
    meshes = [part for part in parts if isinstance(part, trimesh.Trimesh)]
    if not meshes:
        raise ValueError("it holds no faces")
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    faces = [np.asarray(mesh.faces) + offset for mesh, offset in zip(meshes, offsets, strict=False)]
    return np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces)


def _plain_obj(data: bytes) -> bytes:
    """Keep positions and faces, absolutely indexed: trimesh splits vertices at texture seams."""
    text = data.decode("utf-8", errors="replace").replace("\\\n", " ").replace("\\\r\n", " ")
    lines, count = [], 0
    for number, line in enumerate(text.splitlines(), start=1):
        key, *words = line.split("#")[0].split() or [""]
        if key and not _OBJ_STATEMENTS.fullmatch(key):
            raise ValueError(f"line {number} begins with {key!r}, which is no statement")
        if key not in ("v", "f"):
            continue
        if len(words) < 3:
            raise ValueError(f"line {number} has {len(words)} values after {key!r}")
        if key == "v":
            count += 1
            words = words[:3]
        else:
            indices = [int(word.split("/")[0]) for word in words]
            # Negative ones count back from the last vertex so far.
            indices = [i + count + 1 if i < 0 else i for i in indices]
            if min(indices) < 1:
                raise ValueError(f"line {number} names vertex {words[indices.index(min(indices))]}")
            words = map(str, indices)
        lines.append(" ".join([key, *words]))
    return "\n".join(lines).encode()


def _announced(data: bytes, suffix: str) -> tuple[int, int] | None:
    """Read the numbers of vertices and faces that a file announces: parsers accept fewer.

    None for glTF, whose parser checks the length of every chunk. Raises `ValueError` where the
    file is plainly too short.
    """
    if not data.strip():
        raise ValueError("it is empty")
    match suffix:
        case ".obj":
            return len(re.findall(rb"^v ", data, re.M)), len(re.findall(rb"^f ", data, re.M))
        case ".stl":
            facets = int.from_bytes(data[80:84], "little")
            if len(data) != 84 + 50 * facets:  # not binary
                facets = _text_facets(data.lower())
            return 3 * facets, facets
        case ".off":
            lines = [line.split(b"#")[0].split() for line in data.splitlines()]
            lines = [[word for word in line if not word.endswith(b"OFF")] for line in lines]
            lines = [line for line in lines if line]
            vertices, faces = map(int, lines[0][:2])
            _check_lines(len(lines), vertices + faces + 1)
            return vertices, faces
        case ".ply":
            header, end, body = data.partition(b"end_header")
            elements = dict(re.findall(rb"element\s+(\w+)\s+(\d+)", header))
            if not end or b"vertex" not in elements:
                raise ValueError("its header is not whole")
            if re.search(rb"format\s+ascii", header):
                _check_lines(
                    sum(map(bool, map(bytes.split, body.splitlines()))),
                    sum(map(int, elements.values())),
                )
            return int(elements[b"vertex"]), int(elements.get(b"face", 0))
    return None


def _text_facets(data: bytes) -> int:
    """Count the facets of a text STL, in lower case, if it holds nothing else."""
    rest, facets = _STL_FACET.subn(b"", re.sub(rb"(?m)^[ \t]*(?:end)?solid\b.*$", b"", data))
    if b"facet" not in data:
        raise ValueError("it is neither text nor as long as its number of facets")
    if b"endsolid" not in data:
        raise ValueError("it breaks off before endsolid")
    if rest.strip():
        odd = rest.strip().splitlines()[0][:60].decode(errors="replace")
        raise ValueError(f"its facets are damaged, first at {odd!r}")
    return facets


def _check_lines(found: int, announced: int) -> None:
    if found < announced:
        raise ValueError(f"it announces {announced} lines of data, but has {found}")
