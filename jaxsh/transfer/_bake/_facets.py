"""Texels of flat faces taken to the curved surface that their vertices' normals tell of."""

import numpy as np
from jaxtyping import Float

from ...geometry import RayScene, Texels
from ._receivers import unit_normals

# Texels in a block: what is made on the way is as large as a block, not as the atlas.
_BLOCK = 2**16


def raised(
    texels: Texels,
    normals: Float[np.ndarray, "n 3"],
    least: Float[np.ndarray, " n"],
    scene: RayScene,
) -> Float[np.ndarray, "n 3"]:
    """Give the places off which rays start: on the curved surface, where that lies above a face.

    Hanika 2021, "Hacking the shadow terminator" (Ray Tracing Gems II, chapter 4): the mean, by
    barycentrics, of a texel's projections to the planes through its face's corners, across their
    normals, where these are above it. From the face itself light from the side would meet
    the next faces first, between the normal's horizon and theirs. A texel stays where it is if
    anything lies in between.
    """
    mesh = texels.mesh
    vertices, faces, ways = np.asarray(mesh.vertices), np.asarray(mesh.faces), unit_normals(mesh)
    face, weights = np.asarray(texels.face), np.asarray(texels.barycentric)
    places = np.asarray(texels.positions).astype(np.float64)
    for start in range(0, len(places), _BLOCK):
        part = slice(start, start + _BLOCK)
        corners = faces[face[part]]
        towards = ways[corners].astype(np.float64)
        above = np.einsum("nkc,nkc->nk", vertices[corners] - places[part, None], towards)
        lift = np.einsum("nk,nkc->nc", weights[part] * np.maximum(above, 0), towards)
        length = np.linalg.norm(lift, axis=1)
        some = np.flatnonzero(length > least[part])
        if len(some):
            off = places[part][some] + least[part][some, None] * normals[part][some]
            free = some[~scene.occluded(off, lift[some], length[some])]
            places[start + free] += lift[free]
    return places
