"""Lights and blockers as tables of triangles and spheres, in float64 on the host."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..geometry import Mesh
from ._emissive import EmissiveMesh
from ._polygon import Polygon
from ._sphere import Sphere
from ._triangulate import triangulate

Emitter = Polygon | Sphere | EmissiveMesh
Blocker = Polygon | Sphere | Mesh


class Triangles(NamedTuple):
    """Flat surfaces, their fronts where corners run counter-clockwise."""

    corners: Float[np.ndarray, "t 3 3"]
    normals: Float[np.ndarray, "t 3"]  # unit
    areas: Float[np.ndarray, " t"]
    front: Float[np.ndarray, "t 3"]  # radiance
    back: Float[np.ndarray, "t 3"]


class Spheres(NamedTuple):
    """Round surfaces; black from within."""

    centers: Float[np.ndarray, "s 3"]
    radii: Float[np.ndarray, " s"]
    radiance: Float[np.ndarray, "s 3"]


def triangles(emitters: Sequence[Emitter], blockers: Sequence[Blocker] = ()) -> Triangles:
    """Those of all polygons and meshes; the ones without area are left out."""
    corners, front, back = [np.zeros((0, 3, 3))], [np.zeros((0, 3))], [np.zeros((0, 3))]
    for surface, shines in _with_light(emitters, blockers):
        if isinstance(surface, Sphere):
            continue
        if isinstance(surface, Polygon):
            vertices = np.asarray(surface.vertices, np.float64)
            faces = triangulate(vertices)
        else:
            mesh = surface if isinstance(surface, Mesh) else surface.mesh
            vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces)
        black = np.zeros((len(faces), 3))
        light = black
        if shines and not isinstance(surface, Mesh):
            light = black + np.asarray(surface.radiance, np.float64)
        corners.append(vertices[faces])
        front.append(light)
        back.append(light if getattr(surface, "two_sided", False) else black)
    points = np.concatenate(corners)
    crosses = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    lengths = np.linalg.norm(crosses, axis=-1)
    real = lengths > 0
    normals = crosses[real] / lengths[real, None]
    light = (np.concatenate(side)[real] for side in (front, back))
    return Triangles(points[real], normals, lengths[real] / 2, *light)


def spheres(emitters: Sequence[Emitter], blockers: Sequence[Blocker] = ()) -> Spheres:
    """Those among the surfaces."""
    found = [
        (surface.center, surface.radius, surface.radiance if shines else np.zeros(3))
        for surface, shines in _with_light(emitters, blockers)
        if isinstance(surface, Sphere)
    ]
    arrays = zip(*found, strict=True) if found else ((),) * 3
    centers, radii, radiance = (np.array([np.asarray(a) for a in array]) for array in arrays)
    count = len(found)
    return Spheres(
        centers.reshape(count, 3).astype(np.float64),
        radii.reshape(count).astype(np.float64),
        radiance.reshape(count, 3).astype(np.float64),
    )


def _with_light(
    emitters: Sequence[Emitter], blockers: Sequence[Blocker]
) -> list[tuple[Emitter | Blocker, bool]]:
    return [*((emitter, True) for emitter in emitters), *((block, False) for block in blockers)]
