"""Cameras around a mesh, and how files tell them."""

import math
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import geometry, imaging


def around(
    mesh: geometry.Mesh,
    count: int,
    elevations: tuple[float, ...],
    *,
    fov_y: float,
    width: int,
    height: int,
    margin: float,
) -> list[imaging.Camera]:
    """`count` cameras around the vertical axis at each elevation in degrees, all equally far off.

    The first of each ring looks from -y. Whatever the side it is seen from, the mesh is in the
    picture, with `margin` of its half width or height free around the sphere that holds the mesh.
    """
    points = np.asarray(mesh.vertices, np.float64)
    center = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = float(np.linalg.norm(points - center, axis=1).max())
    tangent = math.tan(math.radians(fov_y) / 2) * min(1, width / height) * (1 - margin)
    distance = radius / math.sin(math.atan(tangent))
    cameras = []
    for elevation in elevations:
        for number in range(count):
            a, e = 2 * math.pi * number / count, math.radians(elevation)
            toward = [math.sin(a) * math.cos(e), -math.cos(a) * math.cos(e), math.sin(e)]
            position = center + distance * np.array(toward)
            cameras.append(
                imaging.Camera(
                    position.astype(np.float32),
                    center.astype(np.float32),
                    fov_y=fov_y,
                    width=width,
                    height=height,
                )
            )
    return cameras


def told(camera: imaging.Camera) -> dict[str, Any]:
    """The camera as JSON: ours, and as matrices in OpenCV's axes (x right, y down, z forward).

    `intrinsics` @ (`world_to_camera` @ (x, y, z, 1)) is in pixels, times the depth; the upper left
    pixel is centered at (½, ½).
    """
    focal = camera.height / (2 * math.tan(math.radians(float(camera.fov_y)) / 2))
    matrix = world_to_camera(camera)
    return {
        "position": np.asarray(camera.position).tolist(),
        "target": np.asarray(camera.target).tolist(),
        "up": np.asarray(camera.up).tolist(),
        "fov_y_degrees": float(camera.fov_y),
        "width": camera.width,
        "height": camera.height,
        "intrinsics": [[focal, 0, camera.width / 2], [0, focal, camera.height / 2], [0, 0, 1]],
        "world_to_camera": matrix.tolist(),
    }


def world_to_camera(camera: imaging.Camera) -> Float[np.ndarray, "3 4"]:
    """Turn and shift of the world into OpenCV's axes of a camera; float64."""
    position, target, up = (
        np.asarray(vector, np.float64) for vector in (camera.position, camera.target, camera.up)
    )
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    turn = np.stack([right, np.cross(forward, right), forward])
    return np.concatenate([turn, -(turn @ position)[:, None]], axis=1)


def depths(mesh: geometry.Mesh, camera: imaging.Camera) -> Float[Array, "v 1"]:
    """How far in front of the camera each vertex is, along the direction of view."""
    forward = world_to_camera(camera)[2]
    depth = np.asarray(mesh.vertices, np.float64) @ forward[:3] + forward[3]
    return jnp.asarray(depth[:, None].astype(np.float32))
