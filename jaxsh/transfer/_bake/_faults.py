"""Checks of `bake`: its arguments before the rays, unlit vertices after them."""

import math
import warnings
from typing import Any

import numpy as np
from jaxtyping import Float

from ..._core.checks import check_size
from ...geometry import Mesh


def check_arguments(
    mesh: Mesh,
    directions: int,
    shadows: bool,
    bounces: int,
    albedo: Any,
    ray_bias: float,
    chunk: int,
) -> None:
    """Raise `ValueError` that says which of `bake`'s arguments is wrong, and how."""
    if not isinstance(mesh, Mesh):
        raise ValueError(f"expected a jaxsh.geometry.Mesh, got {type(mesh).__name__}")
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    if len(vertices) == 0:
        raise ValueError("the mesh has no vertices")
    if bad := int((~np.isfinite(vertices).all(axis=1)).sum()):
        raise ValueError(f"the mesh has {bad} NaN or infinite vertices; make_mesh drops such")
    if faces.size and not 0 <= faces.min() <= faces.max() < len(vertices):
        raise ValueError(
            f"faces of the mesh name vertices {faces.min()} to {faces.max()}, but it has 0 to "
            f"{len(vertices) - 1}"
        )
    check_size("directions", directions)
    check_size("bounces", bounces, least=0)
    check_size("chunk", chunk)
    if bounces and not shadows:
        raise ValueError(f"bounces={bounces} needs rays, and shadows=False casts none")
    if not (math.isfinite(ray_bias) and ray_bias > 0):
        raise ValueError(f"ray_bias must be finite and > 0, got {ray_bias!r}")
    share = np.asarray(albedo)
    if share.shape not in ((), (len(vertices),)):
        raise ValueError(
            f"albedo must be a number or have shape ({len(vertices)},), got shape {share.shape}"
        )
    if not (np.isfinite(share) & (share >= 0)).all():
        raise ValueError("albedo must be finite and >= 0 everywhere")


def report(normals: Float[np.ndarray, "v 3"], direct: Float[np.ndarray, "v k"]) -> None:
    """Warn once, on behalf of `bake`, about vertices that no light reaches directly."""
    undefined = ~normals.any(axis=1)
    blind = ~direct.any(axis=1) & ~undefined
    found = [
        f"{count} of {len(direct)} vertices {what}"
        for count, what in (
            (int(undefined.sum()), "have no normal (it is zero or NaN, or their faces cancel)"),
            (int(blind.sum()), "see nothing (all rays are blocked, as inside the mesh)"),
        )
        if count
    ]
    if found:
        message = f"bake: {' and '.join(found)}; they get no direct light"
        warnings.warn(message, UserWarning, stacklevel=3)
