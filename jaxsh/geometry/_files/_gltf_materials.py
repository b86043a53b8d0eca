"""Read the base color of glTF materials, and where their textures lie."""

import dataclasses
import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..._core.gltf import Document
from ..._core.json_fields import Fields, extension, flag, inner, numbers, text, whole
from .._base_color import BaseColor
from ._gltf_pictures import Pictures

WRAPS = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
_REPEAT = 10497


class _Surface(NamedTuple):
    """Holds a material, and how its texture is addressed.

    `uv_matrix` is applied to (u, v, 1), v downwards.
    """

    color: BaseColor
    has_texture: bool = False
    uv_set: int = 0
    uv_matrix: Float[np.ndarray, "2 3"] | None = None
    known: bool = True  # whether the sampler's way beyond [0, 1] is that of `color`


class Materials:
    """Collects the materials that primitives use, in the order of their first use."""

    def __init__(self, document: Document):
        self._document = document
        self._pictures = Pictures(document)
        self._rows: dict[int, int] = {}
        self._surfaces: list[_Surface] = []
        self._other_maps: list[str] = []

    @property
    def table(self) -> tuple[BaseColor, ...]:
        return tuple(surface.color for surface in self._surfaces)

    def note_unread(self) -> None:
        """Note the pictures that could not be read, and those that are of no base color."""
        self._pictures.note_unread()
        names = " ".join(sorted(set(self._other_maps)))
        self._document.note(f"other maps of materials ignored ({names})", len(self._other_maps))

    def row(self, index: int, owner: str) -> int:
        """Give the row in `table` of a material of the file."""
        if index not in self._rows:
            surface = self._read(self._document.item("materials", index, owner), index)
            self._rows[index] = len(self._surfaces)
            self._surfaces.append(surface)
        return self._rows[index]

    def uv_set(self, row: int) -> int:
        """Give which TEXCOORD_n the texture of a row uses, 0 where there is none."""
        return self._surfaces[row].uv_set if row >= 0 else 0

    def has_texture(self, row: int) -> bool:
        return row >= 0 and self._surfaces[row].has_texture

    def place_uv(self, row: int, uv: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
        """Apply the material's texture transform, and turn v upwards."""
        surface = self._surfaces[row] if row >= 0 else _Surface(BaseColor())
        if surface.uv_matrix is not None:
            uv = uv @ surface.uv_matrix[:, :2].T + surface.uv_matrix[:, 2]
        bad = int((~np.isfinite(uv)).any(axis=1).sum())
        self._document.note("texture coordinates are NaN or infinite, read as 0", bad)
        if not surface.known and ((uv < 0) | (uv > 1)).any():
            self._document.note(
                "primitives leave a texture that goes on otherwise along u than v, read as repeated"
            )
        return np.stack([uv[:, 0], 1 - uv[:, 1]], axis=1)

    def _read(self, fields: Fields, index: int) -> _Surface:
        owner = f"material {index}"
        title = fields.get("name")
        name = title.encode("utf-8", "replace").decode() if isinstance(title, str) else ""
        double_sided = flag(fields, "doubleSided", owner)
        base = extension(fields, "KHR_materials_pbrSpecularGlossiness", owner)
        factor_key, texture_key = "diffuseFactor", "diffuseTexture"
        if base is None:
            base = inner(fields, "pbrMetallicRoughness", owner)
            factor_key, texture_key = "baseColorFactor", "baseColorTexture"
        factor = numbers(base, factor_key, owner, 4, [1.0, 1.0, 1.0, 1.0])
        r, g, b, a = (min(max(value, 0.0), 1.0) for value in factor)
        if factor != [r, g, b, a]:
            self._document.note("base colors beyond 0 to 1 cut off there")
        if (text(fields, "alphaMode", owner) or "OPAQUE") != "OPAQUE":
            self._document.note("materials are cut out or blended by alpha, read as whole surfaces")
        if any(numbers(fields, "emissiveFactor", owner, 3, [0.0, 0.0, 0.0])):
            self._document.note("materials that give off light read as if they did not")
        self._other_maps += _other_maps(fields, owner)
        unlit = extension(fields, "KHR_materials_unlit", owner) is not None
        surface = _Surface(BaseColor(name, (r, g, b, a), None, double_sided, unlit))
        if base.get(texture_key) is None:
            return surface
        return self._with_texture(surface, inner(base, texture_key, owner), owner)

    def _with_texture(self, surface: _Surface, info: Fields, owner: str) -> _Surface:
        number = whole(info, "index", f"the texture of {owner}")
        fields = self._document.item("textures", number, owner)
        name = f"texture {number}"
        color = dataclasses.replace(surface.color, texture=self._pictures.read(fields, name))
        uv_set, matrix = whole(info, "texCoord", owner, 0), None
        transform = extension(info, "KHR_texture_transform", owner)
        if transform is not None:
            uv_set = whole(transform, "texCoord", owner, uv_set)
            matrix = _uv_matrix(transform, f"KHR_texture_transform of {owner}")
        known = True
        if fields.get("sampler") is not None:
            sampler = self._document.item("samplers", whole(fields, "sampler", name), name)
            wraps = [whole(sampler, key, name, _REPEAT) for key in ("wrapS", "wrapT")]
            known = wraps[0] == wraps[1] and wraps[0] in WRAPS
            color = dataclasses.replace(color, wrap=WRAPS[wraps[0] if known else _REPEAT])
        return _Surface(color, True, uv_set, matrix, known)


def _other_maps(fields: Fields, owner: str) -> list[str]:
    """Name the textures of a material that are not of its base color."""
    extensions = inner(fields, "extensions", owner)
    groups = [fields, inner(fields, "pbrMetallicRoughness", owner)]
    groups += [inner(extensions, name, owner) for name in extensions]
    return [
        key
        for group in groups
        for key, value in group.items()
        if key.endswith("Texture")
        and key not in ("baseColorTexture", "diffuseTexture")
        and value is not None
    ]


def _uv_matrix(fields: Fields, owner: str) -> Float[np.ndarray, "2 3"]:
    """Give KHR_texture_transform as a matrix: translation · rotation · scale."""
    x, y = numbers(fields, "offset", owner, 2, [0.0, 0.0])
    width, height = numbers(fields, "scale", owner, 2, [1.0, 1.0])
    (angle,) = numbers({"rotation": [fields.get("rotation", 0.0)]}, "rotation", owner, 1, None)
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([[cos * width, sin * height, x], [-sin * width, cos * height, y]])
