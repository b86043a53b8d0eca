"""Surfaces for a page: faces, what of them is shaded, and the base color over them."""

import dataclasses
import io
import warnings
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float, UInt8

from .._core import srgb
from .._core.checks import as_host_integer, check_faces, check_flag, check_known, described
from ..geometry import BaseColor, Mesh, Texels
from ..imaging import Raster, base_color, interpolate, sample_texture
from ..transfer import Transfer

# What browsers take along a side of a picture, phones too.
_MOST_SIDE = 4096
_MOST_CODE = 65535  # of uint16


class Surface(NamedTuple):
    """Holds what is drawn, with facts for the header and arrays for the page."""

    mesh: Mesh | None  # None where faces alone were given
    texels: Texels | None
    faces: np.ndarray  # (f, 3) int32, those of one material in a row
    tinted: bool  # whether its base color multiplies the diffuse light
    facts: dict[str, Any]
    arrays: dict[str, np.ndarray]


def make_surface(
    given: Any, transfer: Transfer, albedo: Any, textured: bool | None
) -> tuple[Surface, Any]:
    """Check what is drawn, and list it for the page; also the albedo that it is shaded with.

    Raises `ValueError` where faces, transfer, albedo and base color do not fit each other.
    """
    check_known("faces", given)
    if textured is not None:
        textured = check_flag("textured", textured)
    texels = given if isinstance(given, Texels) else None
    mesh = texels.mesh if texels is not None else given if isinstance(given, Mesh) else None
    colored = mesh is not None and (mesh.colors is not None or bool(mesh.materials))
    if textured and not colored:
        raise ValueError(
            "expected a geometry.Mesh with materials or colors for textured=True, got "
            f"{'one without' if mesh is not None else described(given)}"
        )
    tinted = colored and albedo is None if textured is None else textured
    if albedo is None:
        albedo = 1.0 if tinted else 0.8
    _check_pair(transfer, given)
    if mesh is None:
        faces = _checked_faces(given, transfer.num_points)
        return Surface(None, None, faces, False, _facts(_whole(faces)), {}), albedo
    faces = _checked_faces(mesh.faces, len(mesh.vertices))
    facts, arrays = _facts(_whole(faces)), {}
    if tinted:
        faces, facts, arrays = _tinted(mesh, faces)
    if texels is not None:
        height, width = texels.shape
        facts["texels"] = {"width": width, "height": height}
        arrays |= _of_texels(texels)
    return Surface(mesh, texels, faces, tinted, facts, arrays), albedo


def tinted(
    surface: Surface, sent: Float[Array, "v 3"], diffuse: Float[Array, "v 3"]
) -> Float[Array, "v 3"]:
    """Multiply what is diffuse of what points send out by the mean base color around."""
    assert surface.mesh is not None
    own = base_color(surface.mesh, surface.texels).astype(sent.dtype)
    return sent + diffuse * (own - 1)


def looked_up(
    surface: Surface, raster: Raster, values: Float[Array, "v 3"]
) -> Float[Array, "hn wn 3"]:
    """Carry values at vertices or texels to the samples of a raster."""
    if surface.texels is None:
        one_by_one = dataclasses.replace(raster, samples=1)
        return interpolate(one_by_one, values)
    assert raster.uv is not None
    return sample_texture(surface.texels.image(values), raster.uv, wrap="clamp")


def _checked_faces(faces: Any, count: int) -> np.ndarray:
    array = as_host_integer(faces, "faces")
    if array.ndim != 2 or array.shape[1] != 3 or len(array) == 0:
        raise ValueError(f"expected faces (f, 3), at least one, got shape {array.shape}")
    check_faces("the mesh", array, count)
    return array.astype(np.int32)


def _check_pair(transfer: Transfer, given: Any) -> None:
    if not transfer.cosine:
        raise ValueError("expected transfer of a surface, got that of points without normals")
    if isinstance(given, Mesh | Texels):
        if not transfer.belongs_to(given):
            known = isinstance(given, Texels)
            other = f"{given.num_points} texels" if known else f"{len(given.vertices)} vertices"
            raise ValueError(
                f"expected the mesh or texels that the transfer's {transfer.num_points} "
                f"{transfer.surface} are of, got {other} of other places or normals"
            )
    elif transfer.surface == "texels":
        raise ValueError("expected geometry.Texels for a transfer of texels, got faces alone")


def _of_texels(texels: Texels) -> dict[str, np.ndarray]:
    if max(texels.shape) > _MOST_SIDE:
        raise ValueError(
            f"expected texels of a picture of at most {_MOST_SIDE} along a side, got "
            f"{texels.shape[1]} × {texels.shape[0]}"
        )
    return {
        "vertices": np.asarray(texels.mesh.vertices).astype("<f4"),
        "uv": np.nan_to_num(np.asarray(texels.mesh.uv)).astype("<f4"),
        "source": np.asarray(texels.source).astype("<i4"),
    }


def _whole(faces: np.ndarray) -> list[dict[str, Any]]:
    return [{"first": 0, "count": faces.size, "factor": [1.0, 1.0, 1.0], "texture": -1}]


def _facts(groups: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    plain = {"texels": None, "tinted": False, "colored": False, "textures": []}
    return plain | {"groups": groups} | more


def _tinted(
    mesh: Mesh, faces: np.ndarray
) -> tuple[np.ndarray, dict[str, Any], dict[str, np.ndarray]]:
    """Group faces by material, each with its factor and texture, and code the vertices' colors."""
    rows = np.full(len(faces), -1)
    if mesh.materials:
        if mesh.face_material is None:
            raise ValueError(
                f"expected face_material of the mesh, which says what faces have its "
                f"{len(mesh.materials)} materials, got None"
            )
        rows = as_host_integer(mesh.face_material, "face_material")
        if rows.min() < -1 or rows.max() >= len(mesh.materials):
            raise ValueError(
                f"face_material of the mesh names materials {rows.min()} to {rows.max()}, but it "
                f"has 0 to {len(mesh.materials) - 1}"
            )
    scale, arrays = np.ones(3), {}
    if mesh.colors is not None:
        colors = np.asarray(mesh.colors, np.float64)[:, :3]
        if not (np.isfinite(colors) & (colors >= 0)).all():
            raise ValueError("colors of the mesh must be finite and >= 0")
        scale = colors.max(axis=0)
        codes = np.rint(colors / np.where(scale > 0, scale, 1) * _MOST_CODE)
        arrays["colorCodes"] = codes.astype("<u2")
    groups, pictures = [], []
    order = np.argsort(rows, kind="stable")
    for row in np.unique(rows):
        material = mesh.materials[row] if row >= 0 else BaseColor()
        number = -1
        if material.texture is not None:
            texture = np.asarray(material.texture)
            known = [
                i
                for i, (one, wrap) in enumerate(pictures)
                if wrap == material.wrap and np.array_equal(one, texture)
            ]
            number = known[0] if known else len(pictures)
            pictures += [] if known else [(texture, material.wrap)]
        at = np.flatnonzero(rows[order] == row)
        groups.append(
            {
                "first": 3 * int(at[0]),
                "count": 3 * len(at),
                "factor": (np.asarray(material.factor, np.float64)[:3] * scale).tolist(),
                "texture": number,
            }
        )
    textures = []
    if pictures and mesh.uv is None:
        raise ValueError("expected UV of a mesh whose materials have textures, got none")
    if pictures:
        arrays["uv"] = np.nan_to_num(np.asarray(mesh.uv)).astype("<f4")
    for i, (picture, wrap) in enumerate(pictures):
        arrays[f"texture{i}"] = np.frombuffer(_png(picture), np.uint8)
        textures.append({"array": f"texture{i}", "wrap": wrap})
    facts = _facts(groups, tinted=True, colored=mesh.colors is not None, textures=textures)
    return faces[order], facts, arrays


def _png(texture: UInt8[np.ndarray, "h w 4"]) -> bytes:
    """A PNG without alpha, no larger than browsers take."""
    from PIL import Image

    codes = texture[..., :3]
    if max(codes.shape[:2]) > _MOST_SIDE:
        height, width = codes.shape[:2]
        warnings.warn(
            f"a texture of {width} × {height} is halved for the page, which takes {_MOST_SIDE} "
            "along a side",
            stacklevel=6,
        )
    for axis in (0, 1):
        while codes.shape[axis] > _MOST_SIDE:
            linear = srgb.decode(codes / 255)
            last = codes.shape[axis] // 2 * 2
            halves = [linear.take(range(i, last, 2), axis) for i in (0, 1)]
            codes = np.rint(255 * srgb.encode((halves[0] + halves[1]) / 2)).astype(np.uint8)
    file = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(codes)).save(file, "PNG")
    return file.getvalue()
