"""Checks of `bake`: its arguments before the rays, unlit vertices after them."""

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..._core.checks import (
    as_host_float,
    as_host_integer,
    check_degree,
    check_faces,
    check_finite,
    check_flag,
    check_number,
    check_size,
    check_type,
)
from ...geometry import Mesh, RayScene
from ._blind import why_undefined
from ._device import takes_device
from ._job import BakeArguments
from ._origins import Origins

_PROBED = 256  # vertices by which the mesh is known in a scene


def checked(
    mesh: Mesh,
    degree: int,
    *,
    directions: int,
    shadows: bool,
    bounces: int,
    albedo: Any,
    ray_bias: float | None,
    offset: float | None,
    seed: int,
    chunk: int,
    scene: RayScene | None = None,
    device: bool | None,
) -> BakeArguments:
    """Give the arguments of `bake` and `bake_on` that decide a bake's bits.

    Raises `ValueError` or `TypeError` that says which argument is wrong, and how.
    """
    if scene is not None:
        check_type("scene", scene, RayScene)
    degree = check_degree(degree)
    seed = check_size("seed", seed, least=0)
    check_rays(mesh, ray_bias, offset)
    shadows = check_flag("shadows", shadows)
    directions = check_size("directions", directions)
    bounces = check_size("bounces", bounces, least=0)
    check_size("chunk", chunk)
    if bounces and not shadows:
        raise ValueError(f"bounces={bounces} needs rays, and shadows=False casts none")
    share = as_host_float(albedo, "albedo")
    if share.shape not in ((), (len(mesh.vertices),)):
        raise ValueError(
            f"albedo must be a number or have shape ({len(mesh.vertices)},), got shape "
            f"{share.shape}"
        )
    check_finite("albedo", share, least=0.0, wait=True)
    return BakeArguments(
        degree=degree,
        directions=directions,
        shadows=shadows,
        bounces=bounces,
        albedo=share,
        ray_bias=None if ray_bias is None else float(ray_bias),
        offset=None if offset is None else float(offset),
        seed=seed,
        scene=scene is not None,
        device=takes_device(device, scene) and shadows,
    )


def check_rays(mesh: Mesh, ray_bias: float | None, offset: float | None) -> None:
    """Raise `ValueError` or `TypeError` where rays cannot start from the vertices of a mesh."""
    check_type("mesh", mesh, Mesh)
    vertices = as_host_float(mesh.vertices, "vertices of the mesh")
    faces = as_host_integer(mesh.faces, "faces of the mesh")
    as_host_float(mesh.normals, "normals of the mesh")
    for name, dtype in (("vertices", vertices.dtype), ("normals", mesh.normals.dtype)):
        if dtype not in (np.float32, np.float64):
            raise ValueError(f"expected {name} of the mesh in float32 or float64, got {dtype}")
    if len(vertices) == 0:
        raise ValueError("the mesh has no vertices")
    if not np.isfinite(vertices).all():
        bad = int((~np.isfinite(vertices).all(axis=1)).sum())
        raise ValueError(f"the mesh has {bad} NaN or infinite vertices; make_mesh drops such")
    check_faces("the mesh", faces, len(vertices))
    for name, value in (("ray_bias", ray_bias), ("offset", offset)):
        if value is not None:
            check_number(name, value, above=0.0)
    if ray_bias is not None and offset is not None:
        raise ValueError(f"expected ray_bias or offset, not both: got {ray_bias!r} and {offset!r}")


def check_first(
    mesh: Mesh, scene: RayScene, normals: Float[np.ndarray, "v 3"], start: Origins
) -> None:
    """Raise `ValueError` where the scene's first mesh is not the one that light bounces off.

    Rays from some vertices, back to the surface and away from it, must meet the first mesh where
    this one has the face that they name.
    """
    faces, points = np.asarray(mesh.faces), np.asarray(mesh.vertices, np.float64)
    some = np.flatnonzero(normals.any(axis=1))
    some = some[:: -(-len(some) // _PROBED) or 1]
    origins, away = np.tile(start.positions[some], (2, 1)), normals[some]
    directions = np.concatenate([-away, away])
    if not len(some):
        return
    hit = scene.closest_hit(origins, directions)
    first = np.flatnonzero(hit.mesh == 0)
    known = first[hit.face[first] < len(faces)]
    corners = points[faces[hit.face[known]]]
    place = np.einsum("nij,ni->nj", corners, hit.barycentric[known].astype(np.float64))
    met = origins[known] + hit.distance[known, None] * directions[known]
    far = np.linalg.norm(place - met, axis=1) > 1e-3 * np.ptp(points, axis=0).max()
    if wrong := len(first) - len(known) + far.sum():
        raise ValueError(
            "expected a scene whose first mesh is the baked one, since light bounces off it, but "
            f"{wrong} of {len(first)} rays met its first mesh where the baked one has no such face"
        )


def faults(
    mesh: Mesh,
    normals: Float[np.ndarray, "v 3"],
    blind: Int[np.ndarray, " n"],
    why: Callable[[Int[np.ndarray, " n"]], list[str]],
) -> str:
    """Say how many vertices no light reaches directly, and why; nothing where there are none.

    `blind` have a normal and see nothing. `why` is asked about them only where there are any.
    """
    undefined = np.logical_not(normals.any(axis=1))
    found = []
    if count := int(undefined.sum()):
        reasons = ", ".join(why_undefined(mesh, undefined))
        found.append(f"{count} of {len(normals)} vertices have no normal ({reasons})")
    if len(blind):
        reasons = ", ".join(why(blind))
        found.append(f"{len(blind)} of {len(normals)} vertices see nothing ({reasons})")
    return f"bake: {' and '.join(found)}; they get no direct light" if found else ""
