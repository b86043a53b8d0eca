"""Lights and blockers as tables of triangles and spheres, in float64 on the host."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..geometry import Mesh
from ._emitters import EmissiveMesh, Polygon, Sphere, unit_normal, without_unit

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
    """List the triangles of all polygons and meshes; those without area are left out."""
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
    """List the spheres among the surfaces."""
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


def triangulate(vertices: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, "t 3"]:
    """Indices of the n-2 triangles of a simple polygon, wound as it is: ears, cut one by one."""
    vertices, _ = without_unit(vertices)
    normal = unit_normal(vertices)
    left, triangles = list(range(len(vertices))), []
    while len(left) > 3:
        ear = next((i for i in range(len(left)) if _is_ear(vertices[left], i, normal)), None)
        if ear is None:
            raise ValueError("expected a simple polygon, got one that crosses itself")
        triangles.append([left[ear - 1], left[ear], left[(ear + 1) % len(left)]])
        del left[ear]
    return np.array([*triangles, left], np.int32)


def _is_ear(corners: Float[np.ndarray, "n 3"], i: int, normal: Float[np.ndarray, " 3"]) -> bool:
    """Tell if the corner i is convex and its triangle holds no other corner."""
    a, b, c = corners[i - 1], corners[i], corners[(i + 1) % len(corners)]
    others = np.array([p for p in corners if not any(np.array_equal(p, q) for q in (a, b, c))])
    others = others.reshape(-1, 3)
    inside = [np.cross(q - p, others - p) @ normal >= 0 for p, q in ((a, b), (b, c), (c, a))]
    return bool(np.cross(b - a, c - b) @ normal >= 0 and not np.all(inside, axis=0).any())
