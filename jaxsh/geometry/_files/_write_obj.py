"""Write OBJ, with its materials in an .mtl file and their textures in .png files beside it."""

import re

import numpy as np

from ..._core import srgb
from .._base_color import BaseColor
from ._pictures import png
from ._write_arrays import Arrays, digits, rows_of_text


def obj_files(arrays: Arrays, stem: str) -> dict[str, bytes]:
    """Give the files of an OBJ by name; the .obj itself, named "", comes last.

    Vertices at one position that differ in normal or UV alone share a line "v".
    """
    points = arrays.positions
    number = digits(points)
    form = f"v {number} {number} {number}"
    if arrays.colors is not None:
        points = np.concatenate([points, srgb.encode(arrays.colors[:, :3])], axis=1)
        form += " %.9g %.9g %.9g"
    shared, place = _unique_rows(points)
    text = rows_of_text(form + "\n", shared)
    if arrays.uv is not None:
        text += rows_of_text("vt {0} {0}\n".format(digits(arrays.uv)), arrays.uv)
    text += rows_of_text("vn {0} {0} {0}\n".format(digits(arrays.normals)), arrays.normals)

    corner = "%d/%d/%d" if arrays.uv is not None else "%d//%d"
    words = [place, *([np.arange(len(place))] * (corner.count("d") - 1))]
    lines = 1 + np.stack([word[arrays.faces] for word in words], axis=2).reshape(
        len(arrays.faces), -1
    )
    form = f"f {corner} {corner} {corner}\n"
    if not arrays.materials:
        return {"": (text + rows_of_text(form, lines)).encode()}

    # Readers may take these for comments, the next line, options, or the end.
    stem = re.sub(r'[#\\"]|[^\S ]|^[- ]| $', "_", stem)
    names = _unique_names(arrays.materials)
    files = _material_files(names, arrays.materials, stem)
    text = f"mtllib {stem}.mtl\n" + text
    chosen = arrays.face_material
    chosen = np.full(len(lines), -1) if chosen is None else chosen
    # There is no statement that ends the use of a material: faces without one come first.
    order = np.argsort(chosen >= 0, kind="stable")
    lines, chosen = lines[order], chosen[order]
    starts = np.flatnonzero(np.diff(chosen, prepend=-1))
    for start, end in zip([0, *starts], [*starts, len(lines)], strict=True):
        if end > start and chosen[start] >= 0:
            text += f"usemtl {names[chosen[start]]}\n"
        text += rows_of_text(form, lines[start:end])
    return {**files, "": text.encode(errors="replace")}


def _unique_rows(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Give the rows that differ, in order of first appearance, and where each row is among them."""
    _, first, group = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return rows[first[order]], rank[group.reshape(-1)]


def _unique_names(materials: tuple[BaseColor, ...]) -> list[str]:
    """Give each material a word of its own: names end at a blank in many readers, and at #."""
    names: list[str] = []
    for i, material in enumerate(materials):
        words = re.sub(r"[#\\]", "_", material.name).split()
        name = "_".join(words) or f"material_{i}"
        while name in names:
            name = f"{name}_{i}"
        names.append(name)
    return names


def _material_files(
    names: list[str], materials: tuple[BaseColor, ...], stem: str
) -> dict[str, bytes]:
    files: dict[str, bytes] = {}
    text = ""
    for i, (name, material) in enumerate(zip(names, materials, strict=True)):
        red, green, blue, alpha = map(float, material.factor)
        text += f"newmtl {name}\nKd {red:.9g} {green:.9g} {blue:.9g}\nd {alpha:.9g}\n"
        if material.texture is not None:
            files[f"{stem}_{i}.png"] = png(np.asarray(material.texture))
            text += f"map_Kd {stem}_{i}.png\n"
    return {**files, f"{stem}.mtl": text.encode(errors="replace")}
