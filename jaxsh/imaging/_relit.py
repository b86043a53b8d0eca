"""Meshes written as a light shows them, for programs that know no spherical harmonics."""

import dataclasses
import os
from pathlib import Path
from typing import Any, Literal

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from .._core import srgb
from .._core.checks import as_finite, as_path, check_choice, check_flag, check_number, check_type
from .._core.host import put
from ..geometry import BaseColor, Mesh, Texels, write_mesh
from ._base_color import check_materials
from ._display import auto_exposure


def write_relit(
    path: str | os.PathLike[str],
    surface: Mesh | Texels,
    radiance: Float[ArrayLike, "v 3"],
    *,
    exposure: float | None = None,
    textured: bool = False,
    up: Literal["z", "y"] | None = None,
) -> Path:
    """Write a mesh to a GLB or PLY file as it is shaded, and return the path.

    What is seen of vertices and texels is `tone_map(radiance, exposure)`, linear between them,
    whatever lights the program has. A GLB says so by the extension KHR_materials_unlit, which
    three.js, Babylon.js and Blender know; its vertex colors are linear floats, and light at texels
    is a texture of 8 bits inside. A PLY has vertex colors as sRGB in 8 bits, as MeshLab and
    trimesh take them. Positions and normals are written as by `geometry.write_mesh`, UV only where
    they place a texture.

    **Arguments**

    - `path`: of the file, .glb or .ply, which is replaced. Missing folders are made.
    - `surface`: a mesh, whose V vertices are shaded, or the V texels of `geometry.texels`, for a
      .glb; with these `texels.mesh` is written.
    - `radiance`: (V, 3), linear, as from `transfer.shade_diffuse`. Below 0, where a light rings, it
      is black.
    - `exposure`: what it is multiplied by before it is cut at 1: by default `auto_exposure` of it.
      Give one number to files that are to be compared.
    - `textured`: leave a mesh its materials, textures and vertex colors, in a .glb: they
      multiply the radiance at each pixel, which is then to be that of a white surface (albedo 1).
      Light is cut at 1 before it is multiplied, as glTF asks for.
    - `up`: the axis of the file that points up, as in `write_mesh`.

    Runs on the host. Raises `ValueError` for other extensions and shapes, for NaN and infinite
    values, and for `textured` in a .ply, which has no textures, without a base color, or where it
    lacks UV or `face_material`; `OSError` where the file cannot be written.

    **Example**

    >>> import pathlib, tempfile
    >>> from jaxsh import geometry, imaging, sphere, transfer
    >>> mesh = geometry.knot(300)
    >>> light = sphere.project_lat_long(imaging.studio(16, 32), degree=2)
    >>> made = transfer.unshadowed(mesh.vertices, mesh.normals, 2)
    >>> shaded = transfer.shade_diffuse(light, made, albedo=0.8)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = imaging.write_relit(pathlib.Path(folder) / "knot.glb", mesh, shaded)
    ...     geometry.read_mesh(path).materials[0].unlit
    True
    """
    path, textured = as_path(path), check_flag("textured", textured)
    check_type("surface", surface, Mesh, Texels)
    suffix = path.suffix.lower()
    if suffix not in (".glb", ".ply"):
        raise ValueError(f"{path}: cannot write {suffix or 'no extension'}, only .glb and .ply")
    if up is not None:
        check_choice("up", up, ("z", "y"))
    if isinstance(surface, Texels):
        if suffix == ".ply" or textured:
            why = "a .ply has no textures" if suffix == ".ply" else "a material has one texture"
            raise ValueError(f"{path}: {why}: expected a mesh as surface, got Texels")
        shown = _shown(radiance, surface.num_points, exposure)
        return write_mesh(path, _with_picture(surface, shown), up=up)
    shown = _shown(radiance, len(surface.vertices), exposure)
    if textured:
        return write_mesh(path, _lit(path, surface, shown), up=up)
    opaque = np.pad(shown, ((0, 0), (0, 1)), constant_values=1.0)
    if suffix == ".ply":
        codes = np.rint(255 * srgb.encode(opaque[:, :3]))
        opaque[:, :3] = srgb.decode(codes / 255)
    return write_mesh(path, _plain(surface, opaque, suffix), up=up)


def _shown(radiance: Any, count: int, exposure: float | None) -> Float[np.ndarray, "v 3"]:
    """Linear light in [0, 1], as a screen shows it."""
    light = as_finite(radiance, "radiance", wait=True)
    if light.shape != (count, 3):
        raise ValueError(f"expected radiance ({count}, 3), got shape {light.shape}")
    if exposure is None:
        exposure = float(auto_exposure(light[None]))
    exposure = check_number("exposure", exposure, above=0.0)
    return np.clip(exposure * np.asarray(light, np.float64), 0, 1)


def _with_picture(texels: Texels, shown: Float[np.ndarray, "v 3"]) -> Mesh:
    """The mesh of the texels with a texture of what they send out."""
    # Where no texel is near the mean stands: coarser levels of the picture mix it in.
    mean = jnp.asarray(shown.mean(axis=0))
    picture = np.asarray(texels.image(jnp.asarray(shown), mean), np.float64)
    codes = np.full((*texels.shape, 4), 255, np.uint8)
    codes[..., :3] = np.rint(255 * srgb.encode(picture))
    double_sided = any(material.double_sided for material in texels.mesh.materials)
    return dataclasses.replace(
        texels.mesh,
        colors=None,
        materials=(
            BaseColor("relit", texture=codes, double_sided=double_sided, unlit=True, wrap="clamp"),
        ),
        face_material=jnp.zeros(len(texels.mesh.faces), np.int32),
    )


def _plain(mesh: Mesh, colors: Float[np.ndarray, "v 4"], suffix: str) -> Mesh:
    """The mesh with colors alone; where a format has materials, in one that no light changes."""
    double_sided = any(material.double_sided for material in mesh.materials)
    materials, chosen = (), None
    if suffix == ".glb":
        materials = (BaseColor("relit", double_sided=double_sided, unlit=True),)
        chosen = jnp.zeros(len(mesh.faces), np.int32)
    single = jnp.asarray(colors, np.float32)
    # Readers prefer UV, even without a texture, to colors.
    return dataclasses.replace(
        mesh, uv=None, colors=single, materials=materials, face_material=chosen
    )


def _lit(path: Path, mesh: Mesh, shown: Float[np.ndarray, "v 3"]) -> Mesh:
    """The mesh with its base color, which the light in the vertex colors multiplies."""
    if path.suffix.lower() == ".ply":
        raise ValueError(f"{path}: a .ply has no textures to leave: write a .glb")
    if not mesh.materials and mesh.colors is None:
        raise ValueError(f"{path}: expected a mesh with materials or colors, to be left textured")
    check_materials(mesh)
    colors = np.pad(shown, ((0, 0), (0, 1)), constant_values=1.0)
    if mesh.colors is not None:
        colors = colors * np.asarray(mesh.colors, np.float64)
    own = tuple(dataclasses.replace(material, unlit=True) for material in mesh.materials)
    chosen = mesh.face_material
    chosen = np.full(len(mesh.faces), -1) if chosen is None else np.asarray(chosen)
    if (chosen < 0).any():  # a face without a material would be lit
        chosen = np.where(chosen < 0, len(own), chosen)
        own = (*own, BaseColor("relit", unlit=True))
    return dataclasses.replace(
        mesh,
        colors=put(np.clip(colors, 0, 1), np.float32),
        materials=own,
        face_material=put(chosen, np.int32),
    )
