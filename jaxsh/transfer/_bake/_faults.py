"""Checks of `bake`: its arguments before the rays, unlit vertices after them."""

from collections.abc import Callable
from typing import Any, NamedTuple

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
    described,
)
from ...geometry import Mesh, Points, RayScene, Surface, Texels
from .._surfaces import kind_of, points_and_normals
from ._blind import why_undefined
from ._device import takes_device
from ._job import BakeArguments, fingerprint
from ._origins import Origins

_PROBED = 256  # vertices by which the mesh is known in a scene


class Checked(NamedTuple):
    """Holds what decides a bake's bits, and the mesh that light bounces off and that stops rays.

    Where `scene` is a scene of rays, this stops them.
    """

    arguments: BakeArguments
    mesh: Mesh | None  # None only for points, under a scene of rays or without shadows
    scene: RayScene | None


def checked(
    surface: Surface,
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
    scene: RayScene | Mesh | None = None,
    device: bool | None,
) -> Checked:
    """Give the arguments of `bake` and `bake_on`, and who stops rays.

    Raises `ValueError` or `TypeError` that says which argument is wrong, and how.
    """
    if scene is not None:
        check_type("scene", scene, RayScene, Mesh)
    degree = check_degree(degree)
    seed = check_size("seed", seed, least=0)
    check_surface(surface, ray_bias, offset)
    shadows = check_flag("shadows", shadows)
    directions = check_size("directions", directions)
    bounces = check_size("bounces", bounces, least=0)
    check_size("chunk", chunk)
    if bounces and not shadows:
        raise ValueError(f"bounces={bounces} needs rays, and shadows=False casts none")
    cast = None if isinstance(scene, Mesh) else scene
    mesh = _in_the_way(surface, scene)
    if isinstance(surface, Points):
        _check_shadowed(scene, shadows, bounces)
    share = as_host_float(albedo, "albedo")
    if share.ndim and (mesh is None or share.shape != (len(mesh.vertices),)):
        most = "" if mesh is None else f" or have shape ({len(mesh.vertices)},)"
        hint = _of_given(surface, mesh, share)
        raise ValueError(f"albedo must be a number{most}, got shape {share.shape}{hint}")
    check_finite("albedo", share, least=0.0, wait=True)
    occluder = None
    if mesh is not None and mesh is not surface:
        occluder = fingerprint(mesh.vertices, mesh.faces, mesh.normals)
    arguments = BakeArguments(
        degree=degree,
        directions=directions,
        shadows=shadows,
        bounces=bounces,
        albedo=share,
        ray_bias=None if ray_bias is None else float(ray_bias),
        offset=None if offset is None else float(offset),
        seed=seed,
        scene=scene is not None,
        device=takes_device(device, cast) and shadows,
        surface=kind_of(surface),
        cosine=points_and_normals(surface)[1] is not None,
        occluder=occluder,
    )
    return Checked(arguments, mesh, cast)


def _of_given(surface: Surface, mesh: Mesh | None, albedo: np.ndarray) -> str:
    """Say how an albedo of the mesh that was unwrapped is taken to that of the texels."""
    if not isinstance(surface, Texels) or mesh is not surface.mesh or albedo.ndim != 1:
        return ""
    least, most = int(np.asarray(surface.vertex).max()) + 1, len(surface.vertex)
    given = least <= len(albedo) < most
    return "; that of the mesh given is albedo[texels.vertex]" if given else ""


def _in_the_way(surface: Surface, scene: RayScene | Mesh | None) -> Mesh | None:
    """Give the mesh that light bounces off, and that stops rays unless a scene of rays does."""
    if isinstance(scene, Mesh):
        if scene is not surface:
            check_mesh("scene", scene)
        return scene
    if isinstance(surface, Points):
        return None
    return surface if isinstance(surface, Mesh) else surface.mesh


def _check_shadowed(scene: RayScene | Mesh | None, shadows: bool, bounces: int) -> None:
    """Raise `ValueError` where points lack the surfaces that stop rays, or that light leaves."""
    if scene is None and shadows:
        raise ValueError(
            "points stop no rays: give scene, the mesh or the ray scene that shadows them, or "
            "shadows=False"
        )
    if bounces and not isinstance(scene, Mesh):
        raise ValueError(
            f"bounces={bounces} of points need the mesh that light bounces off: give it as scene, "
            f"in place of {described(scene)}"
        )


def check_surface(surface: Surface, ray_bias: float | None, offset: float | None) -> None:
    """Raise `ValueError` or `TypeError` where rays cannot start from the points of a surface."""
    check_type("surface", surface, Mesh, Points, Texels)
    if isinstance(surface, Mesh):
        check_rays(surface, ray_bias, offset)
        return
    _check_bias(ray_bias, offset)
    points, normals = points_and_normals(surface)
    whose = kind_of(surface)
    places = as_host_float(points, f"positions of the {whose}")
    for name, array in (("positions", points), ("normals", normals)):
        if array is not None and array.dtype not in (np.float32, np.float64):
            raise ValueError(
                f"expected {name} of the {whose} in float32 or float64, got {array.dtype}"
            )
    if bad := int((~np.isfinite(places).all(axis=1)).sum()):
        raise ValueError(f"the {whose} have {bad} NaN or infinite positions")
    if len(places) == 0:
        raise ValueError(f"there are no {whose}")
    if normals is None and (ray_bias is not None or offset is not None):
        raise ValueError(
            "ray_bias and offset are along normals: points without them cast rays from where they "
            "are"
        )
    if isinstance(surface, Texels):
        check_mesh("mesh of the texels", surface.mesh)


def check_rays(mesh: Mesh, ray_bias: float | None, offset: float | None) -> None:
    """Raise `ValueError` or `TypeError` where rays cannot start from the vertices of a mesh."""
    check_mesh("mesh", mesh)
    _check_bias(ray_bias, offset)


def check_mesh(name: str, mesh: Mesh) -> None:
    """Raise `ValueError` or `TypeError` where rays cannot be cast at a mesh."""
    check_type(name, mesh, Mesh)
    vertices = as_host_float(mesh.vertices, f"vertices of the {name}")
    faces = as_host_integer(mesh.faces, f"faces of the {name}")
    as_host_float(mesh.normals, f"normals of the {name}")
    for array, dtype in (("vertices", vertices.dtype), ("normals", mesh.normals.dtype)):
        if dtype not in (np.float32, np.float64):
            raise ValueError(f"expected {array} of the {name} in float32 or float64, got {dtype}")
    if len(vertices) == 0:
        raise ValueError(f"the {name} has no vertices")
    if not np.isfinite(vertices).all():
        bad = int((~np.isfinite(vertices).all(axis=1)).sum())
        raise ValueError(f"the {name} has {bad} NaN or infinite vertices; make_mesh drops such")
    check_faces(f"the {name}", faces, len(vertices))


def _check_bias(ray_bias: float | None, offset: float | None) -> None:
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
    surface: Surface,
    normals: Float[np.ndarray, "v 3"],
    blind: Int[np.ndarray, " n"],
    why: Callable[[Int[np.ndarray, " n"]], list[str]],
) -> str:
    """Say how many points no light reaches directly, and why; nothing where there are none.

    `blind` have a normal and see nothing. `why` is asked about them only where there are any.
    """
    undefined = np.logical_not(normals.any(axis=1))
    found = []
    whole = f"{len(normals)} {kind_of(surface)}"
    if count := int(undefined.sum()):
        reasons = ", ".join(why_undefined(surface, undefined))
        found.append(f"{count} of {whole} have no normal ({reasons})")
    if len(blind):
        reasons = ", ".join(why(blind))
        found.append(f"{len(blind)} of {whole} see nothing ({reasons})")
    return f"bake: {' and '.join(found)}; they get no direct light" if found else ""
