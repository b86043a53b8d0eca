"""Meshes from trimesh and back."""

from typing import TYPE_CHECKING, Any

import numpy as np

from .._core import srgb
from .._core.checks import check_flag, check_type
from ._assemble import Origin, assemble, check_options
from ._base_color import BaseColor
from ._files._pictures import as_rgba
from ._files._polygons import Polygons
from ._files._write_arrays import on_host, problem
from ._mesh import Mesh

if TYPE_CHECKING:
    import trimesh


def from_trimesh(
    shape: "trimesh.Trimesh | trimesh.Scene",
    *,
    normals: str | float = "smooth",
    origin: Origin | None = None,
    two_sided: bool = False,
) -> Mesh:
    """Make one `Mesh` from what trimesh holds: a mesh, or a scene with all its nodes in place.

    The way in for what trimesh makes, repairs and reads (3MF and COLLADA, for instance). UV, the
    base color of materials, and colors of vertices and faces come along; 8-bit colors are taken
    for sRGB. Positions are taken as they are: `read_mesh` turns a y-up GLB, trimesh does not.
    Cleaned as in `make_mesh`, with one `UserWarning` that counts what was found.

    - `normals`: "smooth" or an angle in degrees as in `read_mesh`; "file" takes trimesh's own.
    - `origin`, `two_sided`: as in `make_mesh`.

    Raises `ValueError` for anything else, for a point cloud, and where no face is left. Runs on the
    host. Not differentiable.

    **Example**

    >>> import trimesh
    >>> from jaxsh import geometry
    >>> geometry.from_trimesh(trimesh.creation.box(), normals=30.0).vertices.shape
    (24, 3)
    """
    check_options(normals, origin)
    two_sided = check_flag("two_sided", two_sided)
    trimesh = _trimesh()
    parts: list[Any] = [shape]
    if isinstance(shape, trimesh.Scene):
        scene: Any = shape
        parts = [part for part in scene.dump() if isinstance(part, trimesh.Trimesh)]
    elif not isinstance(shape, trimesh.Trimesh):
        raise ValueError(
            f"expected a trimesh.Trimesh or trimesh.Scene, got {type(shape).__name__}; "
            "make_mesh takes arrays"
        )
    if not any(len(part.faces) for part in parts):
        raise ValueError("trimesh: it holds no faces")
    polygons = _joined([_polygons(part, normals == "file") for part in parts])
    return assemble(
        polygons,
        source="trimesh",
        corners=polygons.uv is not None or polygons.colors is not None,
        normals=normals,
        encoding="srgb",
        origin=origin,
        two_sided=two_sided,
    )


def to_trimesh(mesh: Mesh) -> "trimesh.Trimesh":
    """Make a `trimesh.Trimesh` with the mesh's normals, and its UV and material, or its colors.

    Positions are float64, `origin` added. Vertices keep their order. Colors become 8-bit sRGB.
    trimesh holds either UV or colors, and one material: where the mesh has both, UV go before
    colors, and more than one material raises `ValueError`.

    **Example**

    >>> from jaxsh import geometry
    >>> geometry.to_trimesh(geometry.knot(300)).is_watertight
    True
    """
    check_type("mesh", mesh, Mesh)
    trimesh = _trimesh()
    arrays = on_host(mesh)
    if reason := problem(arrays):
        raise ValueError(reason)
    if len(arrays.materials) > 1:
        raise ValueError(
            f"a Trimesh holds one material, got a mesh with {len(arrays.materials)}; write_mesh "
            "keeps them"
        )
    visual = None
    if arrays.uv is not None:
        visual = trimesh.visual.TextureVisuals(uv=arrays.uv, material=_material(arrays.materials))
    elif arrays.colors is not None:
        visual = trimesh.visual.ColorVisuals(vertex_colors=_eight_bit(arrays.colors))
    return trimesh.Trimesh(
        np.asarray(arrays.positions, np.float64),
        np.asarray(arrays.faces, np.int64),
        vertex_normals=np.asarray(arrays.normals, np.float64),
        visual=visual,
        process=False,
    )


def _trimesh() -> Any:
    try:
        import trimesh
    except ImportError as error:
        raise ImportError(
            "this needs the package trimesh, which cannot be imported here; make_mesh and "
            "read_mesh do without it"
        ) from error
    return trimesh


def _polygons(part: Any, own_normals: bool) -> Polygons:
    """Take one mesh apart, per corner where attributes are concerned."""
    corners = np.asarray(part.faces, np.int64).ravel()
    uv, colors, material = None, None, BaseColor()
    visual = part.visual
    if visual.kind == "texture":
        uv = None if visual.uv is None else np.asarray(visual.uv, np.float64)[corners]
        material = _base_color(visual.material)
    elif visual.kind == "vertex":
        colors = np.asarray(visual.vertex_colors, np.float64)[corners] / 255
    elif visual.kind == "face":
        colors = np.repeat(np.asarray(visual.face_colors, np.float64), 3, axis=0) / 255
    return Polygons(
        np.asarray(part.vertices, np.float64),
        corners,
        np.full(len(part.faces), 3, np.int64),
        normals=np.asarray(part.vertex_normals, np.float64)[corners] if own_normals else None,
        uv=uv,
        colors=colors,
        materials=(material,),
    )


def _joined(parts: list[Polygons]) -> Polygons:
    """Put meshes in a row; what only some of them carry is NaN on the others."""

    def together(name: str, width: int) -> np.ndarray | None:
        rows = [getattr(part, name) for part in parts]
        if all(row is None for row in rows):
            return None
        return np.concatenate(
            [
                np.full((len(part.corners), width), np.nan) if row is None else row
                for row, part in zip(rows, parts, strict=True)
            ]
        )

    starts = np.cumsum([0, *(len(part.positions) for part in parts)])
    corners = [part.corners + start for part, start in zip(parts, starts, strict=False)]
    counts = [len(part.sizes) for part in parts]
    plain = all(_plain(part) for part in parts)
    return Polygons(
        np.concatenate([part.positions for part in parts]),
        np.concatenate(corners),
        np.full(sum(counts), 3, np.int64),
        normals=together("normals", 3),
        uv=together("uv", 2),
        colors=together("colors", 4),
        polygon_material=None if plain else np.repeat(np.arange(len(parts)), counts),
        materials=() if plain else tuple(part.materials[0] for part in parts),
    )


def _plain(part: Polygons) -> bool:
    """True where the material says nothing."""
    color = part.materials[0]
    return not color.name and color.texture is None and tuple(color.factor) == (1, 1, 1, 1)


def _base_color(material: Any) -> BaseColor:
    """Take the base color of a material: 8-bit factors, as trimesh holds them, and the texture."""
    if hasattr(material, "materials"):  # several in one, by face
        raise ValueError("a mesh of trimesh with several materials: split it by material first")
    pbr = hasattr(material, "baseColorTexture")
    picture = material.baseColorTexture if pbr else material.image
    rgba = material.baseColorFactor if pbr else material.main_color
    share = np.ones(4) if rgba is None else np.asarray(rgba, np.float64) / 255
    r, g, b, a = share.tolist()
    return BaseColor(
        name=material.name or "",
        factor=(r, g, b, a),
        texture=None if picture is None else as_rgba(picture),
        double_sided=bool(getattr(material, "doubleSided", False)),
    )


def _material(materials: tuple[BaseColor, ...]) -> Any:
    from PIL import Image

    color = materials[0] if materials else BaseColor()
    picture = None if color.texture is None else Image.fromarray(np.asarray(color.texture))
    return _trimesh().visual.material.PBRMaterial(
        name=color.name,
        baseColorFactor=np.asarray(color.factor, np.float64),
        baseColorTexture=picture,
        doubleSided=color.double_sided,
    )


def _eight_bit(linear: np.ndarray) -> np.ndarray:
    encoded = np.concatenate([srgb.encode(linear[:, :3]), linear[:, 3:]], axis=1)
    return np.round(255 * np.clip(encoded, 0, 1)).astype(np.uint8)
