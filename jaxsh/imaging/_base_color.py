"""The base color of a mesh where it is wanted: at vertices, at texels, at what a camera sees."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._core.checks import check_type
from .._core.known import at_hand
from .._core.pictures import Wrap
from .._core.xla import keep_rows
from ..geometry import BaseColor, Mesh, Texels
from ._display import srgb_decode
from ._raster import Raster, between
from ._texture import Pyramid, longer_step, pyramid, sample


def base_color(mesh: Mesh, at: Raster | Texels | None = None) -> Float[Array, "*shape 3"]:
    """Compute the base color of a mesh: factor times texture times color of the vertices.

    The albedo of its surface, linear RGB, in the dtype of the vertices; alpha is left out, since
    surfaces are read as whole. Faces without a material count as white, and so do vertices without
    a color. Textures go on beyond [0, 1] as `BaseColor.wrap` says, and are filtered as
    `sample_texture` does with a footprint: nothing finer than the places where it is wanted
    flickers.

    - `at`: where. None: at the vertices (v, 3), the mean over the faces around, each with the mean
      of its texture over an area as large as the face's cell. A `Raster` of this mesh: at each of
      its samples (height·n, width·n, 3), 0 for background, as `interpolate` takes it for `color`.
      `Texels` of it: at them (n, 3), as `transfer` takes it for an albedo. Give the mesh that the
      texels were made of, also where it was unwrapped: `texels.mesh` has then lost its textures.

    Raises `ValueError` where a texture is not of 8-bit codes or has no UV to go by, materials do
    not say which faces they are of, or a raster or texels are of another mesh, and `TypeError` for
    anything else in `at`.

    Differentiable in factors, colors of the vertices and UV; not in textures, which are 8-bit
    codes: to fit one, decode it and use `sample_texture`. Runs under `jit`. Shards over the
    raster's rows and over texels, where the mesh is whole on each device. All textures are decoded
    together, to 16 bytes a texel.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import geometry, imaging
    >>> mesh = geometry.knot(300)
    >>> raster = imaging.rasterize(mesh, imaging.Camera.facing(mesh, width=8, height=6))
    >>> imaging.base_color(mesh).shape, imaging.base_color(mesh, raster).shape
    ((300, 3), (6, 8, 3))
    """
    check_type("mesh", mesh, Mesh)
    if at is not None:
        check_type("at", at, Raster, Texels)
    check_materials(mesh)
    if at is None:
        return _at_vertices(mesh)
    if isinstance(at, Raster):
        _check_faces(mesh, "a raster", at.faces)
    elif at.mesh is not mesh:
        # Unwrapped, a mesh has more vertices, which know those that they were.
        _check_faces(mesh, "texels", at.mesh.faces, at.vertex[at.mesh.faces])
    return _at_places(mesh, at)


def check_materials(mesh: Mesh) -> None:
    """Raises `ValueError` for textures that are no codes, and without UV or faces to go by."""
    for i, material in enumerate(mesh.materials):
        texture = material.texture
        if texture is None:
            continue
        if texture.dtype != np.uint8 or texture.ndim != 3 or texture.shape[2] != 4:
            raise ValueError(
                f"expected the texture of material {i} as 8-bit sRGB (h, w, 4) in uint8, got "
                f"{texture.dtype} and shape {texture.shape}"
            )
    textured = any(material.texture is not None for material in mesh.materials)
    if textured and mesh.uv is None:
        raise ValueError(
            "a material of the mesh has a texture, but the mesh has no UV to look it up by"
        )
    if not mesh.materials:
        return
    if mesh.face_material is None:
        raise ValueError(
            f"the mesh has {len(mesh.materials)} materials, but no face_material that says which "
            "faces they are of"
        )
    if at_hand(jnp.asarray(mesh.face_material)):
        rows = np.asarray(mesh.face_material)
        if rows.size and not -1 <= rows.min() <= rows.max() < len(mesh.materials):
            raise ValueError(
                f"face_material of the mesh names materials {rows.min()} to {rows.max()}, but it "
                f"has 0 to {len(mesh.materials) - 1}"
            )


def _check_faces(mesh: Mesh, what: str, *known: Int[Array, "f 3"]) -> None:
    """Raises `ValueError` unless the faces are one of those that are known."""
    ours = jnp.asarray(mesh.faces)

    def same(faces: Array) -> bool:
        if ours.shape != faces.shape or ours is faces or not (at_hand(ours) and at_hand(faces)):
            return ours.shape == faces.shape
        return np.array_equal(ours, faces)

    if not any(same(faces) for faces in known):
        raise ValueError(
            f"expected {what} of this mesh, with its {len(ours):,} faces, got those of another "
            f"with {len(known[0]):,}"
        )


class _Surface(NamedTuple):
    """Holds factors and textures of a mesh's materials, the last row for faces that have none."""

    factor: Float[Array, "m 3"]
    textures: Pyramid | None
    picture: Int[Array, " m"]  # which texture
    wrap: tuple[Wrap | None, ...]  # None without a texture


def _surface(mesh: Mesh) -> _Surface:
    dtype = mesh.vertices.dtype
    pictures: list[Array] = [jnp.ones((1, 1, 3), dtype)]
    factors, chosen = [], []
    wraps: list[Wrap | None] = []
    for material in (*mesh.materials, BaseColor()):
        factors.append(jnp.stack([jnp.asarray(x, dtype) for x in material.factor[:3]]))
        wraps.append(None if material.texture is None else material.wrap)
        chosen.append(0 if material.texture is None else len(pictures))
        if material.texture is not None:
            codes = jnp.asarray(material.texture)[..., :3]
            pictures.append(srgb_decode(codes.astype(dtype) / 255))
    textures = pyramid(pictures, levels=True) if len(pictures) > 1 else None
    return _Surface(jnp.stack(factors), textures, jnp.asarray(chosen), tuple(wraps))


def _looked_up(surface: _Surface, material: Int[Array, "*shape"], uv, squared):
    """Look up the textures of materials, each as it goes on beyond [0, 1]."""
    assert surface.textures is not None
    picture = surface.picture[material]
    wraps: list[Wrap] = sorted({one for one in surface.wrap if one})
    found = sample(surface.textures, picture, uv, squared, wraps[0])
    for wrap in wraps[1:]:
        chosen = jnp.asarray([one == wrap for one in surface.wrap])[material]
        other = sample(surface.textures, picture, uv, squared, wrap)
        found = jnp.where(chosen[..., None], other, found)
    return found


def _material(mesh: Mesh, face: Int[Array, "*shape"]) -> Int[Array, "*shape"]:
    """The row of `_Surface` that a face has."""
    if mesh.face_material is None or not mesh.materials:
        return jnp.full_like(face, len(mesh.materials))
    row = jnp.asarray(mesh.face_material)[face]
    return jnp.where(row < 0, len(mesh.materials), row)


@jax.jit
def _at_places(mesh: Mesh, at: Raster | Texels):
    def raster(mesh: Mesh, at: Raster):
        face = jnp.maximum(at.face, 0)
        found = _colors(mesh, face, at.barycentric, at.footprint)
        return jnp.where((at.face >= 0)[..., None], found, 0)

    def texels(mesh: Mesh, at: Texels):
        footprint = None if mesh.uv is None else _texel_footprint(mesh.uv, mesh.faces, at)
        return _colors(mesh, at.face, at.barycentric, footprint)

    colors = raster if isinstance(at, Raster) else texels
    return keep_rows(colors, mesh, at, like=at.face, axis=0, out=0)


def _texel_footprint(uv, faces, texels: Texels):
    """The change of UV over a texel to the right and one down, where texels may have UV apart."""
    own = texels.mesh.uv
    assert own is not None

    def edges(uv, faces):
        corners = uv[faces[texels.face]]
        return jnp.moveaxis(corners[:, 1:] - corners[:, :1], 0, -1)

    (a, b), (c, d) = edges(own.astype(uv.dtype), texels.mesh.faces)
    area = a * d - b * c
    area = jnp.where(area == 0, jnp.inf, area)  # has no cells: looked up as it is
    height, width = texels.shape
    first, second = edges(uv, faces)
    right = (first * d[None] - second * b[None]) / (area * width)[None]
    down = (first * c[None] - second * a[None]) / (area * height)[None]
    return jnp.stack([right.T, down.T], axis=-1)


def _colors(mesh: Mesh, face, barycentric, footprint):
    """Base color at places on faces."""
    surface = _surface(mesh)
    material = _material(mesh, face)
    color = surface.factor[material]
    at = jnp.asarray(mesh.faces)[face]
    if surface.textures is not None:
        assert mesh.uv is not None
        uv = between(mesh.uv[at], barycentric)
        picture = surface.picture[material]
        squared = None
        if footprint is not None:
            squared = longer_step(footprint, *_sizes(surface.textures, picture))
        color = color * _looked_up(surface, material, uv, squared)
    if mesh.colors is not None:
        color = color * between(mesh.colors[at][..., :3].astype(color.dtype), barycentric)
    return color


@jax.jit
def _at_vertices(mesh: Mesh):
    surface = _surface(mesh)
    faces = jnp.asarray(mesh.faces)
    material = _material(mesh, jnp.arange(len(faces)))
    color = jnp.broadcast_to(surface.factor[material][:, None], (*faces.shape, 3))
    if surface.textures is not None:
        assert mesh.uv is not None
        uv = mesh.uv[faces]
        picture = surface.picture[material]
        height, width = (n.astype(uv.dtype) for n in _sizes(surface.textures, picture))
        # A vertex stands for a third of each face around it, about two faces in all.
        (a, b), (c, d) = jnp.moveaxis(uv[:, 1:] - uv[:, :1], 0, -1)  # edges
        squared = jnp.abs(a * d - b * c) * height * width
        each, squared = (jnp.broadcast_to(x[:, None], faces.shape) for x in (material, squared))
        color = color * _looked_up(surface, each, uv, squared)
    total = jnp.zeros_like(mesh.vertices).at[faces].add(color)
    count = jnp.zeros_like(mesh.vertices[:, :1]).at[faces].add(1)
    mean = jnp.where(count > 0, total / jnp.maximum(count, 1), 1)
    return mean if mesh.colors is None else mean * mesh.colors[:, :3].astype(mean.dtype)


def _sizes(textures: Pyramid, picture):
    """Height and width of textures."""
    return (jnp.asarray(n[textures.first])[picture] for n in (textures.height, textures.width))
