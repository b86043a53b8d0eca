"""Read a glTF 2.0 file: the polygons that its scene shows, in the stored pose."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..._core.gltf import Document, open_document
from ..._core.json_fields import extension, listed
from ._gltf_materials import Materials
from ._gltf_primitives import Part, read_parts
from ._gltf_scene import Placement, placements
from ._polygons import Polygons, unit

# Vertices whose joints are blended at once: a matrix for each takes memory.
_BLOCK = 2**14


# Numbers too large give infinite positions, which are for cleaning to find.
@np.errstate(all="ignore")
def read_gltf(path: Path, data: bytes) -> Polygons:
    """Read the bytes of a .glb or .gltf file; files that it names are looked for beside `path`.

    Positions are in the file's axes (y up) and units, node transforms, instances, morph weights
    and skins applied. Colors are linear. Raises `ValueError`, saying what was expected and what
    came, for a damaged file, for glTF 1, and for a required extension that is not known here.
    Source: Khronos, glTF 2.0 Specification.
    """
    document = open_document(path, data)
    materials = Materials(document)
    parts = [
        part
        for placement in placements(document)
        for part in _placed(document, materials, placement)
    ]
    materials.note_unread()
    document.note(
        "animations ignored: the stored pose is read",
        len(listed(document.fields, "animations", "the file")),
    )
    variants = extension(document.fields, "KHR_materials_variants", "the file") or {}
    document.note(
        "material variants ignored: the default is read",
        len(listed(variants, "variants", "KHR_materials_variants")),
    )
    if not parts:
        reasons = ", ".join(document.found) or "no mesh in its scene"
        raise ValueError(f"it holds no faces ({reasons})")
    return _joined(parts, materials, document.found)


def _placed(document: Document, materials: Materials, placement: Placement) -> Iterator[Part]:
    """Give the parts of a mesh where its nodes or joints put them, copies in one part."""
    read = read_parts(document, materials, placement.mesh, placement.weights, placement.owner)
    for part in read:
        if placement.joints is not None and part.joints is not None:
            yield _skinned(document, part, placement)
        else:
            document.spend(part.faces.size * max(len(placement.matrices) - 1, 0))
            yield _copied(part, placement.matrices)


def _copied(part: Part, matrices: Float[np.ndarray, "k 4 4"]) -> Part:
    count, size = len(matrices), len(part.positions)
    linear = matrices[:, :3, :3]
    # `einsum` is several times faster here than `@`.
    positions = np.einsum("nj,kij->kni", part.positions, linear) + matrices[:, None, :3, 3]
    cofactors, mirrored = _cofactors(linear)
    faces = np.repeat(part.faces[None], count, axis=0)
    # The specification turns mirrored faces, so that they stay counter-clockwise from outside.
    faces[mirrored] = faces[mirrored][:, :, ::-1]
    faces += size * np.arange(count)[:, None, None]
    normals = part.normals
    if normals is not None:
        normals = np.einsum("nj,kij->kni", normals, cofactors).reshape(-1, 3)

    def tiled(rows):
        return None if rows is None else np.tile(rows, (count, 1))

    return Part(
        positions.reshape(-1, 3),
        faces.reshape(-1, 3),
        part.material,
        normals,
        tiled(part.uv),
        tiled(part.colors),
    )


def _skinned(document: Document, part: Part, placement: Placement) -> Part:
    """Blend the matrices of the joints; the node's own place does not count."""
    shares, joints, matrices = part.weights, part.joints, placement.joints
    assert shares is not None
    assert joints is not None
    assert matrices is not None
    beyond = (joints >= len(matrices)) & (shares != 0)
    if beyond.any():
        raise ValueError(
            f"a vertex of mesh {placement.mesh} follows joint {joints[beyond][0]} of the skin of "
            f"{placement.owner}, which has {len(matrices)}"
        )
    joints = np.where(shares == 0, 0, joints)
    total = shares.sum(axis=1, keepdims=True)
    loose = total[:, 0] == 0
    document.note("vertices of a skin follow no joint, left in place", int(loose.sum()))
    shares = shares / np.where(total == 0, 1, total)
    positions = np.empty_like(part.positions)
    stored = part.normals
    normals = None if stored is None else np.empty_like(stored)
    sign = np.empty(len(positions))
    for start in range(0, len(positions), _BLOCK):
        block = slice(start, start + _BLOCK)
        blend = np.zeros((len(sign[block]), 4, 4))
        for share, joint in zip(shares[block].T, joints[block].T, strict=True):
            blend += share[:, None, None] * matrices[joint]
        blend = np.where(loose[block, None, None], placement.matrices[0], blend)
        linear = blend[:, :3, :3]
        positions[block] = np.einsum("nij,nj->ni", linear, part.positions[block])
        positions[block] += blend[:, :3, 3]
        cofactors, mirrored = _cofactors(linear)
        sign[block] = np.where(mirrored, -1, 1)
        if normals is not None and stored is not None:
            normals[block] = np.einsum("nij,nj->ni", cofactors, stored[block])
    faces = np.where(
        sign[part.faces].sum(axis=1, keepdims=True) < 0, part.faces[:, ::-1], part.faces
    )
    return part._replace(positions=positions, faces=faces, normals=normals)


def _cofactors(
    linear: Float[np.ndarray, "k 3 3"],
) -> tuple[Float[np.ndarray, "k 3 3"], np.ndarray]:
    """Give what turns normals, the inverse transpose up to a positive factor, and what mirrors.

    Cofactors serve also where a matrix flattens a mesh and has no inverse.
    """
    a, b, c = linear.transpose(1, 0, 2)
    cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    mirrored = np.sum(a * cofactors[:, 0], axis=1) < 0
    return np.where(mirrored[:, None, None], -cofactors, cofactors), mirrored


def _joined(parts: list[Part], materials: Materials, found: tuple[str, ...]) -> Polygons:
    """Put all parts in a row, and what their vertices carry at each corner."""
    starts = np.cumsum([0, *(len(part.positions) for part in parts)])
    ends = np.cumsum([0, *(part.faces.size for part in parts)])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=False)]

    def joined(rows: list[np.ndarray | None], width: int) -> np.ndarray | None:
        if all(row is None for row in rows):
            return None
        out = np.empty((ends[-1], width))
        for row, part, start in zip(rows, parts, ends, strict=False):
            place = out[start : start + part.faces.size]
            if row is None:
                place[:] = np.nan
            else:
                # No vertex is out of range: "clip" only spares a copy.
                np.take(row, part.faces.ravel(), axis=0, out=place, mode="clip")
        return out

    rows = np.repeat([part.material for part in parts], [len(part.faces) for part in parts])
    return Polygons(
        np.concatenate([part.positions for part in parts]),
        np.concatenate([face.ravel() for face in faces]),
        np.full(ends[-1] // 3, 3),
        joined([None if part.normals is None else unit(part.normals) for part in parts], 3),
        joined([part.uv for part in parts], 2),
        joined([part.colors for part in parts], 4),
        rows if materials.table else None,
        materials.table,
        found,
    )
